//! Blender's Principled BSDF: the closures that its layers come to at a point.
//!
//! With `layering: cycles` lower layers are darkened as Cycles does it, by one minus
//! the albedo of the layer above towards the viewer. That keeps energy about right and
//! is not how light moves: the base does not see the layer from inside. With
//! `layering: walks` light walks among the layers.

mod blender_3;

pub use blender_3::Principled3;

use glam::Vec3;

use super::super::Surface;
use super::rough::{MIN_ALPHA, Tangent, edge_tinted, eta, film, filmed, to_model_color};
use super::value::{Number, Point, Tint};
use super::walked::{self, FixedStacks, Walked, film_seen};
use crate::bsdf::{
    Albedos, Bsdf, Closure, Diffuser, Distribution, Frame, Interface, Lambert, Listed, Method,
    Mirror, OrenNayar, Rises, RoughClosure, Sheen, WeightedClosure,
};
use crate::color::Rgb;
use smithwalk_model::layered::Interface as LayerInterface;
use smithwalk_model::{
    Conductor, ConductorFresnel, Diffuse, Estimator, Film, Glass, Side, fresnel,
};

/// What is not a socket of the node.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// Where the tangent of anisotropic reflection is.
    pub tangent: Tangent,
    /// How facets that reflect scatter.
    pub reflecting: Method,
    /// How facets of glass scatter; `None` splits glass into reflection and
    /// refraction, weighted by Fresnel's law for the whole surface.
    pub glass: Option<Method>,
    /// The albedo of layers.
    pub rises: &'static Rises,
    /// How layers darken each other.
    pub layering: Layering,
}

/// How layers darken each other.
#[derive(Clone, Copy, Debug)]
pub enum Layering {
    /// By their albedo towards the viewer.
    Cycles,
    /// By walks; with stacks made once if they are the same everywhere.
    Walks(Option<&'static FixedStacks>),
}

impl Layering {
    /// By walks, for a node without (`fixed`) or with textures.
    pub fn walks(fixed: bool) -> Self {
        // One for each material that is compiled: hundreds of bytes.
        Self::Walks(fixed.then(|| &*Box::leak(Box::default())))
    }
}

/// The node of Blender 4 and 5; sockets as in
/// [`crate::description::Principled4`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)] // those of the description say it
pub struct Principled4 {
    pub setup: Setup,
    pub base_color: Tint,
    pub metallic: Number,
    pub roughness: Number,
    pub ior: Number,
    pub alpha: Number,
    pub diffuse_roughness: Number,
    pub specular_ior_level: Number,
    pub specular_tint: Tint,
    pub anisotropic: Number,
    pub anisotropic_rotation: Number,
    pub transmission_weight: Number,
    pub coat_weight: Number,
    pub coat_roughness: Number,
    pub coat_ior: Number,
    pub coat_tint: Tint,
    pub sheen_weight: Number,
    pub sheen_roughness: Number,
    pub sheen_tint: Tint,
    pub thin_film_thickness: Number,
    pub thin_film_ior: Number,
    /// Whether the film lies on metal too.
    pub filmed_metal: bool,
    pub emission_color: Tint,
    pub emission_strength: Number,
}

/// Takes the closures of a node one by one.
struct Stack<'a, 'b, const F: u32> {
    bsdf: &'a mut Bsdf<F>,
    surface: &'b Surface,
}

impl<const F: u32> Stack<'_, '_, F> {
    /// Adds a closure that is sampled as often as it is bright: `albedo` is about
    /// what it reflects without its weight.
    fn push(&mut self, closure: Closure, frame: Frame, weight: Rgb, albedo: Rgb) {
        self.bsdf.push(WeightedClosure {
            weight,
            // What is weighted is sampled, however dark it was taken for.
            chance: if weight.max_element() > 0.0 {
                ((weight * albedo).element_sum() / 3.0).max(LEAST_CHANCE)
            } else {
                0.0
            },
            frame,
            closure,
        });
    }

    fn push_plain(&mut self, closure: Closure, weight: Rgb, albedo: Rgb) {
        self.push(closure, Frame::about(self.surface.normal), weight, albedo);
    }
}

/// What is let straight through, by the true surface.
pub(super) fn push_transparent<const F: u32>(bsdf: &mut Bsdf<F>, surface: &Surface, share: f32) {
    let frame = Frame::about(surface.geometric_normal);
    let closure = Closure::Transparent(Rgb::ONE);
    Stack { bsdf, surface }.push(closure, frame, Rgb::splat(share), Rgb::ONE);
}

/// What lies above all layers: light is let straight through beside a share of
/// `opacity`, and of that one fibres leave the part `left` to what is below.
pub(super) fn push_cover<const F: u32>(
    bsdf: &mut Bsdf<F>,
    surface: &Surface,
    share: f32,
    opacity: f32,
    (fibres, left): (Option<Closure>, f32),
) {
    if opacity < 1.0 {
        push_transparent(bsdf, surface, share * (1.0 - opacity));
    }
    if let Some(closure) = fibres {
        let weight = Rgb::splat(share * opacity);
        Stack { bsdf, surface }.push_plain(closure, weight, Rgb::splat(1.0 - left));
    }
}

/// The least that a chance is taken for.
pub(super) const LEAST_CHANCE: f32 = 1e-3;

/// Shares up to this are none, as in Cycles.
pub(super) const NONE: f32 = 1e-5;

/// A mirror or rough metal.
pub(super) fn reflecting(
    alphas: [f32; 2],
    fresnel: ConductorFresnel<f32>,
    method: Method,
) -> Closure {
    if alphas == [0.0; 2] {
        return Closure::Mirror(Mirror { fresnel });
    }
    rough(alphas, Conductor { fresnel }, method)
}

fn rough(alphas: [f32; 2], facets: impl Listed, method: Method) -> Closure {
    let alphas = alphas.map(|alpha| alpha.max(MIN_ALPHA));
    Closure::Rough(RoughClosure::new(Distribution::Ggx, alphas, facets, method))
}

/// Glass, rough or smooth, seen from the side of `eta`.
pub(super) fn transmitting(
    alphas: [f32; 2],
    glass: Glass<f32>,
    cos: f32,
    method: Method,
) -> Closure {
    if alphas == [0.0; 2] {
        smooth_glass(glass, cos)
    } else {
        rough(alphas, glass, method)
    }
}

/// A diffuse base by itself; facets of slope roughness `alpha`.
pub(super) fn diffuse_facets(albedo: Rgb, alpha: f32) -> Closure {
    let albedo = albedo.min(Rgb::ONE);
    if alpha <= NONE {
        return Closure::Lambert(Lambert { albedo });
    }
    let facets = Diffuse {
        albedo: to_model_color(albedo),
    };
    let method = Method::Multiple(Estimator::TwoWalk);
    let alphas = [alpha; 2];
    Closure::Rough(RoughClosure::new(
        Distribution::Beckmann,
        alphas,
        facets,
        method,
    ))
}

/// α along the tangent and across, by the node's rule.
fn stretched(roughness: f32, anisotropic: f32) -> [f32; 2] {
    let alpha = roughness * roughness;
    let aspect = (1.0 - 0.9 * anisotropic).sqrt();
    [(alpha / aspect).min(1.0), alpha * aspect]
}

fn mix(a: Rgb, b: Rgb, share: Rgb) -> Rgb {
    a + (b - a) * share
}

/// What scaling takes off single scattering on dielectric facets because they keep
/// little of the light; 1 for other methods.
fn darkening(method: Method, alphas: [f32; 2], cos: f32, kept: Rgb) -> Rgb {
    let Method::Compensated(albedos) = method else {
        return Rgb::ONE;
    };
    let width = (alphas[0] * alphas[1]).sqrt();
    kept.map(|f| Albedos::darkening(albedos, width, cos, f))
}

/// F̄ of a dielectric between 1 and 3, (η − 1)/(4.08567 + 1.00071 η), and below 1
/// (Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks").
fn mean_fresnel(eta: f32) -> f32 {
    if eta < 1.0 {
        0.997_118 + eta * (0.1014 - eta * (0.965_241 + eta * 0.130_607))
    } else {
        (eta - 1.0) / (4.085_67 + 1.000_71 * eta)
    }
}

impl Principled4 {
    /// Adds the closures of the node, all together with this weight.
    pub(super) fn add<const F: u32>(
        &self,
        bsdf: &mut Bsdf<F>,
        point: &Point<'_>,
        surface: &Surface,
        share: f32,
    ) {
        let alpha = self.alpha.share::<F>(point);
        let (fibres, left) = self.sheen::<F>(point);
        push_cover(bsdf, surface, share, alpha, (fibres, left));
        let share = share * left;
        if let Layering::Walks(fixed) = self.setup.layering {
            let frame = self.frame::<F>(point, surface);
            let (walked, plain) = self.walked::<F>(point, share * alpha, fixed);
            walked.add(bsdf, surface, frame, plain);
            return;
        }
        let method = self.setup.reflecting;
        let mut stack = Stack { bsdf, surface };
        let mut weight = self.coat::<F>(point, share, |closure, weight, albedo| {
            stack.push_plain(closure, weight, albedo);
        });

        let base = self.base_color.at::<F>(point).max(Rgb::ZERO);
        let clamped = base.min(Rgb::ONE);
        let roughness = self.roughness.share::<F>(point);
        let alphas = stretched(roughness, self.anisotropic.share::<F>(point));
        let frame = self.frame::<F>(point, surface);
        let tint = self.specular_tint.at::<F>(point).max(Rgb::ZERO);
        let film = self.film::<F>(point);

        let metallic = self.metallic.share::<F>(point);
        if metallic > NONE {
            let fresnel = edge_tinted(clamped, tint.min(Rgb::ONE));
            let fresnel = filmed(fresnel, film.filter(|_| self.filmed_metal));
            let closure = reflecting(alphas, fresnel, method);
            stack.push(closure, frame, weight * metallic, clamped);
            weight *= 1.0 - metallic;
        }

        let ior = self.ior.at::<F>(point).max(NONE);
        let transmission = self.transmission_weight.share::<F>(point);
        if transmission > NONE {
            let eta = eta(ior, point.front);
            // The reflectance at normal incidence is a share at most.
            let f0 = fresnel::normal_reflectance(ior);
            let reflection = if f0 > 0.0 {
                tint.min(Rgb::splat(1.0 / f0))
            } else {
                tint
            };
            let alpha = roughness * roughness;
            let glass = Glass {
                eta,
                reflection: to_model_color(reflection),
                transmission: to_model_color(clamped.map(f32::sqrt)),
                film: film_seen(film, ior, point.front),
            };
            let method = self.setup.glass.unwrap_or(method);
            let closure = transmitting([alpha; 2], glass, point.cos, method);
            stack.push_plain(closure, weight * transmission, Rgb::ONE);
            weight *= 1.0 - transmission;
        }

        let level = self.specular_ior_level.at::<F>(point).max(0.0);
        let (f0, eta) = leveled(ior, level);
        if eta != 1.0 && weight.max_element() > 0.0 {
            let f0 = (tint * f0).clamp(Rgb::ZERO, Rgb::ONE);
            let (fresnel, own) = if let Some(film) = film {
                let fresnel = ConductorFresnel::Film {
                    film,
                    eta: to_model_color(Rgb::splat(eta)),
                    k: to_model_color(Rgb::ZERO),
                };
                (fresnel, Rgb::from(fresnel.reflectance(point.cos).0))
            } else {
                let fresnel = ConductorFresnel::Dielectric {
                    eta,
                    f0: to_model_color(f0),
                    f90: to_model_color(Rgb::ONE),
                };
                (fresnel, self.layer(alphas, point.cos, eta, f0, method))
            };
            stack.push(reflecting(alphas, fresnel, method), frame, weight, own);
            weight *= (1.0 - own.max_element()).clamp(0.0, 1.0);
        }

        let roughness = self.diffuse_roughness.share::<F>(point);
        let closure = if roughness > NONE {
            let wo = Vec3::new(
                (1.0 - point.cos * point.cos).max(0.0).sqrt(),
                0.0,
                point.cos,
            );
            Closure::Diffuser(Diffuser::OrenNayar(OrenNayar::of_cycles_4(
                base, roughness, wo,
            )))
        } else {
            Closure::Lambert(Lambert { albedo: base })
        };
        stack.push_plain(closure, weight, base);
    }

    /// The film below the coat.
    fn film<const F: u32>(&self, point: &Point<'_>) -> Option<Film<f32>> {
        let thickness = self.thin_film_thickness.at::<F>(point);
        (thickness > NONE).then(|| film(self.thin_film_ior.at::<F>(point), thickness, 1.0))
    }

    /// The sheen, and the share of light that it leaves to what lies below.
    fn sheen<const F: u32>(&self, point: &Point<'_>) -> (Option<Closure>, f32) {
        let weight = self.sheen_weight.at::<F>(point).max(0.0);
        if weight <= NONE {
            return (None, 1.0);
        }
        let color = self.sheen_tint.at::<F>(point).max(Rgb::ZERO) * weight;
        let (closure, left) = fibres(color, self.sheen_roughness.share::<F>(point), point.cos);
        (Some(closure), left)
    }

    fn frame<const F: u32>(&self, point: &Point<'_>, surface: &Surface) -> Frame {
        let rotation = self.anisotropic_rotation;
        self.setup.tangent.frame::<F>(rotation, point, surface)
    }

    /// The node's layers as they are, of this weight, and the diffuse base alone.
    fn walked<const F: u32>(
        &self,
        point: &Point<'_>,
        weight: f32,
        fixed: Option<&'static FixedStacks>,
    ) -> (Walked, Closure) {
        let base = self.base_color.at::<F>(point).clamp(Rgb::ZERO, Rgb::ONE);
        let tint = self.specular_tint.at::<F>(point).max(Rgb::ZERO);
        let roughness = self.roughness.share::<F>(point);
        let alphas = stretched(roughness, self.anisotropic.share::<F>(point));
        let metallic = self.metallic.share::<F>(point);
        let transmission = self.transmission_weight.share::<F>(point);
        let ior = self.ior.at::<F>(point).max(NONE);
        let (_, leveled) = leveled(ior, self.specular_ior_level.at::<F>(point).max(0.0));

        let coat_roughness = self.coat_roughness.share::<F>(point);
        let coat_ior = self.coat_ior.at::<F>(point).max(1.0);
        let film = self.film::<F>(point);
        let coat = walked::coat(
            coat_ior,
            [coat_roughness * coat_roughness; 2],
            self.coat_tint.at::<F>(point),
        );
        let fresnel = edge_tinted(base, tint.min(Rgb::ONE));
        let fresnel = filmed(fresnel, film.filter(|_| self.filmed_metal));
        let through = LayerInterface {
            transmission: to_model_color(base.map(f32::sqrt)),
            ..walked::interface(ior, 1.0, [roughness * roughness; 2], tint, film)
        };
        let glass = walked::glass(through, point.front);
        let alpha = roughness * roughness;
        let method = self.setup.glass.unwrap_or(self.setup.reflecting);
        let dull = self.diffuse_roughness.share::<F>(point);
        let plastic = (1.0 - metallic) * (1.0 - transmission);
        let walked = Walked {
            weight,
            coat: (self.coat_weight.share::<F>(point), coat),
            metal: (
                metallic,
                reflecting(alphas, fresnel, self.setup.reflecting),
                walked::metal(alphas, fresnel, coat_ior),
            ),
            glass: (
                (1.0 - metallic) * transmission,
                transmitting([alpha; 2], glass, point.cos, method),
                through,
            ),
            plastic: (
                plastic,
                [walked::interface(leveled, 1.0, alphas, tint, film); 2],
                walked::diffuse(base, dull),
            ),
            fixed,
        };
        (walked, diffuse_facets(base, dull))
    }

    /// The albedo towards the viewer of a layer of such an interface, as Cycles
    /// takes it.
    fn layer(&self, alphas: [f32; 2], cos: f32, eta: f32, f0: Rgb, method: Method) -> Rgb {
        let width = (alphas[0] * alphas[1]).sqrt();
        let rise = self.setup.rises.at(width, cos, eta);
        let own = fresnel::normal_reflectance(eta);
        let mean_rise = ((mean_fresnel(eta) - own) / (1.0 - own)).clamp(0.0, 1.0);
        let kept = mix(f0, Rgb::ONE, Rgb::splat(mean_rise));
        mix(f0, Rgb::ONE, Rgb::splat(rise)) * darkening(method, alphas, cos, kept)
    }

    /// Gives the coat to `push`, and what is left for what lies below, of
    /// `share` and the node's alpha.
    fn coat<const F: u32>(
        &self,
        point: &Point<'_>,
        share: f32,
        mut push: impl FnMut(Closure, Rgb, Rgb),
    ) -> Rgb {
        let mut weight = Rgb::splat(share * self.alpha.share::<F>(point));
        let coat_weight = self.coat_weight.at::<F>(point).max(0.0);
        if coat_weight > NONE {
            let roughness = self.coat_roughness.share::<F>(point);
            let alphas = [roughness * roughness; 2];
            let eta = self.coat_ior.at::<F>(point).max(1.0);
            let method = self.setup.reflecting;
            if eta > 1.0 {
                let f0 = Rgb::splat(fresnel::normal_reflectance(eta));
                let fresnel = ConductorFresnel::Dielectric {
                    eta,
                    f0: to_model_color(f0),
                    f90: to_model_color(Rgb::ONE),
                };
                let own = self.layer(alphas, point.cos, eta, f0, method);
                push(
                    reflecting(alphas, fresnel, method),
                    weight * coat_weight,
                    own,
                );
                weight *= (1.0 - coat_weight * own.max_element()).clamp(0.0, 1.0);
            }
            let tint = self.coat_tint.at::<F>(point).max(Rgb::ZERO);
            if tint != Rgb::ONE {
                // Beer and Lambert along the refracted ray, the tint being that of the
                // normal one.
                let sin2 = (1.0 - point.cos * point.cos) / (eta * eta);
                let length = (1.0 - sin2).max(NONE).sqrt().recip();
                let through = tint.map(|c| c.powf(length));
                weight *= mix(Rgb::ONE, through, Rgb::splat(coat_weight));
            }
        }
        weight
    }

    /// The radiance of the node itself, W·m⁻²·sr⁻¹; the coat lies above.
    pub(super) fn emission<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        let strength = self.emission_strength.at::<F>(point).max(0.0);
        if strength == 0.0 {
            return Rgb::ZERO;
        }
        let (_, left) = self.sheen::<F>(point);
        let below = self.coat::<F>(point, left, |_, _, _| {});
        self.emission_color.at::<F>(point) * strength * below
    }

    /// How many closures it comes to at the most.
    pub(super) fn most_closures(&self) -> usize {
        let absent = [
            self.alpha.is(1.0),
            self.coat_weight.is(0.0),
            self.metallic.is(0.0),
            self.transmission_weight.is(0.0),
            self.sheen_weight.is(0.0),
        ];
        if let Layering::Walks(_) = self.setup.layering {
            let [opaque, bare, no_metal, no_glass, no_sheen] = absent.map(usize::from);
            return (1 - opaque) + (1 - no_sheen) + (2 - bare) * (3 - no_metal - no_glass);
        }
        7 - absent.into_iter().filter(|&absent| absent).count()
    }

    /// Whether its emission differs by who looks.
    pub(in super::super) fn is_covered(&self) -> bool {
        !(self.coat_weight.is(0.0) && self.sheen_weight.is(0.0))
    }
}

/// Sheen seen at the cosine `cos`, and the share of light that it leaves to what lies
/// below: as in Cycles, by its albedo towards the viewer.
pub(super) fn fibres(color: Rgb, roughness: f32, cos: f32) -> (Closure, f32) {
    let sheen = Sheen::new(color, roughness, cos.min(1.0));
    let left = 1.0 - (color.max_element() * sheen.albedo).clamp(0.0, 1.0);
    (Closure::Diffuser(Diffuser::Sheen(sheen)), left)
}

/// F₀ and η with the node's level: ½ leaves them as they are.
fn leveled(ior: f32, level: f32) -> (f32, f32) {
    let f0 = fresnel::normal_reflectance(ior);
    if level == 0.5 {
        return (f0, ior);
    }
    let f0 = f0 * 2.0 * level;
    let root = f0.clamp(0.0, 0.99).sqrt();
    let eta = (1.0 + root) / (1.0 - root);
    (f0, if ior < 1.0 { 1.0 / eta } else { eta })
}

/// A smooth interface with the colours of glass at this angle.
fn smooth_glass(glass: Glass<f32>, cos: f32) -> Closure {
    let cos = cos.min(1.0);
    Closure::Interface(Interface {
        eta: glass.eta,
        reflected: Some(Rgb::from(glass.reflected(Side::Above, cos).0)),
        refracted: Rgb::from(glass.transmitted(Side::Above, cos).0),
    })
}

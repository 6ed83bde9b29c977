//! Blender's Principled BSDF: the closures that its layers come to at a point.
//!
//! Lower layers are darkened as Cycles does it, by one minus the albedo of the
//! layer above towards the viewer. That keeps energy about right and is not how
//! light moves: the base does not see the layer from inside.

use glam::Vec3;

use super::super::Surface;
use super::rough::{MIN_ALPHA, Tangent, edge_tinted, eta, to_model_color};
use super::value::{Number, Point, Tint};
use crate::bsdf::{
    Albedos, Bsdf, Clearcoat, Closure, Diffuser, Distribution, Frame, Interface, Lambert, Listed,
    Method, Mirror, OrenNayar, Rises, RoughClosure, WeightedClosure,
};
use crate::color::{Rgb, luminance};
use smithwalk_model::{Conductor, ConductorFresnel, Glass, Refraction, fresnel};

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
}

/// The node of Blender 2.8 to 3.6; sockets as in
/// [`crate::description::Principled3`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)] // those of the description say it
pub struct Principled3 {
    pub setup: Setup,
    pub base_color: Tint,
    pub subsurface: Number,
    pub subsurface_color: Tint,
    pub metallic: Number,
    pub specular: Number,
    pub specular_tint: Number,
    pub roughness: Number,
    pub anisotropic: Number,
    pub anisotropic_rotation: Number,
    pub sheen: Number,
    pub sheen_tint: Number,
    pub clearcoat: Number,
    pub clearcoat_roughness: Number,
    pub ior: Number,
    pub transmission: Number,
    pub transmission_roughness: Number,
    pub emission: Tint,
    pub emission_strength: Number,
    pub alpha: Number,
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

    /// What is let straight through, by the true surface.
    fn push_transparent(&mut self, share: f32) {
        let frame = Frame::about(self.surface.geometric_normal);
        let closure = Closure::Transparent(Rgb::ONE);
        self.push(closure, frame, Rgb::splat(share), Rgb::ONE);
    }
}

/// The least that a chance is taken for.
const LEAST_CHANCE: f32 = 1e-3;

/// Shares up to this are none, as in Cycles.
const NONE: f32 = 1e-5;

/// A mirror or rough metal.
fn reflecting(alphas: [f32; 2], fresnel: ConductorFresnel<f32>, method: Method) -> Closure {
    if alphas == [0.0; 2] {
        return Closure::Mirror(Mirror { fresnel });
    }
    rough(alphas, Conductor { fresnel }, method)
}

fn rough(alphas: [f32; 2], facets: impl Listed, method: Method) -> Closure {
    let alphas = alphas.map(|alpha| alpha.max(MIN_ALPHA));
    Closure::Rough(RoughClosure::new(Distribution::Ggx, alphas, facets, method))
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
        let mut stack = Stack { bsdf, surface };
        let method = self.setup.reflecting;
        let alpha = self.alpha.share::<F>(point);
        if alpha < 1.0 {
            stack.push_transparent(share * (1.0 - alpha));
        }
        let mut weight = self.coat::<F>(point, share, |closure, weight, albedo| {
            stack.push_plain(closure, weight, albedo);
        });

        let base = self.base_color.at::<F>(point).max(Rgb::ZERO);
        let clamped = base.min(Rgb::ONE);
        let roughness = self.roughness.share::<F>(point);
        let alphas = stretched(roughness, self.anisotropic.share::<F>(point));
        let frame = self
            .setup
            .tangent
            .frame::<F>(self.anisotropic_rotation, point, surface);
        let tint = self.specular_tint.at::<F>(point).max(Rgb::ZERO);

        let metallic = self.metallic.share::<F>(point);
        if metallic > NONE {
            let fresnel = edge_tinted(clamped, tint.min(Rgb::ONE));
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
            };
            let closure = if alpha > 0.0 {
                rough([alpha; 2], glass, self.setup.glass.unwrap_or(method))
            } else {
                smooth_glass(glass, point.cos)
            };
            stack.push_plain(closure, weight * transmission, Rgb::ONE);
            weight *= 1.0 - transmission;
        }

        let level = self.specular_ior_level.at::<F>(point).max(0.0);
        let (f0, eta) = leveled(ior, level);
        if eta != 1.0 && weight.max_element() > 0.0 {
            let f0 = (tint * f0).clamp(Rgb::ZERO, Rgb::ONE);
            let fresnel = ConductorFresnel::Dielectric {
                eta,
                f0: to_model_color(f0),
                f90: to_model_color(Rgb::ONE),
            };
            let own = self.layer(alphas, point.cos, eta, f0, method);
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
        let below = self.coat::<F>(point, 1.0, |_, _, _| {});
        self.emission_color.at::<F>(point) * strength * below
    }

    /// How many closures it comes to at the most.
    pub(super) fn most_closures(&self) -> usize {
        let absent = [
            self.alpha.is(1.0),
            self.coat_weight.is(0.0),
            self.metallic.is(0.0),
            self.transmission_weight.is(0.0),
        ];
        6 - absent.into_iter().filter(|&absent| absent).count()
    }

    /// Whether its emission differs by who looks.
    pub(in super::super) fn is_coated(&self) -> bool {
        !self.coat_weight.is(0.0)
    }
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
    Closure::Interface(Interface {
        eta: glass.eta,
        reflected: Some(Rgb::from(glass.reflected(cos.min(1.0), glass.eta).0)),
        refracted: Rgb::from(glass.transmitted().0),
    })
}

impl Principled3 {
    /// Adds the closures of the node, all together with this weight.
    pub(super) fn add<const F: u32>(
        &self,
        bsdf: &mut Bsdf<F>,
        point: &Point<'_>,
        surface: &Surface,
        share: f32,
    ) {
        let mut stack = Stack { bsdf, surface };
        let alpha = self.alpha.share::<F>(point);
        if alpha < 1.0 {
            stack.push_transparent(share * (1.0 - alpha));
        }
        let weight = Rgb::splat(share * alpha);
        let base = self.base_color.at::<F>(point).max(Rgb::ZERO);
        let metallic = self.metallic.share::<F>(point);
        let transmission = self.transmission.share::<F>(point);
        let diffuse = (1.0 - metallic) * (1.0 - transmission);
        let glass = transmission * (1.0 - metallic);
        let roughness = self.roughness.share::<F>(point);

        if diffuse > NONE {
            self.add_base::<F>(&mut stack, point, weight * diffuse, base, roughness);
        }

        let specular = self.specular.at::<F>(point).max(0.0);
        if glass < 1.0 - NONE && (specular > NONE || metallic > NONE) {
            let root = (0.08 * specular).min(0.99).sqrt();
            let eta = 2.0 / (1.0 - root) - 1.0;
            let tinted = self.specular_tint.share::<F>(point);
            // Not Rec. 709's weights: as the node has it.
            let gray = base.dot(Rgb::new(0.3, 0.6, 0.1));
            let hue = mix(Rgb::ONE, hue(base, gray), Rgb::splat(tinted));
            let f0 = hue * (0.08 * specular * (1.0 - metallic)) + base * metallic;
            let f0 = f0.clamp(Rgb::ZERO, Rgb::ONE);
            let fresnel = ConductorFresnel::Dielectric {
                eta,
                f0: to_model_color(f0),
                f90: to_model_color(Rgb::ONE),
            };
            let alphas = stretched(roughness, self.anisotropic.share::<F>(point));
            let frame = self
                .setup
                .tangent
                .frame::<F>(self.anisotropic_rotation, point, surface);
            let bright = Rgb::from(fresnel.reflectance(point.cos).0);
            let method = self.setup.reflecting;
            let method = if roughness <= 0.075 {
                Method::Single
            } else {
                method
            };
            let closure = reflecting(alphas, fresnel, method);
            stack.push(closure, frame, weight * (1.0 - glass), bright);
        }

        if glass > NONE {
            self.add_glass::<F>(&mut stack, point, weight * glass, base, roughness);
        }

        let clearcoat = self.clearcoat.at::<F>(point).max(0.0);
        if clearcoat > NONE {
            let roughness = self.clearcoat_roughness.share::<F>(point);
            let alpha = (roughness * roughness).max(1e-4);
            let closure = Closure::Diffuser(Diffuser::Clearcoat(Clearcoat { alpha }));
            let bright = fresnel::dielectric(point.cos.min(1.0), 1.5).0;
            stack.push_plain(closure, weight * (0.25 * clearcoat), Rgb::splat(bright));
        }
    }

    /// How many closures it comes to at the most.
    pub(super) fn most_closures(&self) -> usize {
        let absent = [
            self.alpha.is(1.0),
            self.sheen.is(0.0),
            self.clearcoat.is(0.0),
            self.transmission.is(0.0),
            // Split glass is two.
            self.transmission.is(0.0),
        ];
        7 - absent.into_iter().filter(|&absent| absent).count()
    }

    /// The diffuse base with its sheen.
    fn add_base<const F: u32>(
        &self,
        stack: &mut Stack<'_, '_, F>,
        point: &Point<'_>,
        weight: Rgb,
        base: Rgb,
        roughness: f32,
    ) {
        let inner = self.subsurface_color.at::<F>(point).max(Rgb::ZERO);
        let albedo = mix(base, inner, Rgb::splat(self.subsurface.share::<F>(point)));
        let burley = Diffuser::Burley { albedo, roughness };
        stack.push_plain(Closure::Diffuser(burley), weight, albedo);

        let sheen = self.sheen.at::<F>(point).max(0.0);
        if sheen > NONE {
            let tinted = Rgb::splat(self.sheen_tint.share::<F>(point));
            let color = mix(Rgb::ONE, hue(base, luminance(base)), tinted) * sheen;
            let lobe = Diffuser::BurleySheen(Rgb::ONE);
            let bright = (1.0 - point.cos).powi(5) * point.cos;
            stack.push_plain(Closure::Diffuser(lobe), weight * color, Rgb::splat(bright));
        }
    }

    fn add_glass<const F: u32>(
        &self,
        stack: &mut Stack<'_, '_, F>,
        point: &Point<'_>,
        weight: Rgb,
        base: Rgb,
        roughness: f32,
    ) {
        let eta = eta(self.ior.at::<F>(point), point.front);
        let tinted = Rgb::splat(self.specular_tint.share::<F>(point));
        let tint = mix(Rgb::ONE, base, tinted).clamp(Rgb::ZERO, Rgb::ONE);
        let alpha = roughness * roughness;
        let split = roughness <= 0.05;
        if let (Some(method), false) = (self.setup.glass, split) {
            let glass = Glass {
                eta,
                reflection: to_model_color(tint),
                transmission: to_model_color(base.min(Rgb::ONE)),
            };
            stack.push_plain(rough([alpha; 2], glass, method), weight, Rgb::ONE);
            return;
        }
        let f = fresnel::dielectric(point.cos.min(1.0), eta).0;
        let fresnel = ConductorFresnel::Dielectric {
            eta,
            f0: to_model_color(tint),
            f90: to_model_color(Rgb::ONE),
        };
        let method = match self.setup.reflecting {
            Method::Separable => Method::Separable,
            _ => Method::Single,
        };
        let closure = reflecting([alpha; 2], fresnel, method);
        stack.push_plain(closure, weight * f, Rgb::ONE);
        let more = if self.setup.glass.is_some() {
            0.0
        } else {
            self.transmission_roughness.share::<F>(point)
        };
        let through = 1.0 - (1.0 - roughness) * (1.0 - more);
        let through = through * through;
        let color = base.min(Rgb::ONE);
        let closure = if through > 0.0 {
            let facets = Refraction {
                eta,
                tint: to_model_color(Rgb::ONE),
            };
            rough([through; 2], facets, method)
        } else {
            Closure::Interface(Interface::refracting(eta, Rgb::ONE))
        };
        stack.push_plain(closure, weight * color * (1.0 - f).max(1e-4), Rgb::ONE);
    }

    /// The radiance of the node itself, W·m⁻²·sr⁻¹.
    pub(super) fn emission<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        let strength = self.emission_strength.at::<F>(point).max(0.0);
        self.emission.at::<F>(point) * strength * self.alpha.share::<F>(point)
    }
}

/// The colour at luminance 1; white for black.
fn hue(color: Rgb, gray: f32) -> Rgb {
    if gray > 0.0 { color / gray } else { Rgb::ONE }
}

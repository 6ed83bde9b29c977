//! The node of Blender 2.8 to 3.6.

use super::super::super::Surface;
use super::super::rough::{eta, to_model_color};
use super::super::value::{Number, Point, Tint};
use super::super::walked::{self, FixedStacks, Walked};
use super::{
    Layering, NONE, Setup, Stack, diffuse_facets, mix, push_transparent, reflecting, rough,
    stretched, transmitting,
};
use crate::bsdf::{Bsdf, Clearcoat, Closure, Diffuser, Interface, Method};
use crate::color::{Rgb, luminance};
use smithwalk_model::layered::Interface as LayerInterface;
use smithwalk_model::{ConductorFresnel, Glass, Refraction, fresnel};

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

impl Principled3 {
    /// Adds the closures of the node, all together with this weight.
    pub(in crate::scene::material) fn add<const F: u32>(
        &self,
        bsdf: &mut Bsdf<F>,
        point: &Point<'_>,
        surface: &Surface,
        share: f32,
    ) {
        let mut stack = Stack { bsdf, surface };
        let alpha = self.alpha.share::<F>(point);
        if alpha < 1.0 {
            push_transparent(stack.bsdf, surface, share * (1.0 - alpha));
        }
        let weight = Rgb::splat(share * alpha);
        let base = self.base_color.at::<F>(point).max(Rgb::ZERO);
        let metallic = self.metallic.share::<F>(point);
        let transmission = self.transmission.share::<F>(point);
        let diffuse = (1.0 - metallic) * (1.0 - transmission);
        let glass = transmission * (1.0 - metallic);
        let roughness = self.roughness.share::<F>(point);

        if let Layering::Walks(fixed) = self.setup.layering {
            let walked = self.walked::<F>(point, share * alpha, fixed);
            let rotation = self.anisotropic_rotation;
            let frame = self.setup.tangent.frame::<F>(rotation, point, surface);
            let albedo = self.albedo::<F>(point);
            walked.add(bsdf, surface, frame, diffuse_facets(albedo, 0.0));
            let mut stack = Stack { bsdf, surface };
            self.add_sheen::<F>(&mut stack, point, weight * diffuse);
            return;
        }

        if diffuse > NONE {
            self.add_base::<F>(&mut stack, point, weight * diffuse, roughness);
        }

        let specular = self.specular.at::<F>(point).max(0.0);
        if glass < 1.0 - NONE && (specular > NONE || metallic > NONE) {
            let eta = index_of(specular);
            let hue = self.specular_hue::<F>(point, base);
            let f0 = hue * (0.08 * specular * (1.0 - metallic)) + base * metallic;
            let f0 = f0.clamp(Rgb::ZERO, Rgb::ONE);
            let fresnel = ConductorFresnel::Dielectric {
                eta,
                f0: to_model_color(f0),
                f90: to_model_color(Rgb::ONE),
            };
            let alphas = stretched(roughness, self.anisotropic.share::<F>(point));
            let rotation = self.anisotropic_rotation;
            let frame = self.setup.tangent.frame::<F>(rotation, point, surface);
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
    pub(in crate::scene::material) fn most_closures(&self) -> usize {
        let absent = [
            self.alpha.is(1.0),
            self.sheen.is(0.0),
            self.clearcoat.is(0.0),
            self.transmission.is(0.0),
            // Split glass is two.
            self.transmission.is(0.0),
        ];
        if let Layering::Walks(_) = self.setup.layering {
            let [opaque, no_sheen, bare, no_glass, _] = absent.map(usize::from);
            return (1 - opaque) + (1 - no_sheen) + (2 - bare) * (3 - no_glass);
        }
        7 - absent.into_iter().filter(|&absent| absent).count()
    }

    /// The diffuse base with its sheen.
    fn add_base<const F: u32>(
        &self,
        stack: &mut Stack<'_, '_, F>,
        point: &Point<'_>,
        weight: Rgb,
        roughness: f32,
    ) {
        let albedo = self.albedo::<F>(point);
        let burley = Diffuser::Burley { albedo, roughness };
        stack.push_plain(Closure::Diffuser(burley), weight, albedo);
        self.add_sheen::<F>(stack, point, weight);
    }

    /// The albedo of the diffuse base.
    fn albedo<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        let base = self.base_color.at::<F>(point).max(Rgb::ZERO);
        let inner = self.subsurface_color.at::<F>(point).max(Rgb::ZERO);
        mix(base, inner, Rgb::splat(self.subsurface.share::<F>(point)))
    }

    /// The colour of reflection at normal incidence.
    fn specular_hue<const F: u32>(&self, point: &Point<'_>, base: Rgb) -> Rgb {
        let tinted = self.specular_tint.share::<F>(point);
        // Not Rec. 709's weights: as the node has it.
        let gray = base.dot(Rgb::new(0.3, 0.6, 0.1));
        mix(Rgb::ONE, hue(base, gray), Rgb::splat(tinted))
    }

    /// The node's layers as they are, without the sheen.
    fn walked<const F: u32>(
        &self,
        point: &Point<'_>,
        weight: f32,
        fixed: Option<&'static FixedStacks>,
    ) -> Walked {
        let base = self.base_color.at::<F>(point).clamp(Rgb::ZERO, Rgb::ONE);
        let metallic = self.metallic.share::<F>(point);
        let transmission = self.transmission.share::<F>(point);
        let roughness = self.roughness.share::<F>(point);
        let alpha = roughness * roughness;
        let alphas = stretched(roughness, self.anisotropic.share::<F>(point));
        let specular = index_of(self.specular.at::<F>(point).max(0.0));
        let fresnel = ConductorFresnel::Dielectric {
            eta: specular,
            f0: to_model_color(base),
            f90: to_model_color(Rgb::ONE),
        };
        let ior = self.ior.at::<F>(point).max(NONE);
        let tinted = Rgb::splat(self.specular_tint.share::<F>(point));
        let through = LayerInterface {
            transmission: to_model_color(base),
            ..walked::interface(ior, 1.0, [alpha; 2], mix(Rgb::ONE, base, tinted), None)
        };
        let glass = walked::glass(through, point.front);
        let method = self.setup.glass.unwrap_or(self.setup.reflecting);
        let coat_roughness = self.clearcoat_roughness.share::<F>(point);
        let coat_alpha = coat_roughness * coat_roughness;
        let hue = self.specular_hue::<F>(point, base);
        Walked {
            weight,
            coat: (
                0.25 * self.clearcoat.at::<F>(point).clamp(0.0, 4.0),
                walked::coat(1.5, [coat_alpha; 2], Rgb::ONE),
            ),
            metal: (
                metallic,
                reflecting(alphas, fresnel, self.setup.reflecting),
                walked::metal(alphas, fresnel, 1.5),
            ),
            glass: (
                (1.0 - metallic) * transmission,
                transmitting([alpha; 2], glass, point.cos, method),
                through,
            ),
            plastic: (
                (1.0 - metallic) * (1.0 - transmission),
                [walked::interface(specular, 1.0, alphas, hue, None); 2],
                walked::diffuse(self.albedo::<F>(point), 0.0),
            ),
            fixed,
        }
    }

    /// The sheen, which is added to what lies below.
    fn add_sheen<const F: u32>(
        &self,
        stack: &mut Stack<'_, '_, F>,
        point: &Point<'_>,
        weight: Rgb,
    ) {
        let base = self.base_color.at::<F>(point).max(Rgb::ZERO);
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
                film: None,
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
    pub(in crate::scene::material) fn emission<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        let strength = self.emission_strength.at::<F>(point).max(0.0);
        self.emission.at::<F>(point) * strength * self.alpha.share::<F>(point)
    }
}

/// The index of refraction of a `specular` of the node.
fn index_of(specular: f32) -> f32 {
    let root = (0.08 * specular).min(0.99).sqrt();
    2.0 / (1.0 - root) - 1.0
}

/// The colour at luminance 1; white for black.
fn hue(color: Rgb, gray: f32) -> Rgb {
    if gray > 0.0 { color / gray } else { Rgb::ONE }
}

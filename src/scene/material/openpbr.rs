//! OpenPBR 1.1.1 as the specification means it: light that walks among the layers.

use super::super::Surface;
use super::principled::{
    Layering, NONE, Setup, diffuse_facets, fibres, push_cover, reflecting, transmitting,
};
use super::rough::{LEAST_IOR, edge_tinted, film, filmed, to_model_color};
use super::value::{Number, Point, Tint};
use super::walked::{self, Walked};
use crate::bsdf::{Bsdf, Closure};
use crate::color::Rgb;
use smithwalk_model::layered::Interface;
use smithwalk_model::{ConductorFresnel, Film, fresnel};

/// OpenPBR's surface; parameters as in [`crate::description::OpenPbr`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)] // those of the description say it
pub struct OpenPbr {
    pub setup: Setup,
    pub base_weight: Number,
    pub base_color: Tint,
    pub base_diffuse_roughness: Number,
    pub base_metalness: Number,
    pub specular_weight: Number,
    pub specular_color: Tint,
    pub specular_roughness: Number,
    pub specular_roughness_anisotropy: Number,
    pub specular_ior: Number,
    pub transmission_weight: Number,
    pub transmission_color: Tint,
    pub coat_weight: Number,
    pub coat_color: Tint,
    pub coat_roughness: Number,
    pub coat_roughness_anisotropy: Number,
    pub coat_ior: Number,
    pub thin_film_weight: Number,
    pub thin_film_thickness: Number,
    pub thin_film_ior: Number,
    pub fuzz_weight: Number,
    pub fuzz_color: Tint,
    pub fuzz_roughness: Number,
    pub emission_luminance: Number,
    pub emission_color: Tint,
    pub geometry_opacity: Number,
}

/// The luminous efficacy of 555 nm, lm·W⁻¹: what Blender takes for that of all light.
const LUMENS_PER_WATT: f32 = 683.0;

impl OpenPbr {
    /// Adds the closures of the surface, all together with this weight.
    pub(super) fn add<const F: u32>(
        &self,
        bsdf: &mut Bsdf<F>,
        point: &Point<'_>,
        surface: &Surface,
        share: f32,
    ) {
        let opacity = self.geometry_opacity.share::<F>(point);
        let (fuzz, left) = self.fuzz::<F>(point);
        push_cover(bsdf, surface, share, opacity, (fuzz, left));
        let share = share * opacity * left;
        let base = self.base_color.at::<F>(point) * self.base_weight.share::<F>(point);
        let base = base.clamp(Rgb::ZERO, Rgb::ONE);
        let color = self.specular_color.at::<F>(point);
        let color = color.clamp(Rgb::ZERO, Rgb::ONE);
        let strength = self.specular_weight.at::<F>(point).max(0.0);
        let alphas = stretched(
            self.specular_roughness.share::<F>(point),
            self.specular_roughness_anisotropy.share::<F>(point),
        );
        let metalness = self.base_metalness.share::<F>(point);
        let transmission = self.transmission_weight.share::<F>(point);
        let ior = self.specular_ior.at::<F>(point).max(LEAST_IOR);
        let coat_ior = self.coat_ior.at::<F>(point).max(LEAST_IOR);

        let film = self.film::<F>(point);
        let fresnel = scaled(edge_tinted(base, color), strength.min(1.0));
        let fresnel = filmed(fresnel, film);
        let [below_air, below_coat] = [1.0, coat_ior].map(|above| {
            let ior = modulated(ior, above, strength);
            walked::interface(ior, above, alphas, color, film)
        });
        let through = self.transmission_color.at::<F>(point);
        let through = to_model_color(through.clamp(Rgb::ZERO, Rgb::ONE));
        let clear = |interface| Interface {
            transmission: through,
            ..interface
        };
        let glass = walked::glass(clear(below_air), point.front);
        let dull = self.base_diffuse_roughness.share::<F>(point);
        let (fixed, method) = match self.setup.layering {
            Layering::Walks(fixed) => (fixed, self.setup.reflecting),
            Layering::Cycles => (None, self.setup.reflecting),
        };
        let walked = Walked {
            weight: share,
            coat: (
                self.coat_weight.share::<F>(point),
                walked::coat(
                    coat_ior,
                    stretched(
                        self.coat_roughness.share::<F>(point),
                        self.coat_roughness_anisotropy.share::<F>(point),
                    ),
                    self.coat_color.at::<F>(point),
                ),
            ),
            metal: (
                metalness,
                reflecting(alphas, fresnel, method),
                walked::metal(alphas, fresnel, coat_ior),
            ),
            glass: (
                (1.0 - metalness) * transmission,
                transmitting(alphas, glass, point.cos, self.setup.glass.unwrap_or(method)),
                clear(below_coat),
            ),
            plastic: (
                (1.0 - metalness) * (1.0 - transmission),
                [below_air, below_coat],
                walked::diffuse(base, dull),
            ),
            fixed,
        };
        let frame = self
            .setup
            .tangent
            .frame::<F>(Number::Constant(0.0), point, surface);
        walked.add(bsdf, surface, frame, diffuse_facets(base, dull));
    }

    /// The film on the base.
    fn film<const F: u32>(&self, point: &Point<'_>) -> Option<Film<f32>> {
        let cover = self.thin_film_weight.share::<F>(point);
        let nanometres = 1000.0 * self.thin_film_thickness.at::<F>(point);
        let thin = film(self.thin_film_ior.at::<F>(point), nanometres, cover);
        (cover > NONE && thin.thickness > NONE).then_some(thin)
    }

    /// The fuzz, and the share of light that it leaves to what lies below.
    fn fuzz<const F: u32>(&self, point: &Point<'_>) -> (Option<Closure>, f32) {
        let weight = self.fuzz_weight.share::<F>(point);
        if weight == 0.0 {
            return (None, 1.0);
        }
        let color = self.fuzz_color.at::<F>(point).clamp(Rgb::ZERO, Rgb::ONE) * weight;
        let (closure, left) = fibres(color, self.fuzz_roughness.share::<F>(point), point.cos);
        (Some(closure), left)
    }

    /// The radiance of the surface itself, W·m⁻²·sr⁻¹; the coat lies above, and lets
    /// through what it does of light that comes from outside along the same ray.
    pub(super) fn emission<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        let luminance = self.emission_luminance.at::<F>(point).max(0.0);
        if luminance == 0.0 {
            return Rgb::ZERO;
        }
        let coated = self.coat_weight.share::<F>(point);
        let eta = self.coat_ior.at::<F>(point).max(LEAST_IOR);
        let (reflected, cos) = fresnel::dielectric(point.cos.min(1.0), eta);
        // The colour is that of two ways.
        let length = 0.5 / cos.max(LEAST_COS);
        let color = self.coat_color.at::<F>(point).clamp(Rgb::ZERO, Rgb::ONE);
        let through = color.map(|c| c.powf(length)) * (1.0 - reflected);
        let below = Rgb::ONE.lerp(through, coated) * self.fuzz::<F>(point).1;
        let opacity = self.geometry_opacity.share::<F>(point);
        self.emission_color.at::<F>(point) * below * (luminance / LUMENS_PER_WATT * opacity)
    }

    /// The factor that makes `emission_color` a radiance; of one that is textured, the
    /// factor of 1 cd·m⁻².
    pub(super) fn emission_strength(&self) -> Number {
        match self.emission_luminance {
            Number::Constant(luminance) => Number::Constant(luminance / LUMENS_PER_WATT),
            texture @ (Number::Texture(..) | Number::Colors(..)) => texture,
        }
    }

    /// How many closures it comes to at the most.
    pub(super) fn most_closures(&self) -> usize {
        let has = |absent: bool| usize::from(!absent);
        let kinds = 1 + has(self.base_metalness.is(0.0)) + has(self.transmission_weight.is(0.0));
        has(self.geometry_opacity.is(1.0))
            + has(self.fuzz_weight.is(0.0))
            + kinds * (1 + has(self.coat_weight.is(0.0)))
    }
}

/// The least cosine of a ray below a coat.
const LEAST_COS: f32 = 1e-3;

/// α along the tangent and across (OpenPBR 1.1.1, "Microfacet model").
fn stretched(roughness: f32, anisotropy: f32) -> [f32; 2] {
    let aspect = 1.0 - anisotropy;
    let along = roughness * roughness * (2.0 / (1.0 + aspect * aspect)).sqrt();
    [along.min(1.0), along * aspect]
}

/// The absolute index of refraction whose reflectance at normal incidence under a
/// medium of index `above` is `weight` times that of `ior` (OpenPBR 1.1.1, "Dielectric
/// base").
fn modulated(ior: f32, above: f32, weight: f32) -> f32 {
    if weight == 1.0 {
        return ior;
    }
    let eta = ior / above;
    let f0 = (weight * fresnel::normal_reflectance(eta)).min(0.99);
    let root = f0.sqrt().copysign(eta - 1.0);
    above * (1.0 + root) / (1.0 - root)
}

/// A metal of a fraction of the reflectance at normal incidence and at cosθ = 1/7; at
/// grazing incidence all is reflected as before.
fn scaled(metal: ConductorFresnel<f32>, factor: f32) -> ConductorFresnel<f32> {
    match metal {
        ConductorFresnel::F82 { f0, f82 } => ConductorFresnel::F82 {
            f0: f0 * factor,
            f82: f82 * factor,
        },
        other => other,
    }
}

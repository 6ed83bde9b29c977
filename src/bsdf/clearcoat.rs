//! The coat of Burley 2012, "Physically Based Shading at Disney", § 5.6, which
//! Cycles has up to 3.6.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::Vec3;

use super::BsdfSample;
use crate::color::Rgb;
use smithwalk_model::{Draw, fresnel};

/// A glossy lobe with long tails: D ∝ 1/(1 + (α² − 1) cos²θ_h), the masking of
/// GGX with α = ¼, and Fresnel's law of index 1.5.
#[derive(Clone, Copy, Debug)]
pub struct Clearcoat {
    /// α, above 0 and up to 1.
    pub alpha: f32,
}

/// The α of the masking.
const MASKING: f32 = 0.25;

/// The index of refraction.
pub const INDEX: f32 = 1.5;

impl Clearcoat {
    /// Draws a facet from D cosθ_h.
    #[inline]
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
        let (u, v) = (rng.draw(), rng.draw());
        let a2 = self.alpha * self.alpha;
        let cos2 = if self.alpha < 1.0 {
            (1.0 - a2.powf(1.0 - u)) / (1.0 - a2)
        } else {
            u
        };
        let (sin, cos) = ((1.0 - cos2).max(0.0).sqrt(), cos2.max(0.0).sqrt());
        let (y, x) = (TAU * v).sin_cos();
        let h = Vec3::new(sin * x, sin * y, cos);
        let wi = h * (2.0 * wo.dot(h)) - wo;
        let pdf = self.pdf(wo, wi);
        (wi.z > 0.0 && pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: self.eval(wo, wi) / pdf,
            order: 1,
            delta: false,
        })
    }

    /// f·cosθ_i, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let h = (wo + wi).normalize_or_zero();
        if wi.z <= 0.0 || h.z <= 0.0 {
            return Rgb::ZERO;
        }
        let masked = |cos: f32| {
            let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
            2.0 / (1.0 + (1.0 + MASKING * MASKING * tan2).sqrt())
        };
        let f = fresnel::dielectric(wo.dot(h).clamp(0.0, 1.0), INDEX).0;
        Rgb::splat(f * self.normals(h.z) * masked(wo.z) * masked(wi.z) / (4.0 * wo.z))
    }

    /// D cosθ_h / (4 ω_o·h), sr⁻¹.
    #[must_use]
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let h = (wo + wi).normalize_or_zero();
        let cos_d = wo.dot(h);
        if wi.z <= 0.0 || h.z <= 0.0 || cos_d <= 0.0 {
            return 0.0;
        }
        self.normals(h.z) * h.z / (4.0 * cos_d)
    }

    /// D(h), sr⁻¹.
    fn normals(&self, cos: f32) -> f32 {
        let a2 = self.alpha * self.alpha;
        if self.alpha >= 1.0 {
            return FRAC_1_PI;
        }
        // 1 + (α² − 1) cos²θ, without the difference near the pole.
        let t = (1.0 - cos) * (1.0 + cos) + a2 * cos * cos;
        (a2 - 1.0) / (PI * a2.ln() * t)
    }
}

//! Lambert's law: the same radiance in every direction.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::BsdfSample;
use crate::color::Rgb;
use smithwalk_model::Draw;

/// A perfectly diffuse reflector, f = albedo/π.
#[derive(Clone, Copy, Debug)]
pub struct Lambert {
    /// The share of light that is reflected, per channel.
    pub albedo: Rgb,
}

impl Lambert {
    /// Draws from the cosine lobe, cosθ/π.
    pub fn sample(&self, rng: &mut impl Draw<f32>) -> BsdfSample {
        let (u, v) = (rng.draw(), rng.draw());
        let (sin, cos) = (v * std::f32::consts::TAU).sin_cos();
        let r = u.sqrt();
        let wi = Vec3::new(r * cos, r * sin, (1.0 - u).sqrt());
        BsdfSample {
            wi,
            weight: self.albedo,
            order: 1,
            delta: false,
        }
    }

    /// f·cosθ_i, sr⁻¹.
    #[must_use]
    pub fn eval(&self, wi: Vec3) -> Rgb {
        self.albedo * self.pdf(wi)
    }

    /// cosθ_i/π, sr⁻¹.
    #[must_use]
    pub fn pdf(&self, wi: Vec3) -> f32 {
        wi.z.max(0.0) * FRAC_1_PI
    }
}

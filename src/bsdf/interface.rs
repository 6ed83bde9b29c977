//! The exact smooth interface between two transparent media: a dielectric with
//! α = 0.

use glam::Vec3;

use super::BsdfSample;
use crate::color::Rgb;
use smithwalk_model::{Draw, fresnel};

/// Reflects a share F of the light and refracts the rest.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    /// η = n(below)/n(above), seen from the viewer's side.
    pub eta: f32,
    /// A factor on what is reflected and on what is refracted.
    pub color: Rgb,
}

impl Interface {
    /// Reflection with probability F, else refraction by Snell's law.
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> BsdfSample {
        let (reflectance, cos_t) = fresnel::dielectric(wo.z, self.eta);
        let wi = if rng.draw() < reflectance {
            Vec3::new(-wo.x, -wo.y, wo.z)
        } else {
            let s = 1.0 / self.eta;
            Vec3::new(-wo.x * s, -wo.y * s, -cos_t.abs()).normalize_or(-wo)
        };
        BsdfSample {
            wi,
            weight: self.color,
            order: 1,
        }
    }
}

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
    /// A factor on what is reflected; without it nothing is, and all that can be
    /// is refracted.
    pub reflected: Option<Rgb>,
    /// A factor on what is refracted.
    pub refracted: Rgb,
}

impl Interface {
    /// One colour for what is reflected and what is refracted.
    #[must_use]
    pub fn colored(eta: f32, color: Rgb) -> Self {
        Self {
            eta,
            reflected: Some(color),
            refracted: color,
        }
    }

    /// Refracts alone, whatever Fresnel's law says.
    #[must_use]
    pub fn refracting(eta: f32, color: Rgb) -> Self {
        Self {
            eta,
            reflected: None,
            refracted: color,
        }
    }

    /// Reflection with probability F, else refraction by Snell's law.
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
        let (reflectance, cos_t) = fresnel::dielectric(wo.z, self.eta);
        let (wi, weight) = match self.reflected {
            Some(color) if rng.draw() < reflectance => (Vec3::new(-wo.x, -wo.y, wo.z), color),
            None if reflectance >= 1.0 => return None,
            _ => {
                let s = 1.0 / self.eta;
                let wi = Vec3::new(-wo.x * s, -wo.y * s, -cos_t.abs()).normalize_or(-wo);
                (wi, self.refracted)
            }
        };
        Some(BsdfSample {
            wi,
            weight,
            order: 1,
            delta: true,
        })
    }
}

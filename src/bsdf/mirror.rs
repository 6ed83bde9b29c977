//! The exact mirror: a conductor with α = 0.

use glam::Vec3;

use super::BsdfSample;
use crate::color::Rgb;
use smithwalk_model::ConductorFresnel;

/// Reflects about the normal and nowhere else.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    /// The reflectance by angle of incidence.
    pub fresnel: ConductorFresnel<f32>,
}

impl Mirror {
    /// The one direction there is.
    #[must_use]
    pub fn sample(&self, wo: Vec3) -> BsdfSample {
        BsdfSample {
            wi: Vec3::new(-wo.x, -wo.y, wo.z),
            weight: Rgb::from(self.fresnel.reflectance(wo.z).0),
            order: 1,
            delta: true,
        }
    }
}

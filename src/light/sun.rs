//! Light from infinitely far.

use super::select::Far;
use super::warp::Cone;
use super::{LightSample, Rgb};
use crate::color::luminance;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// A sun: parallel light, or a disk in the sky.
#[derive(Clone, Copy, Debug)]
pub struct SunLight {
    towards: Vec3,
    face: Face,
}

#[derive(Clone, Copy, Debug)]
enum Face {
    /// Irradiance of a plane facing the sun, W·m⁻².
    Point(Rgb),
    /// A cone of directions.
    Disk {
        /// Radiance of the centre, W·m⁻²·sr⁻¹.
        radiance: Rgb,
        one_minus_cos: f32,
        /// Whether the radiance grows from the centre with 1/cos³.
        flat: bool,
    },
}

/// The radiance at the angle with this cosine from the centre.
fn radiance_at(radiance: Rgb, flat: bool, cos: f32) -> Rgb {
    if flat {
        radiance / (cos * cos * cos)
    } else {
        radiance
    }
}

impl SunLight {
    /// Parallel light of `irradiance` W·m⁻² on a plane that faces the sun;
    /// the unit vector `towards` points at the sun.
    #[must_use]
    pub fn parallel(towards: Vec3, irradiance: Rgb) -> Self {
        Self {
            towards,
            face: Face::Point(irradiance),
        }
    }

    /// A disk of `half_angle` radians (at most π/2) and constant `radiance` in
    /// W·m⁻²·sr⁻¹; the unit vector `towards` points at its centre.
    #[must_use]
    pub fn disk(towards: Vec3, half_angle: f32, radiance: Rgb) -> Self {
        let sin_of_half = (half_angle.clamp(0.0, FRAC_PI_2) / 2.0).sin();
        Self {
            towards,
            face: Face::Disk {
                radiance,
                one_minus_cos: 2.0 * sin_of_half * sin_of_half,
                flat: false,
            },
        }
    }

    /// The same sun as Cycles had it before Blender 4.0: all points of a flat
    /// disk at distance 1 count alike, so that the radiance is `radiance` at
    /// the centre and grows with 1/cos³ of the angle from there.
    #[must_use]
    pub fn flat_disk(towards: Vec3, half_angle: f32, radiance: Rgb) -> Self {
        let mut sun = Self::disk(towards, half_angle, radiance);
        if let Face::Disk { flat, .. } = &mut sun.face {
            *flat = true;
        }
        sun
    }

    /// Whether rays can meet it.
    pub(super) fn is_disk(&self) -> bool {
        matches!(self.face, Face::Disk { .. })
    }

    /// The luminance of the irradiance of a plane that faces the sun, W·m⁻².
    pub(super) fn irradiance(&self) -> f32 {
        match self.face {
            Face::Point(irradiance) => luminance(irradiance),
            Face::Disk {
                radiance,
                one_minus_cos,
                flat: false,
            } => luminance(radiance) * PI * one_minus_cos * (2.0 - one_minus_cos),
            // The mean of cosθ over a disk of radius tan: 2π(1/cos − 1) · L.
            Face::Disk {
                radiance,
                one_minus_cos,
                flat: true,
            } => luminance(radiance) * 2.0 * PI * one_minus_cos / (1.0 - one_minus_cos),
        }
    }

    /// What is known of it among many lights.
    pub(super) fn far(&self) -> Far {
        let radius = match self.face {
            Face::Point(_) => 0.0,
            Face::Disk { one_minus_cos, .. } => (one_minus_cos * (2.0 - one_minus_cos)).sqrt(),
        };
        Far {
            irradiance: self.irradiance(),
            towards: Some((self.towards, radius)),
        }
    }

    /// Samples a direction to the sun; `selection` is the probability with
    /// which this light was chosen.
    pub(super) fn sample(&self, selection: f32, u: [f32; 2]) -> LightSample {
        let (direction, radiance, pdf, delta) = match self.face {
            Face::Point(irradiance) => (self.towards, irradiance, selection, true),
            Face::Disk {
                radiance,
                one_minus_cos,
                flat,
            } => {
                let cone = Cone::new(self.towards, one_minus_cos);
                let direction = cone.sample(u).0;
                let radiance = radiance_at(radiance, flat, direction.dot(self.towards));
                (direction, radiance, selection * cone.pdf(), false)
            }
        };
        LightSample {
            direction,
            distance: f32::INFINITY,
            radiance,
            pdf,
            delta,
            surrounds: false,
            emitter: None,
        }
    }

    /// The radiance from a direction and the density with which
    /// [`SunLight::sample`] would have found it, sr⁻¹, without the probability
    /// of choosing this light.
    pub(super) fn seen(&self, direction: Vec3) -> Option<(Rgb, f32)> {
        match self.face {
            Face::Point(_) => None,
            Face::Disk {
                radiance,
                one_minus_cos,
                flat,
            } => {
                let cone = Cone::new(self.towards, one_minus_cos);
                let radiance = radiance_at(radiance, flat, direction.dot(self.towards));
                cone.contains(direction).then(|| (radiance, cone.pdf()))
            }
        }
    }
}

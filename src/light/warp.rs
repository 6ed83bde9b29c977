//! Maps from the unit square to the shapes that lights and lenses have.

use glam::Vec3;
use std::f32::consts::{FRAC_PI_4, TAU};

/// The largest number below 1 that an `f32` holds.
pub(crate) const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Maps the unit square to the unit disk, area to area and neighbours to
/// neighbours (Shirley and Chiu 1997, "A Low Distortion Map Between Disk and
/// Square").
pub(crate) fn unit_disk(u: [f32; 2]) -> [f32; 2] {
    let [a, b] = u.map(|u| 2.0 * u - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    let (radius, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_4 * (2.0 - a / b))
    };
    let (sin, cos) = angle.sin_cos();
    [radius * cos, radius * sin]
}

/// All directions within an angle of an axis. The angle is held as 1 − cos,
/// which keeps its precision for the sun from a metre and for a lamp from a
/// thousand kilometres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    axis: Vec3,
    one_minus_cos: f32,
}

impl Cone {
    /// Around the unit vector `axis`; `one_minus_cos` is 0 (nothing) to 2 (all
    /// directions).
    pub(super) fn new(axis: Vec3, one_minus_cos: f32) -> Self {
        Self {
            axis,
            one_minus_cos,
        }
    }

    /// A unit vector, uniform in solid angle, and its cosine to the axis.
    pub(super) fn sample(&self, u: [f32; 2]) -> (Vec3, f32) {
        let [x, y] = unit_disk(u);
        // The squared radius is uniform, and so is 1 − cosθ over solid angle.
        let one_minus_cos = self.one_minus_cos * (x * x + y * y);
        let sin_over_radius = (self.one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
        let (tangent, bitangent) = self.axis.any_orthonormal_pair();
        let cos = 1.0 - one_minus_cos;
        let direction = self.axis * cos + (tangent * x + bitangent * y) * sin_over_radius;
        (direction.normalize(), cos)
    }

    /// The density of [`Cone::sample`], sr⁻¹.
    pub(super) fn pdf(&self) -> f32 {
        1.0 / (TAU * self.one_minus_cos)
    }

    /// Whether it holds a unit vector.
    pub(super) fn contains(&self, direction: Vec3) -> bool {
        // |d − a|² = 2 (1 − cosθ) without the cancellation.
        (direction - self.axis).length_squared() <= 2.0 * self.one_minus_cos
    }
}

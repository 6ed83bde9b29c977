//! Into which directions lights shine.

use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Bounds of the directions that lights shine into: normals within an angle of
/// an axis, and light within an angle of its normal (Conty Estévez and Kulla
/// 2018, section 4.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::light) struct Cone {
    /// A unit vector.
    pub(super) axis: Vec3,
    /// θ_o: how far a normal may be from the axis, radians, 0 to π.
    pub(super) normals: f32,
    /// θ_e: how far light leaves from a normal, radians, 0 to π.
    pub(super) reach: f32,
}

impl Cone {
    /// All directions alike.
    pub(in crate::light) const ALL: Self = Self {
        axis: Vec3::Z,
        normals: PI,
        reach: FRAC_PI_2,
    };

    /// Of one light: within `reach` radians of the unit vector `axis`.
    pub(in crate::light) fn around(axis: Vec3, reach: f32) -> Self {
        Self {
            axis,
            normals: 0.0,
            reach,
        }
    }

    pub(super) fn is_all(&self) -> bool {
        self.normals >= PI
    }

    /// The least cone that holds both (algorithm 1 of the paper).
    pub(super) fn union(self, other: Self) -> Self {
        let (wide, narrow) = if self.normals >= other.normals {
            (self, other)
        } else {
            (other, self)
        };
        let reach = wide.reach.max(narrow.reach);
        if wide.is_all() {
            return Self { reach, ..wide };
        }
        let between = wide.axis.angle_between(narrow.axis);
        if (between + narrow.normals).min(PI) <= wide.normals {
            return Self { reach, ..wide };
        }
        let normals = (wide.normals + between + narrow.normals) / 2.0;
        let side = wide.axis.cross(narrow.axis).try_normalize();
        match side {
            // The axis turns from the wide one towards the narrow one.
            Some(side) if normals < PI => {
                let (sin, cos) = (normals - wide.normals).sin_cos();
                Self {
                    axis: (wide.axis * cos + side.cross(wide.axis) * sin).normalize(),
                    normals,
                    reach,
                }
            }
            _ => Self {
                normals: PI,
                reach,
                ..wide
            },
        }
    }

    /// ∫ cos(the angle beyond the normals) dω over the directions reached, sr
    /// (the paper's M_Ω).
    pub(super) fn measure(&self) -> f32 {
        let o = self.normals;
        let w = (o + self.reach).min(PI);
        let (sin, cos) = o.sin_cos();
        2.0 * PI * (1.0 - cos)
            + FRAC_PI_2 * (2.0 * w * sin - (o - 2.0 * w).cos() - 2.0 * o * sin + cos)
    }
}

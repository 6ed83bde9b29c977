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

#[cfg(test)]
mod tests {
    use super::*;

    /// The union's normals hold those of both, for axes all round; 1e-3 rad is
    /// what rounding and the approximate arc cosine may add.
    #[test]
    fn a_union_holds_both() {
        let axes: Vec<Vec3> = (0..60)
            .map(|i| {
                let (sin, cos) = (i as f32 * 2.4).sin_cos();
                let z = 1.0 - (i as f32 + 0.5) / 30.0;
                Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
            })
            .collect();
        for (i, &a) in axes.iter().enumerate() {
            for (j, &b) in axes.iter().enumerate() {
                let a = Cone {
                    normals: i as f32 * 0.04,
                    ..Cone::around(a, 0.3)
                };
                let b = Cone {
                    normals: j as f32 * 0.01,
                    ..Cone::around(b, 1.0)
                };
                let both = a.union(b);
                assert_eq!(both.reach, 1.0);
                for cone in [a, b] {
                    let farthest = both.axis.dot(cone.axis).clamp(-1.0, 1.0).acos() + cone.normals;
                    assert!(
                        farthest.min(PI) <= both.normals + 1e-3,
                        "{cone:?} in {both:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_measure_of_all_directions_and_of_one_side() {
        // 4π, and ∫ cos over a hemisphere.
        assert!((Cone::ALL.measure() - 4.0 * PI).abs() < 1e-5);
        assert!((Cone::around(Vec3::Z, FRAC_PI_2).measure() - PI).abs() < 1e-5);
    }
}

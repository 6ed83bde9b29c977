//! Transforms of the file, in degrees and parts, as matrices.

use glam::{Affine3A, Mat3, Vec3};

use crate::description::Transform;

/// The matrix of a transform: local coordinates to the parent's, in metres.
#[must_use]
pub fn to_affine(transform: &Transform) -> Affine3A {
    match *transform {
        Transform::Matrix(rows) => {
            let column = |c: usize| Vec3::new(rows[0][c], rows[1][c], rows[2][c]);
            Affine3A::from_mat3_translation(
                Mat3::from_cols(column(0), column(1), column(2)),
                column(3),
            )
        }
        Transform::Parts {
            location,
            rotation,
            scale,
        } => Affine3A::from_mat3_translation(
            euler(rotation) * Mat3::from_diagonal(scale.into()),
            location.into(),
        ),
        Transform::LookAt { from, to, up } => {
            let [from, to, up] = [from, to, up].map(|v| Vec3::from(v).as_dvec3());
            let z = (from - to).normalize_or(glam::DVec3::Z);
            // An `up` along the view axis is refused when the file is read.
            let x = up.cross(z).normalize_or(z.any_orthonormal_vector());
            let y = z.cross(x);
            Affine3A::from_mat3_translation(
                Mat3::from_cols(x.as_vec3(), y.as_vec3(), z.as_vec3()),
                from.as_vec3(),
            )
        }
    }
}

/// Blender's XYZ Euler angles, degrees: about x first, then y, then z.
#[must_use]
pub fn euler(degrees: [f32; 3]) -> Mat3 {
    let [x, y, z] = degrees.map(f32::to_radians);
    Mat3::from_rotation_z(z) * Mat3::from_rotation_y(y) * Mat3::from_rotation_x(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Vec3, b: Vec3) -> bool {
        (a - b).length() < 1e-6
    }

    #[test]
    fn angles_turn_about_x_first_then_y_then_z() {
        let parts = Transform::Parts {
            location: [1.0, 2.0, 3.0],
            rotation: [90.0, 0.0, 90.0],
            scale: [1.0, 2.0, 1.0],
        };
        // y doubled, turned to z by x, left there by z.
        assert!(close(
            to_affine(&parts).transform_point3(Vec3::Y),
            Vec3::new(1.0, 2.0, 5.0)
        ));
        // x turned to y by z.
        assert!(close(to_affine(&parts).transform_vector3(Vec3::X), Vec3::Y));
    }

    #[test]
    fn look_at_points_minus_z_at_the_target() {
        let look = Transform::LookAt {
            from: [0.0, -6.0, 2.5],
            to: [0.0, 0.0, 0.9],
            up: [0.0, 0.0, 1.0],
        };
        let m = to_affine(&look);
        let axis = Vec3::new(0.0, 6.0, -1.6).normalize();
        assert!(close(m.transform_vector3(-Vec3::Z), axis));
        assert!(close(m.transform_vector3(Vec3::X), Vec3::X));
        assert!(m.transform_vector3(Vec3::Y).z > 0.9);
    }

    #[test]
    fn matrices_are_written_row_by_row() {
        let rows = [
            [1.0, 0.0, 0.0, 5.0],
            [0.0, 0.0, -1.0, 6.0],
            [0.0, 1.0, 0.0, 7.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let m = to_affine(&Transform::Matrix(rows));
        assert!(close(m.transform_point3(Vec3::Y), Vec3::new(5.0, 6.0, 8.0)));
    }
}

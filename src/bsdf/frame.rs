//! Local frames: z along the shading normal, x along the tangent.

use glam::Vec3;

/// A right-handed orthonormal frame; columns are the local axes in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The tangent.
    pub x: Vec3,
    /// The bitangent, `z × x`.
    pub y: Vec3,
    /// The normal.
    pub z: Vec3,
}

impl Frame {
    /// Any frame about `normal` (unit length): Duff et al. 2017, "Building an
    /// Orthonormal Basis, Revisited", <https://jcgt.org/published/0006/01/01/>.
    #[must_use]
    pub fn about(normal: Vec3) -> Self {
        let (x, y) = normal.any_orthonormal_pair();
        Self { x, y, z: normal }
    }

    /// The frame about `normal` with x as near to `tangent` as can be, turned
    /// counter-clockwise about the normal by `rotation` turns. Falls back on
    /// any frame where the tangent is missing or along the normal.
    #[must_use]
    pub fn with_tangent(normal: Vec3, tangent: Vec3, rotation: f32) -> Self {
        let Some(y) = normal.cross(tangent).try_normalize() else {
            return Self::about(normal);
        };
        let x = y.cross(normal);
        if rotation == 0.0 {
            return Self { x, y, z: normal };
        }
        let (sin, cos) = (rotation * std::f32::consts::TAU).sin_cos();
        Self {
            x: x * cos + y * sin,
            y: y * cos - x * sin,
            z: normal,
        }
    }

    /// World to local.
    #[must_use]
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// Local to world.
    #[must_use]
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_takes_the_tangent_to_the_bitangent() {
        let straight = Frame::with_tangent(Vec3::Z, Vec3::new(2.0, 0.0, 0.3), 0.0);
        assert!((straight.x - Vec3::X).length() < 1e-6 && (straight.y - Vec3::Y).length() < 1e-6);
        let turned = Frame::with_tangent(Vec3::Z, Vec3::X, 0.25);
        assert!((turned.x - Vec3::Y).length() < 1e-6 && (turned.y + Vec3::X).length() < 1e-6);
    }

    #[test]
    fn there_and_back_is_the_same_vector() {
        let n = Vec3::new(0.3, -0.5, 0.8).normalize();
        for frame in [
            Frame::about(n),
            Frame::with_tangent(n, n, 0.1),
            Frame::about(-Vec3::Z),
        ] {
            let v = Vec3::new(0.1, 0.7, -0.4);
            assert!((frame.to_world(frame.to_local(v)) - v).length() < 1e-6);
            assert!((frame.x.cross(frame.y) - frame.z).length() < 1e-6);
        }
    }
}

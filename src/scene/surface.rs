//! A point on a surface, as a ray met it.

use glam::{Vec2, Vec3};

use crate::bsdf::within_reach;
use crate::description::Axis;
use crate::embree::Ray;

/// Where a ray met a triangle. Directions are unit vectors in world space;
/// both normals are on the side the ray came from.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The hit, in metres.
    pub position: Vec3,
    /// Bound on the rounding error of each coordinate of `position`, metres.
    pub error: Vec3,
    /// The triangle's normal.
    pub geometric_normal: Vec3,
    /// The shading normal: interpolated, the triangle's, or what a material puts in
    /// their place; see [`Self::with_normal`].
    pub normal: Vec3,
    /// Whether the ray came from the side that the triangle's corners go round
    /// counter-clockwise: the outside.
    pub front: bool,
    /// Texture coordinates; zero where the mesh has none.
    pub uv: Vec2,
    /// Index of the material.
    pub material: usize,
    /// Index of the object.
    pub object: usize,
    /// The triangle within the object's mesh.
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third corner.
    pub weights: Vec2,
    /// How wide a pixel is here, across the ray, metres; zero where nothing needs it.
    pub footprint: f32,
    /// ∂position/∂u, not normalised; zero where nothing needs it.
    pub along_u: Vec3,
    /// Whether ∂position/∂u, ∂position/∂v and the normal are right-handed: not so
    /// where the texture is mirrored, or seen from behind. True where nothing needs it.
    pub right_handed: bool,
    /// The hit in the box of the object's mesh, each side from −½ to ½; zero
    /// where nothing needs it.
    pub in_box: Vec3,
}

/// Who looks at a surface.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Unit vector towards the viewer, world space.
    pub wo: Vec3,
    /// Whether that is the camera, through nothing but what lets light straight
    /// through.
    pub camera: bool,
}

/// Relative error of a point computed from barycentric weights: seven roundings
/// of 2⁻²⁴ each and as many again for the transform of an instance.
const POSITION_ERROR: f32 = 14.0 * (f32::EPSILON / 2.0);

/// Error, relative to the largest coordinate, that is assumed at the least: the
/// distance to a plane z = 0 is exact here, but Embree would find that plane
/// again at t = 0.
const LEAST_ERROR: f32 = 2.0 * (f32::EPSILON / 2.0);

impl Surface {
    /// The error bound for a point that is the sum of these terms' magnitudes.
    #[must_use]
    pub fn position_error(magnitudes: Vec3) -> Vec3 {
        magnitudes * POSITION_ERROR + magnitudes.max_element() * LEAST_ERROR
    }

    /// A point of the plane z = 0 with its tangent along x, seen from above or
    /// from below: what measurements of a single material look at.
    #[must_use]
    pub fn horizontal(from_above: bool) -> Self {
        let normal = if from_above { Vec3::Z } else { -Vec3::Z };
        Self {
            position: Vec3::ZERO,
            error: Vec3::ZERO,
            geometric_normal: normal,
            normal,
            front: from_above,
            uv: Vec2::ZERO,
            material: 0,
            object: 0,
            triangle: 0,
            weights: Vec2::ZERO,
            footprint: 0.0,
            along_u: Vec3::X,
            right_handed: from_above,
            in_box: Vec3::X,
        }
    }

    /// The same point with another shading normal (unit length, on the viewer's side),
    /// tilted towards the triangle's if it is too far off to shade with.
    #[must_use]
    pub fn with_normal(self, normal: Vec3) -> Self {
        Self {
            normal: within_reach(normal, self.geometric_normal),
            ..self
        }
    }

    /// A ray that starts here and goes `direction`, lifted off the surface to
    /// that side by no more than rounding makes necessary (after Pharr, Jakob,
    /// Humphreys, "Physically Based Rendering", 4th ed., section 6.8.6).
    #[must_use]
    pub fn spawn(&self, direction: Vec3) -> Ray {
        let n = self.geometric_normal;
        let distance = n.abs().dot(self.error);
        let offset = if direction.dot(n) < 0.0 {
            -n * distance
        } else {
            n * distance
        };
        let lifted = self.position + offset;
        // One more step of the last place: the sum above may have rounded back.
        let away = |x: f32, o: f32| x + f32::EPSILON * x.abs() * o.signum();
        let origin = Vec3::new(
            away(lifted.x, offset.x),
            away(lifted.y, offset.y),
            away(lifted.z, offset.z),
        );
        Ray::new(origin, direction)
    }

    /// The tangent along the texture coordinate u; zero without one.
    #[must_use]
    pub fn tangent_along_u(&self) -> Vec3 {
        self.along_u
    }

    /// The tangent that runs round an axis of the object through the middle of
    /// its mesh's box, as Cycles' default tangent does; in the object's space, as
    /// a normal is.
    #[must_use]
    pub fn radial_tangent(&self, axis: Axis) -> Vec3 {
        let p = self.in_box;
        match axis {
            Axis::X => Vec3::new(0.0, -p.z, p.y),
            Axis::Y => Vec3::new(p.z, 0.0, -p.x),
            Axis::Z => Vec3::new(-p.y, p.x, 0.0),
        }
    }
}

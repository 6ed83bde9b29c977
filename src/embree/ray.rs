//! Rays and hits, and the records in which they cross to Embree and back.

use embree4_sys as sys;
use glam::Vec3;

/// A ray segment: points `origin + t · direction` with `t_near ≤ t ≤ t_far`.
/// `t` is in metres when `direction` is a unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes.
    pub direction: Vec3,
    /// The segment's start.
    pub t_near: f32,
    /// The segment's end.
    pub t_far: f32,
}

impl Ray {
    /// A ray from `origin` that never ends.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_near: 0.0,
            t_far: f32::INFINITY,
        }
    }

    pub(super) fn to_embree(self, mask: u32) -> sys::RTCRay {
        sys::RTCRay {
            org_x: self.origin.x,
            org_y: self.origin.y,
            org_z: self.origin.z,
            tnear: self.t_near,
            dir_x: self.direction.x,
            dir_y: self.direction.y,
            dir_z: self.direction.z,
            tfar: self.t_far,
            mask,
            ..sys::RTCRay::default()
        }
    }
}

/// The nearest triangle that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Barycentric weight of the triangle's second vertex.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex.
    pub v: f32,
    /// The triangle within its mesh.
    pub triangle: u32,
    /// The geometry within the accelerator, in the order of its making.
    pub geometry: u32,
}

/// What Embree fills. The bindings' record lacks the last field of Embree
/// 4.3's (`instPrimID`, four bytes); the padding takes what is written there
/// and keeps the sixteen-byte alignment that Embree asks for.
#[repr(C, align(16))]
pub(super) struct PaddedRayHit {
    pub(super) ray: sys::RTCRay,
    pub(super) hit: sys::RTCHit,
    pub(super) pad: [u32; 4],
}

impl PaddedRayHit {
    pub(super) fn new(ray: Ray, mask: u32) -> Self {
        Self {
            ray: ray.to_embree(mask),
            hit: sys::RTCHit::default(),
            pad: [CANARY; 4],
        }
    }
}

/// What stands in the padding before a call, so that a test sees what Embree writes.
pub(super) const CANARY: u32 = 0x5eed_cafe;

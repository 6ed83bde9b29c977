//! What is committed and ready for ray queries.

use std::sync::Arc;

use embree4_sys as sys;
use glam::Affine3A;

use super::device::{Device, EmbreeError};
use super::geometry::{Geometry, RawScene, SharedMesh, Structure, new_instance, new_mesh};
use super::ray::{Hit, PaddedRayHit, Ray};
use crate::rays::{RayKind, RayKinds};

/// A committed scene. Queries are read-only and thread safe.
#[derive(Debug)]
pub struct Accelerator {
    root: RawScene,
    /// The number of the instance that holds meshes under their own numbers, if
    /// there is one.
    still: u32,
    /// What the root scene refers to.
    _shared: Vec<Arc<Structure>>,
    /// What Embree reads in place.
    _buffers: Vec<SharedMesh>,
    device: Arc<Device>,
}

// SAFETY: as for `Structure`.
unsafe impl Send for Accelerator {}
// SAFETY: as above.
unsafe impl Sync for Accelerator {}

impl Accelerator {
    /// Builds the acceleration structures. `geometries[i]` answers as geometry
    /// `i` in a [`Hit`]; instances refer to `shared`.
    ///
    /// # Errors
    /// When an index is out of range or Embree runs out of memory, or out of what
    /// its device may hold.
    pub fn build(
        device: Arc<Device>,
        shared: Vec<Arc<Structure>>,
        geometries: &[Geometry],
    ) -> Result<Self, EmbreeError> {
        Self::over(device, shared, None, geometries)
    }

    /// As [`Accelerator::build`], with the meshes among the geometries in a structure
    /// of their own ([`Structure::of_meshes`]), which is there already.
    ///
    /// # Errors
    /// As [`Accelerator::build`].
    pub fn build_over(
        device: Arc<Device>,
        shared: Vec<Arc<Structure>>,
        still: Arc<Structure>,
        geometries: &[Geometry],
    ) -> Result<Self, EmbreeError> {
        Self::over(device, shared, Some(still), geometries)
    }

    fn over(
        device: Arc<Device>,
        mut shared: Vec<Arc<Structure>>,
        still: Option<Arc<Structure>>,
        geometries: &[Geometry],
    ) -> Result<Self, EmbreeError> {
        let mut buffers = Vec::new();
        let root = RawScene::new(&device)?;
        for (id, geometry) in (0u32..).zip(geometries) {
            let raw = match geometry {
                Geometry::Mesh { .. } if still.is_some() => continue,
                Geometry::Mesh {
                    vertices,
                    triangles,
                    seen_by,
                } => {
                    buffers.push((Arc::clone(vertices), Arc::clone(triangles)));
                    new_mesh(&device, vertices, triangles, *seen_by)?
                }
                Geometry::Instance {
                    shared: index,
                    to_world,
                    seen_by,
                } => {
                    let child = shared.get(*index).ok_or(EmbreeError::NoSuchMesh {
                        index: *index,
                        meshes: shared.len(),
                    })?;
                    new_instance(&device, &child.scene, to_world, *seen_by)
                }
            };
            root.attach(raw, id);
        }
        let mut number = sys::RTC_INVALID_GEOMETRY_ID;
        if let Some(still) = still {
            number = geometries.len() as u32;
            let instance = new_instance(&device, &still.scene, &Affine3A::IDENTITY, RayKinds::ALL);
            root.attach(instance, number);
            shared.push(still);
        }
        root.commit(&device)?;
        Ok(Self {
            root,
            still: number,
            _shared: shared,
            _buffers: buffers,
            device,
        })
    }

    /// The bytes that the structures take, those of vertices and triangles not
    /// counted.
    #[must_use]
    pub fn memory(&self) -> u64 {
        self.device.memory()
    }

    /// The nearest hit along `ray`, if there is one.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: Ray) -> Option<Hit> {
        self.nearest(ray, u32::MAX)
    }

    /// The nearest hit of what rays of this kind meet.
    #[must_use]
    #[inline]
    pub fn intersect_as(&self, kind: RayKind, ray: Ray) -> Option<Hit> {
        self.nearest(ray, kind.mask())
    }

    #[inline]
    fn nearest(&self, ray: Ray, mask: u32) -> Option<Hit> {
        #[cfg(feature = "record-rays")]
        super::record::note(super::Query::Intersect(ray));
        let hit = self.query(ray, mask);
        if hit.hit.geomID == sys::RTC_INVALID_GEOMETRY_ID {
            return None;
        }
        // A shared mesh is geometry 0 of its own scene; the instance has the number.
        // Without an instance, Embree's number for none is that of no `still` either.
        let instance = hit.hit.instID[0];
        let geometry = if instance == sys::RTC_INVALID_GEOMETRY_ID || instance == self.still {
            hit.hit.geomID
        } else {
            instance
        };
        Some(Hit {
            t: hit.ray.tfar,
            u: hit.hit.u,
            v: hit.hit.v,
            triangle: hit.hit.primID,
            geometry,
        })
    }

    fn query(&self, ray: Ray, mask: u32) -> PaddedRayHit {
        let mut record = PaddedRayHit::new(ray, mask);
        // SAFETY: the record begins like an RTCRayHit, is aligned to 16 bytes and
        // has room for the fields that newer libraries write behind it; the
        // scene is committed; null arguments mean the defaults.
        unsafe {
            sys::rtcIntersect1(
                self.root.raw(),
                (&raw mut record).cast(),
                std::ptr::null_mut(),
            );
        }
        record
    }

    /// Whether anything lies on `ray`'s segment.
    #[must_use]
    #[inline]
    pub fn occluded(&self, ray: Ray) -> bool {
        self.blocked(ray, u32::MAX)
    }

    /// Whether anything that rays of this kind meet lies on `ray`'s segment.
    #[must_use]
    #[inline]
    pub fn occluded_as(&self, kind: RayKind, ray: Ray) -> bool {
        self.blocked(ray, kind.mask())
    }

    #[inline]
    fn blocked(&self, ray: Ray, mask: u32) -> bool {
        #[cfg(feature = "record-rays")]
        super::record::note(super::Query::Occluded(ray));
        let mut record = ray.to_embree(mask);
        // SAFETY: RTCRay has the library's size and alignment (repr(C, align(16))
        // in the bindings); the scene is committed; null means the defaults.
        unsafe { sys::rtcOccluded1(self.root.raw(), &raw mut record, std::ptr::null_mut()) };
        // Embree marks an occluded ray with −∞.
        record.tfar < 0.0
    }

    /// The corners of the box round everything, or `None` for an empty scene.
    #[must_use]
    pub fn bounds(&self) -> Option<(glam::Vec3, glam::Vec3)> {
        let mut b = sys::RTCBounds {
            lower_x: 0.0,
            lower_y: 0.0,
            lower_z: 0.0,
            align0: 0.0,
            upper_x: 0.0,
            upper_y: 0.0,
            upper_z: 0.0,
            align1: 0.0,
        };
        // SAFETY: the scene is committed and `b` is a valid place to write.
        unsafe { sys::rtcGetSceneBounds(self.root.raw(), &raw mut b) };
        let low = glam::Vec3::new(b.lower_x, b.lower_y, b.lower_z);
        let high = glam::Vec3::new(b.upper_x, b.upper_y, b.upper_z);
        low.cmple(high).all().then_some((low, high))
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::super::geometry::Vertices;
    use super::super::ray::CANARY;
    use super::*;

    fn unit_triangle() -> SharedMesh {
        let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        (Arc::new(vertices.into()), Arc::new(vec![[0, 1, 2]]))
    }

    fn still((vertices, triangles): SharedMesh) -> Geometry {
        Geometry::Mesh {
            vertices,
            triangles,
            seen_by: RayKinds::ALL,
        }
    }

    fn device() -> Arc<Device> {
        Arc::new(Device::new(1).expect("Embree is installed"))
    }

    fn mesh() -> Accelerator {
        Accelerator::build(device(), Vec::new(), &[still(unit_triangle())]).expect("a valid mesh")
    }

    fn shared(device: &Arc<Device>) -> Arc<Structure> {
        let structure = Structure::of_mesh(device, &unit_triangle());
        Arc::new(structure.expect("a valid mesh"))
    }

    const DOWN: Vec3 = vec3(0.0, 0.0, -1.0);

    #[test]
    fn no_more_memory_is_taken_than_the_device_may_hold() {
        let corner = |i: u16| [f32::from(i % 100), f32::from(i / 100), 0.0];
        let vertices: Vertices = (0..10_000).map(corner).collect::<Vec<_>>().into();
        let triangles: Vec<[u32; 3]> = (0..9_800).map(|i| [i, i + 1, i + 100]).collect();
        let mesh = Geometry::Mesh {
            vertices: Arc::new(vertices),
            triangles: Arc::new(triangles),
            seen_by: RayKinds::ALL,
        };
        let build = |limit| {
            let device = Device::with_limit(1, limit).expect("Embree is installed");
            Accelerator::build(Arc::new(device), Vec::new(), std::slice::from_ref(&mesh))
        };
        let needed = build(u64::MAX).expect("there is room").memory();
        assert!((300_000..5_000_000).contains(&needed), "{needed}");
        assert!(build(4 * needed).is_ok());
        let error = build(needed / 2).expect_err("there is no room");
        assert!(matches!(error, EmbreeError::Memory(_)), "{error}");
    }

    #[test]
    fn finds_the_hit_and_its_barycentric_weights() {
        let hit = mesh()
            .intersect(Ray::new(vec3(0.25, 0.5, 2.0), DOWN))
            .expect("above it");
        assert_eq!((hit.geometry, hit.triangle), (0, 0));
        assert!((hit.t - 2.0).abs() < 1e-6 && (hit.u - 0.25).abs() < 1e-6);
        assert!((hit.v - 0.5).abs() < 1e-6);
    }

    #[test]
    fn misses_beside_the_triangle_and_beyond_the_segment() {
        let scene = mesh();
        assert!(
            scene
                .intersect(Ray::new(vec3(0.75, 0.75, 2.0), DOWN))
                .is_none()
        );
        let mut ray = Ray::new(vec3(0.25, 0.25, 2.0), DOWN);
        assert!(scene.occluded(ray));
        ray.t_far = 1.9;
        assert!(!scene.occluded(ray) && scene.intersect(ray).is_none());
    }

    /// The library writes one field past the bindings' record and no more: the
    /// padding is needed, and it is enough.
    #[test]
    fn the_padding_takes_what_the_library_writes_past_the_record() {
        let device = device();
        let shared = vec![shared(&device)];
        let scene = Accelerator::build(
            device,
            shared,
            &[Geometry::Instance {
                shared: 0,
                to_world: Affine3A::IDENTITY,
                seen_by: RayKinds::ALL,
            }],
        )
        .expect("a valid instance");
        let record = scene.query(Ray::new(vec3(0.25, 0.25, 2.0), DOWN), u32::MAX);
        assert_eq!(record.hit.instID[0], 0);
        assert_ne!(
            record.pad[0], CANARY,
            "this Embree writes no instPrimID: is it older than 4.3?"
        );
        assert_eq!(
            record.pad[1..],
            [CANARY; 3],
            "Embree writes further than the padding allows for"
        );
    }

    #[test]
    fn instances_answer_with_their_own_number_and_place() {
        let device = device();
        let shared = vec![shared(&device)];
        let place = |x| Geometry::Instance {
            shared: 0,
            to_world: Affine3A::from_translation(vec3(x, 0.0, 0.0)),
            seen_by: RayKinds::ALL,
        };
        let scene = Accelerator::build(device, shared, &[place(0.0), place(5.0)]).expect("valid");
        let hit = scene
            .intersect(Ray::new(vec3(5.25, 0.25, 1.0), DOWN))
            .expect("the second one");
        assert_eq!(hit.geometry, 1);
        let (low, high) = scene.bounds().expect("not empty");
        assert_eq!((low, high), (Vec3::ZERO, vec3(6.0, 1.0, 0.0)));
    }

    /// A mesh in the structure of what stands still answers with its own number beside
    /// instances, and serves another accelerator afterwards.
    #[test]
    fn what_stands_still_keeps_its_numbers_and_its_structure() {
        let device = device();
        let (vertices, triangles) = unit_triangle();
        let instance = |x| Geometry::Instance {
            shared: 0,
            to_world: Affine3A::from_translation(vec3(x, 0.0, 0.0)),
            seen_by: RayKinds::ALL,
        };
        let mesh = Geometry::Mesh {
            vertices,
            triangles,
            seen_by: RayKinds::ALL,
        };
        let shared = shared(&device);
        let mut geometries = [instance(5.0), mesh, instance(3.0)];
        let still = Structure::of_meshes(&device, &geometries).expect("valid");
        let still = Arc::new(still);
        for x in [5.0, 7.0] {
            geometries[0] = instance(x);
            let scene = Accelerator::build_over(
                Arc::clone(&device),
                vec![Arc::clone(&shared)],
                Arc::clone(&still),
                &geometries,
            )
            .expect("valid");
            for (x, geometry) in [(0.0, 1), (x, 0), (3.0, 2)] {
                let ray = Ray::new(vec3(x + 0.25, 0.25, 1.0), DOWN);
                let hit = scene.intersect(ray).expect("above it");
                assert_eq!((hit.geometry, hit.triangle), (geometry, 0));
                assert!(scene.occluded(ray));
            }
        }
    }

    /// A mesh for cameras and an instance for shadow rays, one above the other.
    #[test]
    fn rays_meet_what_their_kind_sees() {
        let device = device();
        let (vertices, triangles) = unit_triangle();
        let geometries = [
            Geometry::Mesh {
                vertices,
                triangles,
                seen_by: RayKinds::all_but([RayKind::Shadow, RayKind::Glossy]),
            },
            Geometry::Instance {
                shared: 0,
                to_world: Affine3A::from_translation(vec3(0.0, 0.0, 1.0)),
                seen_by: RayKinds::all_but([RayKind::Camera, RayKind::Glossy]),
            },
        ];
        let scene = Accelerator::build(Arc::clone(&device), vec![shared(&device)], &geometries)
            .expect("valid");
        let ray = Ray::new(vec3(0.25, 0.25, 2.0), DOWN);
        let met = |kind| scene.intersect_as(kind, ray).map(|hit| hit.geometry);
        assert_eq!(met(RayKind::Camera), Some(0));
        assert_eq!(met(RayKind::Shadow), Some(1));
        assert_eq!(met(RayKind::Diffuse), Some(1));
        assert_eq!(met(RayKind::Glossy), None);
        assert!(scene.occluded_as(RayKind::Camera, ray) && scene.occluded(ray));
        assert!(!scene.occluded_as(RayKind::Glossy, ray));
        assert_eq!(scene.intersect(ray).map(|hit| hit.geometry), Some(1));
    }

    #[test]
    fn an_index_out_of_range_is_an_error_and_never_reaches_the_library() {
        let (vertices, _) = unit_triangle();
        let triangles = Arc::new(vec![[0, 1, 2], [0, 1, 3]]);
        let error = Accelerator::build(device(), Vec::new(), &[still((vertices, triangles))])
            .expect_err("vertex 3 of 3");
        assert!(
            error.to_string().contains("triangle 1 names vertex 3"),
            "{error}"
        );
    }

    #[test]
    fn an_empty_scene_is_never_hit() {
        let scene = Accelerator::build(device(), Vec::new(), &[]).expect("valid");
        assert!(scene.intersect(Ray::new(Vec3::ZERO, DOWN)).is_none());
        assert!(scene.bounds().is_none());
    }
}

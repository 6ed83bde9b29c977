//! Triangle meshes, instances of them, and their acceleration structures.

use std::ops::Deref;
use std::sync::Arc;

use embree4_sys as sys;
use glam::Affine3A;

use super::device::{Device, EmbreeError};
use crate::rays::RayKinds;

/// Vertex positions, in metres, laid out so that Embree can read them in place.
///
/// Embree loads sixteen bytes for each vertex of twelve: four past the last
/// one. The buffer always has room for one vertex more than it holds.
#[derive(Clone, Debug, Default)]
pub struct Vertices(Vec<[f32; 3]>);

impl From<Vec<[f32; 3]>> for Vertices {
    fn from(mut positions: Vec<[f32; 3]>) -> Self {
        positions.reserve_exact(1);
        // Embree ignores what it reads there, but it should not be uninitialised.
        positions.push([0.0; 3]);
        Self(positions)
    }
}

impl Deref for Vertices {
    type Target = [[f32; 3]];

    fn deref(&self) -> &[[f32; 3]] {
        self.0.split_last().map_or(&[], |(_, positions)| positions)
    }
}

/// One thing that rays can meet.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles where their vertices say.
    Mesh {
        /// Positions in world space.
        vertices: Arc<Vertices>,
        /// Three vertex indices for each triangle.
        triangles: Arc<Vec<[u32; 3]>>,
        /// The rays that meet it.
        seen_by: RayKinds,
    },
    /// Another placing of triangles that several geometries share.
    Instance {
        /// Index into the accelerator's list of shared meshes.
        shared: usize,
        /// Object space to world space.
        to_world: Affine3A,
        /// The rays that meet it.
        seen_by: RayKinds,
    },
}

/// A handle on an Embree scene, released when dropped.
#[derive(Debug)]
pub(super) struct RawScene(sys::RTCScene);

impl RawScene {
    pub fn new(device: &Device) -> Result<Self, EmbreeError> {
        // SAFETY: the device is valid.
        let raw = unsafe { sys::rtcNewScene(device.raw()) };
        device.check()?;
        let scene = Self(raw);
        // Robust: a ray through a shared edge must not slip between two triangles.
        // SAFETY: the scene is valid and not committed yet.
        unsafe { sys::rtcSetSceneFlags(scene.0, sys::RTCSceneFlags::ROBUST) };
        Ok(scene)
    }

    /// For Embree; valid as long as this lives.
    pub fn raw(&self) -> sys::RTCScene {
        self.0
    }

    /// Attaches `geometry` as number `id` and hands it over to the scene.
    pub fn attach(&self, geometry: sys::RTCGeometry, id: u32) {
        // SAFETY: both handles are valid; the scene keeps a reference of its own.
        unsafe {
            sys::rtcCommitGeometry(geometry);
            sys::rtcAttachGeometryByID(self.0, geometry, id);
            sys::rtcReleaseGeometry(geometry);
        }
    }

    pub fn commit(&self, device: &Device) -> Result<(), EmbreeError> {
        // SAFETY: the scene is valid.
        unsafe { sys::rtcCommitScene(self.0) };
        device.check()
    }
}

impl Drop for RawScene {
    fn drop(&mut self) {
        // SAFETY: the handle was made by `new` and is released once.
        unsafe { sys::rtcReleaseScene(self.0) };
    }
}

/// Vertices and triangles that instances share.
pub type SharedMesh = (Arc<Vertices>, Arc<Vec<[u32; 3]>>);

/// Triangles with their acceleration structure, for several accelerators to share.
#[derive(Debug)]
pub struct Structure {
    pub(super) scene: RawScene,
    /// What Embree reads in place.
    _buffers: Vec<SharedMesh>,
    /// Released after the scene.
    _device: Arc<Device>,
}

// SAFETY: Embree's queries on a committed scene are thread safe, nothing here
// changes a scene after `build`, and the buffers are immutable behind `Arc`.
unsafe impl Send for Structure {}
// SAFETY: as above.
unsafe impl Sync for Structure {}

impl Structure {
    /// Builds the structure of a mesh that instances place.
    ///
    /// # Errors
    /// As [`super::Accelerator::build`].
    pub fn of_mesh(device: &Arc<Device>, mesh: &SharedMesh) -> Result<Self, EmbreeError> {
        Self::build(device, [(0, mesh.clone(), RayKinds::ALL)])
    }

    /// Builds one structure over all of the geometries that are meshes; they keep
    /// their numbers.
    ///
    /// # Errors
    /// As [`super::Accelerator::build`].
    pub fn of_meshes(device: &Arc<Device>, geometries: &[Geometry]) -> Result<Self, EmbreeError> {
        let meshes = (0u32..).zip(geometries);
        Self::build(
            device,
            meshes.filter_map(|(id, geometry)| match geometry {
                Geometry::Mesh {
                    vertices,
                    triangles,
                    seen_by,
                } => {
                    let mesh = (Arc::clone(vertices), Arc::clone(triangles));
                    Some((id, mesh, *seen_by))
                }
                Geometry::Instance { .. } => None,
            }),
        )
    }

    fn build(
        device: &Arc<Device>,
        meshes: impl IntoIterator<Item = (u32, SharedMesh, RayKinds)>,
    ) -> Result<Self, EmbreeError> {
        let scene = RawScene::new(device)?;
        let mut buffers = Vec::new();
        for (id, (vertices, triangles), seen_by) in meshes {
            scene.attach(new_mesh(device, &vertices, &triangles, seen_by)?, id);
            buffers.push((vertices, triangles));
        }
        scene.commit(device)?;
        Ok(Self {
            scene,
            _buffers: buffers,
            _device: Arc::clone(device),
        })
    }
}

/// A geometry of triangles that outlive it, for [`RawScene::attach`].
pub(super) fn new_mesh(
    device: &Device,
    vertices: &Vertices,
    triangles: &[[u32; 3]],
    seen_by: RayKinds,
) -> Result<sys::RTCGeometry, EmbreeError> {
    let count = vertices.len();
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= count) {
            return Err(EmbreeError::IndexOutOfRange {
                triangle,
                index,
                vertices: count,
            });
        }
    }
    // SAFETY: the device is valid. The buffers outlive the geometry (the
    // accelerator keeps both `Arc`s), `Vertices` is padded for sixteen-byte
    // loads, and every index was checked above.
    let geometry = unsafe {
        let geometry = sys::rtcNewGeometry(device.raw(), sys::RTCGeometryType::TRIANGLE);
        sys::rtcSetSharedGeometryBuffer(
            geometry,
            sys::RTCBufferType::VERTEX,
            0,
            sys::RTCFormat::FLOAT3,
            vertices.0.as_ptr().cast(),
            0,
            size_of::<[f32; 3]>(),
            count,
        );
        sys::rtcSetSharedGeometryBuffer(
            geometry,
            sys::RTCBufferType::INDEX,
            0,
            sys::RTCFormat::UINT3,
            triangles.as_ptr().cast(),
            0,
            size_of::<[u32; 3]>(),
            triangles.len(),
        );
        sys::rtcSetGeometryMask(geometry, seen_by.mask());
        geometry
    };
    device.check()?;
    Ok(geometry)
}

/// A geometry that places a committed scene, for [`RawScene::attach`].
pub(super) fn new_instance(
    device: &Device,
    child: &RawScene,
    to_world: &Affine3A,
    seen_by: RayKinds,
) -> sys::RTCGeometry {
    let columns = to_world.to_cols_array();
    // SAFETY: device and child scene are valid, and Embree copies the matrix.
    unsafe {
        let geometry = sys::rtcNewGeometry(device.raw(), sys::RTCGeometryType::INSTANCE);
        sys::rtcSetGeometryInstancedScene(geometry, child.0);
        sys::rtcSetGeometryTransform(
            geometry,
            0,
            sys::RTCFormat::FLOAT3X4_COLUMN_MAJOR,
            columns.as_ptr().cast(),
        );
        sys::rtcSetGeometryMask(geometry, seen_by.mask());
        geometry
    }
}

//! Meshes where objects are.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Affine3A, Mat3, Mat3A, Vec3, Vec3A};

use super::attributes::Attributes;
use super::identity::Contents;
use super::material_table::{MaterialTable, assign};
use super::stage::{KeptMesh, Lent, Stage};
use super::{Object, SceneMesh};
use crate::description::{self, Description};
use crate::embree::Geometry;
use crate::mesh::Mesh;

/// Puts meshes where objects are: into world space when one object alone uses
/// the mesh, else once in their own space, to be instanced.
pub(super) struct Placing<'a> {
    meshes: BTreeMap<String, Mesh>,
    contents: &'a Contents,
    users: BTreeMap<String, usize>,
    pub scene_meshes: Vec<SceneMesh>,
    /// What the stage remembers of each of them.
    pub lent: Vec<Lent>,
    /// For instanced meshes: index into `scene_meshes` and into `shared`, and
    /// the names of the material slots.
    placed: BTreeMap<String, (usize, usize, Vec<String>)>,
    /// Indices into `scene_meshes`.
    pub shared: Vec<usize>,
    /// See [`Description::places`].
    places: &'a BTreeMap<String, String>,
}

impl<'a> Placing<'a> {
    pub fn new(
        description: &'a Description,
        meshes: BTreeMap<String, Mesh>,
        contents: &'a Contents,
    ) -> Self {
        let mut users = BTreeMap::new();
        for object in &description.objects {
            *users.entry(object.mesh.clone()).or_default() += 1;
        }
        Self {
            meshes,
            contents,
            users,
            scene_meshes: Vec::new(),
            lent: Vec::new(),
            placed: BTreeMap::new(),
            shared: Vec::new(),
            places: &description.places,
        }
    }

    /// Whether no other object uses its mesh.
    pub fn is_alone(&self, object: &description::Object) -> bool {
        self.users.get(&object.mesh) == Some(&1)
    }

    /// The runtime object, and what Embree makes of it.
    pub fn place(
        &mut self,
        object: &description::Object,
        name: &str,
        to_world: Affine3A,
        alone: bool,
        materials: &mut MaterialTable<'_>,
        stage: &mut Stage,
    ) -> Result<(Object, Geometry), String> {
        let linear = Mat3::from(to_world.matrix3);
        let determinant = linear.as_dmat3().determinant();
        if !to_world.is_finite() || determinant == 0.0 {
            return Err(format!("{name}: the transform flattens the object"));
        }
        let normal_to_world = Mat3A::from(linear.as_dmat3().inverse().transpose().as_mat3());
        if let std::collections::btree_map::Entry::Vacant(entry) =
            self.placed.entry(object.mesh.clone())
        {
            let KeptMesh { mesh, lent } = match stage.take_mesh(&object.mesh) {
                Some(kept) => kept,
                None => {
                    let mesh = self
                        .meshes
                        .remove(&object.mesh)
                        .ok_or_else(|| format!("{name}: there is no mesh `{}`", object.mesh))?;
                    let content = self.contents.meshes.get(&object.mesh);
                    let lent = Lent {
                        key: stage.key_of(&object.mesh),
                        slots: mesh.material_names.clone(),
                        content: content.cloned().unwrap_or_default(),
                    };
                    let place = alone.then_some((&to_world, &normal_to_world));
                    KeptMesh {
                        mesh: scene_mesh(mesh, place, materials.source.attributes()),
                        lent,
                    }
                }
            };
            let slots = lent.slots.clone();
            if !alone {
                self.shared.push(self.scene_meshes.len());
            }
            self.lent.push(lent);
            self.scene_meshes.push(mesh);
            entry.insert((
                self.scene_meshes.len() - 1,
                self.shared.len().wrapping_sub(1),
                slots,
            ));
        }
        let (mesh, shared, slots) = self.placed[&object.mesh].clone();
        let material_indices = assign(&object.materials, &slots, name, materials)?;
        if let Some(lack) = materials.lack(&material_indices, &self.scene_meshes[mesh]) {
            let place = self.places.get(&lack).map_or("", String::as_str);
            let lacks = if lack.starts_with("material ") {
                "texture coordinates"
            } else {
                &lack
            };
            return Err(format!(
                "{place}: this needs {lacks}, which the mesh `{}` of {name} lacks",
                object.mesh
            ));
        }
        let geometry = if alone {
            Geometry::Mesh {
                vertices: Arc::clone(&self.scene_meshes[mesh].vertices),
                triangles: Arc::clone(&self.scene_meshes[mesh].triangles),
                seen_by: object.seen_by(),
            }
        } else {
            Geometry::Instance {
                shared,
                to_world,
                seen_by: object.seen_by(),
            }
        };
        let runtime = Object {
            name: name.to_owned(),
            mesh,
            to_world: (!alone).then_some(to_world),
            normal_to_world,
            normal_to_object: Mat3A::from(linear.transpose()),
            world_to_box: None,
            mirrored: determinant < 0.0,
            materials: material_indices,
            seen_by: object.seen_by(),
            holdout: object.holdout,
            first_emitter: None,
        };
        Ok((runtime, geometry))
    }
}

/// The mesh as the scene keeps it, moved to world space if one object has it
/// for itself.
fn scene_mesh(
    mesh: Mesh,
    place: Option<(&Affine3A, &Mat3A)>,
    attributes: &Attributes,
) -> SceneMesh {
    let (mut uv_maps, mut colors) = (mesh.uv_maps, mesh.colors);
    let mut positions = mesh.positions;
    let mut normals = mesh.normals;
    if let Some((to_world, normal_to_world)) = place {
        for p in &mut positions {
            *p = to_world.transform_point3a(Vec3A::from(*p)).into();
        }
        for n in normals.iter_mut().flatten() {
            *n = (*normal_to_world * Vec3A::from(*n))
                .normalize_or_zero()
                .into();
        }
    }
    SceneMesh {
        vertices: Arc::new(positions.into()),
        triangles: Arc::new(mesh.triangles),
        normals,
        uvs: mesh.uvs,
        tangents: mesh.tangents,
        uv_maps: attributes
            .uv_maps()
            .map(|(_, name)| uv_maps.remove(name))
            .collect(),
        colors: attributes
            .color_names()
            .map(|name| colors.remove(name))
            .collect(),
        slots: mesh.material_of_triangle,
    }
}

/// World space to the box round the object's mesh, each side from −½ to ½.
pub(super) fn box_of(object: &Object, mesh: &SceneMesh) -> Affine3A {
    // A mesh in world space has lost its own axes; its transform is undone
    // through the matrix for normals, the inverse transpose of its linear part.
    let to_local = match object.to_world {
        Some(to_world) => to_world.inverse(),
        None => Affine3A::from_mat3(Mat3::from(object.normal_to_world.transpose())),
    };
    let in_object = |p: &[f32; 3]| match object.to_world {
        Some(_) => Vec3A::from(*p),
        None => to_local.transform_point3a(Vec3A::from(*p)),
    };
    let (low, high) = mesh
        .vertices
        .iter()
        .map(in_object)
        .fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    // A flat side has no extent to divide by, and no tangent that needs it.
    let size = (high - low).max(Vec3A::splat(f32::MIN_POSITIVE));
    let to_box = Affine3A::from_scale(Vec3::from(size.recip().min(Vec3A::splat(f32::MAX))))
        * Affine3A::from_translation(Vec3::from(-(low + high) * 0.5));
    to_box * to_local
}

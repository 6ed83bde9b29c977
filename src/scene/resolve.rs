//! Description and files to runtime scene: names, defaults and units end here.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Affine3A, Mat3, Mat3A, Vec3, Vec3A};

use super::attributes::Attributes;
use super::compile::Materials;
use super::error::ResolveError;
use super::identity::{Contents, identity};
use super::load::Assets;
use super::stage::{KeptMesh, Lent, Stage};
use super::transform::to_affine;
use super::{Material, Object, RenderSettings, Scene, SceneMesh};
use crate::camera::Camera;
use crate::color::Rgb;
use crate::description::{Assignment, Description, Transform};
use crate::embree::{Accelerator, Geometry};
use crate::features::Features;
use crate::film::Identity;
use crate::light::{EmissiveTriangle, Light, Lights, World, resolve_light, resolve_world};
use crate::memory::Budget;
use crate::mesh::Mesh;
use crate::rays::{RayKind, RayKinds};
use crate::texture::Texture;

/// A scene, and what was mended to get it.
#[derive(Debug)]
pub struct Resolved {
    /// Ready to render.
    pub scene: Scene,
    /// As the description has them.
    pub settings: RenderSettings,
    /// What decides about its samples.
    pub identity: Identity,
    /// Repairs of input files and things that were left out, for people.
    pub repairs: Vec<String>,
}

/// Reads the files that the description names and builds the scene.
///
/// # Errors
/// Every file that can't be read and every name that leads nowhere.
pub fn resolve(description: &Description) -> Result<Resolved, ResolveError> {
    resolve_within(description, &Budget::of_machine())
}

/// As [`resolve`], with no more memory than `budget` has.
///
/// # Errors
/// As [`resolve`], and what there is no room for.
pub fn resolve_within(
    description: &Description,
    budget: &Budget,
) -> Result<Resolved, ResolveError> {
    let mut stage = Stage::default();
    let mut materials = Materials::of(description);
    let assets = Assets::load(description, &mut materials, budget, &mut stage)?;
    build(description, assets, materials, budget, &mut stage)
}

/// Builds the scene from a description and the contents of its files.
///
/// # Errors
/// Every name that leads nowhere, and what Embree refuses.
pub fn assemble(
    description: &Description,
    assets: Assets,
    budget: &Budget,
) -> Result<Resolved, ResolveError> {
    let materials = Materials::of(description);
    build(
        description,
        assets,
        materials,
        budget,
        &mut Stage::default(),
    )
}

pub(super) fn build(
    description: &Description,
    assets: Assets,
    materials: Materials<'_>,
    budget: &Budget,
    stage: &mut Stage,
) -> Result<Resolved, ResolveError> {
    let mut contents = Contents::of(description, &assets);
    stage.complete(&mut contents);
    let identity = identity(description, &contents, stage.identity());
    let mut problems = Vec::new();
    let Assets {
        meshes,
        textures: mut loaded,
        environment,
        mut repairs,
    } = assets;

    let mut materials = MaterialTable::new(materials);
    let origin = stage.origin(description);
    let at = |transform: &Transform| {
        let mut to_world = to_affine(transform);
        to_world.translation -= origin;
        to_world
    };
    let mut placing = Placing::new(description, meshes, &contents);
    let mut objects = Vec::new();
    let mut geometries = Vec::new();
    for (index, object) in description.objects.iter().enumerate() {
        let name = object
            .name
            .clone()
            .unwrap_or_else(|| format!("objects.{index}"));
        let alone = placing.is_alone(object) && !stage.moves(index, &object.mesh);
        let place = at(&object.transform);
        let result = placing.place(object, &name, place, alone, &mut materials, stage);
        match result {
            Ok((object, geometry)) => {
                objects.push(object);
                geometries.push(geometry);
            }
            Err(message) => problems.push(message),
        }
    }
    problems.append(&mut materials.problems);
    let MaterialTable {
        source,
        compiled: materials,
        features: mut needed,
        mut notes,
        ..
    } = materials;
    repairs.append(&mut notes);
    let mut textures: Vec<Texture> = Vec::new();
    for name in source.textures() {
        match loaded.remove(name).or_else(|| stage.texture(name)) {
            Some(texture) => textures.push(texture),
            None => problems.push(format!("the texture `{name}` is missing")),
        }
    }
    let Placing {
        scene_meshes,
        lent,
        shared,
        ..
    } = placing;

    for object in &mut objects {
        if object
            .materials
            .iter()
            .any(|&m| materials[m].has_radial_tangent())
        {
            object.world_to_box = Some(box_of(object, &scene_meshes[object.mesh]));
        }
    }

    let mut lamps: Vec<Light> = Vec::new();
    for (index, light) in description.lights.iter().enumerate() {
        match resolve_light(light, at(&light.transform), description.light_units) {
            Ok(light) => lamps.push(light),
            Err(error) => problems.push(format!("lights.{index}: {error}")),
        }
    }
    // The image was read with the other files; a world without one has none.
    let world = match (stage.take_world(), &description.world) {
        (Some(world), _) => world,
        (None, None) => World::Constant(Rgb::ZERO),
        (None, Some(world)) => {
            resolve_world(world, |_| environment.ok_or("the world's image is missing"))
                .unwrap_or_else(|error| {
                    problems.push(format!("world: {error}"));
                    World::Constant(Rgb::ZERO)
                })
        }
    };
    if !problems.is_empty() {
        return Err(ResolveError { problems });
    }
    let triangles = emissive_triangles(&mut objects, &scene_meshes, &materials, &textures);
    let camera = description.camera.as_ref().map(|camera| {
        let resolution = [description.film.width, description.film.height];
        Camera::from_description(camera, at(&camera.transform), resolution)
    });
    let camera = match camera.transpose() {
        Ok(camera) => camera,
        Err(error) => {
            problems.push(format!("camera: {error}"));
            None
        }
    };

    if !problems.is_empty() {
        return Err(ResolveError { problems });
    }
    let mut build = || -> Result<Accelerator, crate::embree::EmbreeError> {
        let device = stage.device(budget)?;
        let shared = shared.iter().map(|&index| {
            let mesh = &scene_meshes[index];
            let mesh = (Arc::clone(&mesh.vertices), Arc::clone(&mesh.triangles));
            stage.structure(&device, &lent[index].key, &mesh)
        });
        let shared = shared.collect::<Result<Vec<_>, _>>()?;
        let key = |object: usize| lent[objects[object].mesh].key.as_str();
        match stage.still(&device, &geometries, key)? {
            Some(still) => Accelerator::build_over(device, shared, still, &geometries),
            None => Accelerator::build(device, shared, &geometries),
        }
    };
    let accelerator = build().map_err(|e| ResolveError {
        problems: vec![e.to_string()],
    })?;
    let names = source.textures().iter().cloned();
    let used = names.zip(textures.iter().cloned());
    stage.lend(description, lent, used, &contents);
    let world_seen_by = description
        .world
        .as_ref()
        .map_or(RayKinds::ALL, |w| w.seen_by());
    let world_seen_by = match description.film.transparent {
        true => world_seen_by.without(RayKind::Camera),
        false => world_seen_by,
    };
    let lights = Lights::new(lamps, world, triangles).with_world_seen_by(world_seen_by);
    let mut scene = Scene {
        accelerator,
        emitters: emitters(&objects, &scene_meshes),
        meshes: scene_meshes,
        objects,
        materials,
        textures,
        lights,
        camera,
        features: Features::NONE,
    };
    needed.add_if(Features::TEXTURES, !scene.textures.is_empty());
    scene.features = features(&scene).with(needed);
    Ok(Resolved {
        scene,
        settings: RenderSettings::new(description),
        identity,
        repairs,
    })
}

/// The materials that objects turn out to have.
struct MaterialTable<'a> {
    source: Materials<'a>,
    indices: BTreeMap<String, usize>,
    compiled: Vec<Material>,
    features: Features,
    notes: Vec<String>,
    problems: Vec<String>,
}

impl<'a> MaterialTable<'a> {
    fn new(source: Materials<'a>) -> Self {
        Self {
            source,
            indices: BTreeMap::new(),
            compiled: Vec::new(),
            features: Features::NONE,
            notes: Vec::new(),
            problems: Vec::new(),
        }
    }

    /// What the first of these materials that is not content with a mesh asks for, as
    /// [`Description::places`] has it.
    fn lack(&mut self, indices: &[usize], mesh: &SceneMesh) -> Option<String> {
        let names: Vec<_> = self.indices.iter().collect();
        for (name, index) in names {
            if !indices.contains(index) {
                continue;
            }
            let Some(Ok(compiled)) = self.source.get(name) else {
                continue;
            };
            let needs = &compiled.needs;
            let flat = !needs.features.contains(Features::NORMAL_MAPS);
            if !flat && needs.uvs && mesh.uvs.is_none() {
                return Some(format!("material {name}"));
            }
            let (uv_maps, colors) = (needs.uv_maps.clone(), needs.colors.clone());
            let attributes = self.source.attributes();
            for map in uv_maps.keys() {
                if mesh.uvs(attributes.uv_map(Some(map))).is_none() {
                    return Some(format!("UV map {map}"));
                }
            }
            for color in &colors {
                if mesh
                    .colors
                    .get(attributes.colors(color))
                    .is_none_or(Option::is_none)
                {
                    return Some(format!("set of colours {color}"));
                }
            }
        }
        None
    }

    /// The index of the material of this name; `None` if there is no such name.
    fn index(&mut self, name: &str) -> Option<usize> {
        if let Some(&index) = self.indices.get(name) {
            return Some(index);
        }
        let material = match self.source.get(name)? {
            Ok(compiled) => {
                self.features = self.features.with(compiled.needs.features);
                let notes = compiled.needs.notes.iter();
                self.notes
                    .extend(notes.map(|note| format!("material `{name}`: {note}")));
                compiled.material.clone()
            }
            Err(error) => {
                self.problems.push(format!("materials.{name}: {error}"));
                Material::default()
            }
        };
        self.compiled.push(material);
        self.indices
            .insert(name.to_owned(), self.compiled.len() - 1);
        Some(self.compiled.len() - 1)
    }
}

/// Puts meshes where objects are: into world space when one object alone uses
/// the mesh, else once in their own space, to be instanced.
struct Placing<'a> {
    meshes: BTreeMap<String, Mesh>,
    contents: &'a Contents,
    users: BTreeMap<String, usize>,
    scene_meshes: Vec<SceneMesh>,
    /// What the stage remembers of each of them.
    lent: Vec<Lent>,
    /// For instanced meshes: index into `scene_meshes` and into `shared`, and
    /// the names of the material slots.
    placed: BTreeMap<String, (usize, usize, Vec<String>)>,
    /// Indices into `scene_meshes`.
    shared: Vec<usize>,
    /// See [`Description::places`].
    places: &'a BTreeMap<String, String>,
}

impl<'a> Placing<'a> {
    fn new(
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
    fn is_alone(&self, object: &crate::description::Object) -> bool {
        self.users.get(&object.mesh) == Some(&1)
    }

    fn place(
        &mut self,
        object: &crate::description::Object,
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

/// The material of each slot of a mesh.
fn assign(
    assignment: &Assignment,
    slots: &[String],
    object: &str,
    materials: &mut MaterialTable<'_>,
) -> Result<Vec<usize>, String> {
    let mut find = |name: &str, why: &str| {
        materials.index(name).ok_or_else(|| {
            let known: Vec<&str> = materials.source.names().collect();
            format!(
                "{object}: there is no material `{name}`{why}; there are: {}",
                known.join(", ")
            )
        })
    };
    match assignment {
        Assignment::All(name) => Ok(vec![find(name, "")?; slots.len().max(1)]),
        Assignment::BySlot(map) if slots.is_empty() => match map.values().next() {
            Some(name) if map.len() == 1 => Ok(vec![find(name, "")?]),
            _ => Err(format!(
                "{object}: `materials` names slots, but the mesh has no usemtl line"
            )),
        },
        Assignment::BySlot(map) => slots
            .iter()
            .map(|slot| match map.get(slot) {
                Some(name) => find(name, ""),
                None => Err(format!(
                    "{object}: `materials` has nothing for the slot `{slot}`"
                )),
            })
            .collect(),
        Assignment::FromMesh if slots.is_empty() => Err(format!(
            "{object}: has neither `material` nor `materials`, and the mesh has no usemtl line"
        )),
        Assignment::FromMesh => slots
            .iter()
            .map(|slot| find(slot, ", which the mesh's usemtl line asks for"))
            .collect(),
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
fn box_of(object: &Object, mesh: &SceneMesh) -> Affine3A {
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

/// Lists the triangles of emissive objects for the light sampler, and numbers
/// the objects' first ones.
fn emissive_triangles(
    objects: &mut [Object],
    meshes: &[SceneMesh],
    materials: &[Material],
    textures: &[Texture],
) -> Vec<EmissiveTriangle> {
    let mut emissive = Vec::new();
    for object in objects {
        if !object.materials.iter().any(|&m| materials[m].emits()) {
            continue;
        }
        object.first_emitter = u32::try_from(emissive.len()).ok();
        let mesh = &meshes[object.mesh];
        let radiance: Vec<Rgb> = object
            .materials
            .iter()
            .map(|&material| materials[material].mean_emission(textures))
            .collect();
        for (index, corners) in mesh.triangles.iter().enumerate() {
            let slot = mesh.slots.as_ref().map_or(0, |slots| slots[index] as usize);
            let vertices = corners.map(|i| {
                let p = Vec3A::from(mesh.vertices[i as usize]);
                Vec3::from(
                    object
                        .to_world
                        .map_or(p, |to_world| to_world.transform_point3a(p)),
                )
            });
            let radiance = radiance[slot];
            emissive.push(EmissiveTriangle { vertices, radiance });
        }
    }
    emissive
}

/// For each of these triangles, the index of its object.
fn emitters(objects: &[Object], meshes: &[SceneMesh]) -> Vec<u32> {
    (0..)
        .zip(objects)
        .filter(|(_, object)| object.first_emitter.is_some())
        .flat_map(|(index, object)| {
            let count = meshes[object.mesh].triangles.len();
            std::iter::repeat_n(index, count)
        })
        .collect()
}

/// What the scene uses, materials aside.
fn features(scene: &Scene) -> Features {
    let mut set = Features::NONE;
    set.add_if(Features::LIGHT_SAMPLING, !scene.lights.is_empty());
    set.add_if(Features::AREA_LIGHTS, scene.lights.can_be_crossed());
    set.add_if(
        Features::ENVIRONMENT,
        matches!(scene.lights.surroundings(), World::Environment(_)),
    );
    set.add_if(
        Features::EMISSIVE_MESHES,
        scene.objects.iter().any(|o| o.first_emitter.is_some()),
    );
    set.add_if(
        Features::INSTANCES,
        scene.objects.iter().any(|o| o.to_world.is_some()),
    );
    set.add_if(
        Features::RAY_VISIBILITY,
        scene
            .objects
            .iter()
            .any(|o| o.seen_by != RayKinds::ALL || o.holdout)
            || scene.lights.hides_from_scattered()
            || scene.lights.world_seen_by() != RayKinds::ALL,
    );
    set.add_if(
        Features::SMOOTH_NORMALS,
        scene.meshes.iter().any(|m| m.normals.is_some()),
    );
    set.add_if(
        Features::DEPTH_OF_FIELD,
        scene.camera.as_ref().is_some_and(Camera::has_lens),
    );
    set
}

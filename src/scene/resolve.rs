//! Description and files to runtime scene: names, defaults and units end here.

use std::sync::Arc;

use glam::{Vec3, Vec3A};

use super::compile::Materials;
use super::error::ResolveError;
use super::identity::{Contents, identity};
use super::load::Assets;
use super::material_table::MaterialTable;
use super::placing::{Placing, box_of};
use super::stage::Stage;
use super::transform::to_affine;
use super::{Material, Object, RenderSettings, Scene, SceneMesh};
use crate::camera::Camera;
use crate::color::Rgb;
use crate::description::{Description, Transform};
use crate::embree::Accelerator;
use crate::features::Features;
use crate::film::Identity;
use crate::light::{EmissiveTriangle, Light, Lights, World, resolve_light, resolve_world};
use crate::memory::Budget;
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

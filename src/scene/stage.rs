//! What stands still from frame to frame, kept from one to the next.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{Affine3A, Vec3A};

use super::compile::Materials;
use super::error::ResolveError;
use super::identity::Contents;
use super::load::Assets;
use super::resolve::{Resolved, build};
use super::transform::to_affine;
use super::{Scene, SceneMesh};
use crate::color::Rgb;
use crate::description::{self, Changes, Description, Frame, Transform};
use crate::embree::{Device, EmbreeError, Geometry, SharedMesh, Structure};
use crate::light;
use crate::memory::Budget;
use crate::texture::Texture;

/// Makes the scenes of an animation's frames one after another. Meshes and their
/// acceleration structures, textures and the world's image are read and built once
/// for as long as frames leave them as they are.
///
/// Objects that a frame changes, or whose mesh it changes, are instances of their
/// meshes; all others are built together, as in a scene without frames. So a frame is
/// built in the same way whatever came before it, and has the same bits. Where it
/// changes what others do not, what stands still is built again.
#[derive(Debug, Default)]
pub struct Stage {
    /// `None` in a scene without frames.
    frame: Option<Moves>,
    device: Option<Arc<Device>>,
    /// The keys of the meshes in use, by their names.
    keys: BTreeMap<String, String>,
    /// By their keys, as are the structures.
    meshes: BTreeMap<String, KeptMesh>,
    structures: BTreeMap<String, Arc<Structure>>,
    still: Option<Still>,
    textures: BTreeMap<String, KeptTexture>,
    world: Option<KeptWorld>,
    /// What the scene that was made last has of each of its meshes.
    lent: Vec<Lent>,
}

#[derive(Debug)]
struct Moves {
    /// Where coordinates are counted from while the camera is near.
    origin: Vec3A,
    changes: Changes,
}

#[derive(Debug)]
pub(super) struct KeptMesh {
    pub mesh: SceneMesh,
    pub lent: Lent,
}

/// What a scene does not have of its meshes.
#[derive(Clone, Debug)]
pub(super) struct Lent {
    pub key: String,
    /// The names of the material slots.
    pub slots: Vec<String>,
    /// See [`Contents`].
    pub content: String,
}

/// The structure of all that stands still.
#[derive(Debug)]
struct Still {
    /// Of each object, if it is a part of it, the key of its mesh.
    parts: Vec<Option<String>>,
    structure: Arc<Structure>,
}

#[derive(Debug)]
struct KeptTexture {
    described: description::Texture,
    texture: Texture,
    content: Option<u128>,
}

#[derive(Debug)]
struct KeptWorld {
    described: description::World,
    world: light::World,
    content: Option<(usize, u128)>,
}

/// The largest coordinate of a camera, in metres, up to which the scene keeps
/// the file's origin: there `f32` still resolves a tenth of a millimetre.
const NEAR_ORIGIN: f32 = 1024.0;

/// What the file's coordinates are counted from. Positions in `f32` are as
/// coarse as they are far from the origin, and rays start off surfaces by a
/// multiple of that; so a scene that is far away is moved to its camera.
fn origin(camera: Option<&Transform>, usual: Vec3A) -> Vec3A {
    let position = camera.map_or(usual, |transform| to_affine(transform).translation);
    if position.is_finite() && (position - usual).abs().max_element() > NEAR_ORIGIN {
        position
    } else {
        usual
    }
}

impl Stage {
    /// For the frames of an animation whose camera stands there in the scene file.
    #[must_use]
    pub fn new(camera: Option<&Transform>) -> Self {
        Self {
            frame: Some(Moves {
                origin: origin(camera, Vec3A::ZERO),
                changes: Changes::default(),
            }),
            ..Self::default()
        }
    }

    /// Builds the scene of a frame. Scenes that were made before should have come back
    /// ([`Stage::take_back`]).
    ///
    /// # Errors
    /// As [`super::resolve`], and what there is no room for.
    pub fn resolve(&mut self, frame: &Frame, budget: &Budget) -> Result<Resolved, ResolveError> {
        if let Some(moves) = &mut self.frame {
            moves.changes.clone_from(&frame.changes);
        }
        let mut materials = Materials::of(&frame.description);
        let assets = Assets::load(&frame.description, &mut materials, budget, self)?;
        build(&frame.description, assets, materials, budget, self)
    }

    /// Takes what the next frame may need.
    pub fn take_back(&mut self, scene: Scene) {
        let lent = self.lent.drain(..);
        let kept = lent.zip(scene.meshes);
        self.meshes = kept
            .map(|(lent, mesh)| (lent.key.clone(), KeptMesh { mesh, lent }))
            .collect();
        if let Some(kept) = &mut self.world {
            kept.world = scene.lights.into_surroundings();
        }
    }

    /// The bytes of what is kept, in about.
    #[must_use]
    pub fn memory(&self) -> u64 {
        let meshes = self.meshes.values().map(|kept| kept.mesh.memory() as u64);
        let textures: Vec<_> = self
            .textures
            .values()
            .map(|kept| kept.texture.clone())
            .collect();
        let world = self.world.as_ref().map_or(0, |kept| kept.world.memory());
        let device = self.device.as_ref().map_or(0, |device| device.memory());
        meshes.sum::<u64>() + (Texture::memory(&textures) + world) as u64 + device
    }

    /// What this scene's coordinates are counted from.
    pub(super) fn origin(&self, description: &Description) -> Vec3A {
        let usual = self
            .frame
            .as_ref()
            .map_or(Vec3A::ZERO, |moves| moves.origin);
        origin(description.camera.as_ref().map(|c| &c.transform), usual)
    }

    /// Where each mesh stands that is kept in world space, since one object alone has it
    /// and does not move; nothing for the others.
    pub(super) fn places<'a>(
        &self,
        description: &'a Description,
    ) -> BTreeMap<&'a str, Option<Affine3A>> {
        let origin = self.origin(description);
        let mut places: BTreeMap<&str, Option<Affine3A>> = BTreeMap::new();
        for (index, object) in description.objects.iter().enumerate() {
            let mut to_world = to_affine(&object.transform);
            to_world.translation -= origin;
            let moves = self.moves(index, &object.mesh);
            places
                .entry(&object.mesh)
                .and_modify(|place| *place = None)
                .or_insert((!moves).then_some(to_world));
        }
        places
    }

    /// Whether an object is placed for this frame alone.
    pub(super) fn moves(&self, object: usize, mesh: &str) -> bool {
        let frame = self.frame.as_ref();
        frame.is_some_and(|moves| moves.changes.touch(object, mesh))
    }

    /// What decides how the scene is built, beside the description.
    pub(super) fn identity(&self) -> Option<String> {
        let Moves { origin, changes } = self.frame.as_ref()?;
        Some(format!("{origin:?} {changes:?}"))
    }

    /// What a mesh is kept under: its name, its file and what is read of it, and where it
    /// stands if it is in world space.
    pub(super) fn key(content: &str, place: Option<&Affine3A>) -> String {
        format!("{content} {place:?}")
    }

    /// Drops what has other keys than these, before others are read.
    pub(super) fn keep_meshes(&mut self, keys: BTreeMap<String, String>) {
        let wanted: BTreeSet<&String> = keys.values().collect();
        self.meshes.retain(|key, _| wanted.contains(key));
        self.structures.retain(|key, _| wanted.contains(key));
        self.keys = keys;
    }

    /// What a mesh in use is kept under.
    pub(super) fn key_of(&self, mesh: &str) -> String {
        self.keys.get(mesh).cloned().unwrap_or_default()
    }

    /// Drops the textures that are not as described now, or not in use.
    pub(super) fn keep_textures(&mut self, description: &Description, used: &[String]) {
        self.textures.retain(|name, kept| {
            used.contains(name) && description.textures.get(name) == Some(&kept.described)
        });
        if self.world.as_ref().map(|kept| &kept.described) != description.world.as_ref() {
            self.world = None;
        }
    }

    pub(super) fn has_mesh(&self, name: &str) -> bool {
        let key = self.keys.get(name);
        key.is_some_and(|key| self.meshes.contains_key(key))
    }

    pub(super) fn has_texture(&self, name: &str) -> bool {
        self.textures.contains_key(name)
    }

    pub(super) fn has_world(&self) -> bool {
        self.world.is_some()
    }

    /// Adds what is kept to what is known of the files' contents.
    pub(super) fn complete(&self, contents: &mut Contents) {
        for (name, key) in &self.keys {
            if let Some(kept) = self.meshes.get(key) {
                contents
                    .meshes
                    .insert(name.clone(), kept.lent.content.clone());
            }
        }
        for (name, kept) in &self.textures {
            contents.textures.insert(name.clone(), kept.content);
        }
        if let Some(kept) = &self.world {
            contents.environment = kept.content;
        }
    }

    pub(super) fn take_mesh(&mut self, name: &str) -> Option<KeptMesh> {
        self.meshes.remove(self.keys.get(name)?)
    }

    pub(super) fn texture(&self, name: &str) -> Option<Texture> {
        self.textures.get(name).map(|kept| kept.texture.clone())
    }

    /// The kept world, which comes back with the scene.
    pub(super) fn take_world(&mut self) -> Option<light::World> {
        let nothing = light::World::Constant(Rgb::ZERO);
        let kept = self.world.as_mut()?;
        Some(std::mem::replace(&mut kept.world, nothing))
    }

    /// Remembers what a scene is made of that is about to be given out.
    pub(super) fn lend(
        &mut self,
        description: &Description,
        lent: Vec<Lent>,
        textures: impl Iterator<Item = (String, Texture)>,
        contents: &Contents,
    ) {
        if self.frame.is_none() {
            return;
        }
        self.lent = lent;
        let described = |name: &String| description.textures.get(name).cloned();
        self.textures = textures
            .filter_map(|(name, texture)| {
                let kept = KeptTexture {
                    described: described(&name)?,
                    texture,
                    content: contents.textures.get(&name).copied().flatten(),
                };
                Some((name, kept))
            })
            .collect();
        self.world = description.world.as_ref().map(|world| KeptWorld {
            described: world.clone(),
            world: light::World::Constant(Rgb::ZERO),
            content: contents.environment,
        });
    }

    /// The device of all frames.
    pub(super) fn device(&mut self, budget: &Budget) -> Result<Arc<Device>, EmbreeError> {
        if self.device.is_none() {
            self.device = Some(Arc::new(Device::with_limit(0, budget.left())?));
        }
        Ok(Arc::clone(self.device.as_ref().expect("made just now")))
    }

    /// The structure of a mesh that instances share.
    pub(super) fn structure(
        &mut self,
        device: &Arc<Device>,
        key: &str,
        mesh: &SharedMesh,
    ) -> Result<Arc<Structure>, EmbreeError> {
        if let Some(structure) = self.structures.get(key) {
            return Ok(Arc::clone(structure));
        }
        let structure = Arc::new(Structure::of_mesh(device, mesh)?);
        if self.frame.is_some() {
            self.structures
                .insert(key.to_owned(), Arc::clone(&structure));
        }
        Ok(structure)
    }

    /// The structure of all that stands still; `None` in a scene without frames. `key`
    /// gives that of an object's mesh.
    pub(super) fn still<'a>(
        &mut self,
        device: &Arc<Device>,
        geometries: &[Geometry],
        key: impl Fn(usize) -> &'a str,
    ) -> Result<Option<Arc<Structure>>, EmbreeError> {
        if self.frame.is_none() {
            return Ok(None);
        }
        let parts = geometries.iter().enumerate();
        let parts: Vec<Option<String>> = parts
            .map(|(index, geometry)| match geometry {
                Geometry::Mesh { .. } => Some(key(index).to_owned()),
                Geometry::Instance { .. } => None,
            })
            .collect();
        if self.still.as_ref().is_none_or(|still| still.parts != parts) {
            // The old one goes before the new one takes its memory.
            self.still = None;
            let structure = Arc::new(Structure::of_meshes(device, geometries)?);
            self.still = Some(Still { parts, structure });
        }
        Ok(self
            .still
            .as_ref()
            .map(|still| Arc::clone(&still.structure)))
    }
}

//! Files that a description names, read in parallel, all errors together.

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use super::compile::Materials;
use super::error::ResolveError;
use super::stage::Stage;
use crate::description::{self, Assignment, Description, Object, Placing, World};
use crate::memory::Budget;
use crate::mesh::{Mesh, Wanted};
use crate::texture::{EnvironmentImage, Images, Lookup, Texture, UvTransform, load_environment};

/// The contents of a scene's files.
#[derive(Debug, Default)]
pub struct Assets {
    /// By the description's names; those that no object uses are left out.
    pub meshes: BTreeMap<String, Mesh>,
    /// By the description's names; those that no material in use looks up are
    /// left out.
    pub textures: BTreeMap<String, Texture>,
    /// The world's image.
    pub environment: Option<EnvironmentImage>,
    /// What was mended on the way, for people.
    pub repairs: Vec<String>,
}

impl Assets {
    /// Reads what the description's objects and world need and the stage does not have,
    /// and nothing else; the materials that objects may have are compiled for that.
    ///
    /// # Errors
    /// Everything that could not be read, or for which the budget has no room.
    pub(super) fn load(
        description: &Description,
        materials: &mut Materials<'_>,
        budget: &Budget,
        stage: &mut Stage,
    ) -> Result<Self, ResolveError> {
        let used = Used::by(description, materials);
        stage.keep_meshes(used.keys(description, stage));
        stage.keep_textures(description, materials.textures());
        let stage = &*stage;
        let meshes: Vec<_> = used
            .meshes
            .par_iter()
            .filter(|(name, _)| !stage.has_mesh(name))
            .filter_map(|(name, used)| {
                let path = description.resolve_path(&description.meshes.get(name)?.file);
                let wanted = Wanted {
                    uvs: used.uvs,
                    normals: true,
                };
                // A mesh takes about as much as its text.
                let length = std::fs::metadata(&path).map_or(0, |file| file.len());
                let loaded = budget
                    .take(length, format!("the mesh {}", path.display()))
                    .map_err(|e| e.to_string())
                    .and_then(|()| Mesh::load(&path, wanted).map_err(|e| e.to_string()));
                let loaded = loaded.and_then(|(mut mesh, repairs)| {
                    if used.tangents {
                        add_tangents(&mut mesh, &path, budget)?;
                    }
                    Ok((mesh, repairs))
                });
                Some((name.clone(), loaded))
            })
            .collect();
        let images = Images::new(budget);
        let textures: Vec<_> = materials
            .textures()
            .par_iter()
            .filter(|name| !stage.has_texture(name))
            .filter_map(|name| {
                let texture = description.textures.get(name)?;
                let path = description.resolve_path(&texture.file);
                let loaded = images.texture(&path, lookup(texture));
                Some((name.clone(), loaded.map_err(|e| e.to_string())))
            })
            .collect();
        let environment = match &description.world {
            Some(World::Environment { file, .. }) if !stage.has_world() => {
                let loaded = load_environment(&description.resolve_path(file), budget);
                Some(loaded.map_err(|e| e.to_string()))
            }
            _ => None,
        };

        let mut assets = Self::default();
        let mut errors = Vec::new();
        for (name, result) in meshes {
            match result {
                Ok((mesh, repairs)) => {
                    assets
                        .repairs
                        .extend(repairs.iter().map(|r| format!("mesh `{name}`: {r}")));
                    assets.meshes.insert(name, mesh);
                }
                Err(error) => errors.push(error),
            }
        }
        for (name, result) in textures {
            match result {
                Ok((texture, repairs)) => {
                    assets
                        .repairs
                        .extend(repairs.iter().map(|r| format!("texture `{name}`: {r}")));
                    assets.textures.insert(name, texture);
                }
                Err(error) => errors.push(error),
            }
        }
        match environment {
            Some(Ok((image, repairs))) => {
                assets
                    .repairs
                    .extend(repairs.iter().map(|r| format!("world: {r}")));
                assets.environment = Some(image);
            }
            Some(Err(error)) => errors.push(error),
            None => {}
        }
        // Of an image that several textures share, once.
        errors.dedup();
        if errors.is_empty() {
            Ok(assets)
        } else {
            Err(ResolveError { problems: errors })
        }
    }
}

fn lookup(texture: &description::Texture) -> Lookup {
    Lookup {
        color_space: texture.color_space,
        interpolation: texture.interpolation,
        extension: texture.extension,
        alpha: texture.alpha,
        transform: match texture.placing {
            Placing::Parts {
                scale,
                rotation,
                offset,
            } => UvTransform::from_parts(scale, rotation, offset),
            Placing::Matrix(rows) => UvTransform::from_rows(rows),
        },
    }
}

fn add_tangents(mesh: &mut Mesh, path: &Path, budget: &Budget) -> Result<(), String> {
    // The algorithm's own, for each corner, by measurement.
    const BYTES_PER_CORNER: u64 = 100;
    let bytes = 3 * BYTES_PER_CORNER * mesh.triangles.len() as u64;
    budget
        .take(bytes, format!("the tangents of {}", path.display()))
        .map_err(|e| e.to_string())?;
    mesh.add_tangents();
    Ok(())
}

/// What objects reach.
#[derive(Default)]
struct Used {
    /// By name.
    meshes: BTreeMap<String, UsedMesh>,
}

/// What materials look at of a mesh.
#[derive(Clone, Copy, Debug, Default)]
struct UsedMesh {
    uvs: bool,
    tangents: bool,
}

impl Used {
    fn by(description: &Description, materials: &mut Materials<'_>) -> Self {
        let mut used = Self::default();
        for object in &description.objects {
            let mut mesh = UsedMesh::default();
            for name in materials_of(object, materials) {
                // What is wrong with it is told when an object turns out to have it.
                if let Some(Ok(compiled)) = materials.get(&name) {
                    mesh.uvs |= compiled.needs.uvs;
                    mesh.tangents |= compiled.needs.tangents;
                }
            }
            let known = used.meshes.entry(object.mesh.clone()).or_default();
            known.uvs |= mesh.uvs;
            known.tangents |= mesh.tangents;
        }
        used
    }

    /// What each mesh is kept under.
    fn keys(&self, description: &Description, stage: &Stage) -> BTreeMap<String, String> {
        let places = stage.places(description);
        let meshes = self.meshes.iter().filter_map(|(name, used)| {
            let file = &description.meshes.get(name)?.file;
            let content = format!("{name:?} {file:?} {used:?}");
            let place = places.get(name.as_str()).and_then(Option::as_ref);
            Some((name.clone(), Stage::key(&content, place)))
        });
        meshes.collect()
    }
}

/// The materials an object may turn out to have. Slots are known only once the
/// mesh is read, so an object that takes them from there may have any.
fn materials_of(object: &Object, materials: &Materials<'_>) -> Vec<String> {
    match &object.materials {
        Assignment::All(name) => vec![name.clone()],
        Assignment::BySlot(slots) => slots.values().cloned().collect(),
        Assignment::FromMesh => materials.names().map(str::to_owned).collect(),
    }
}

//! Files that a description names, read in parallel, all errors together.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rayon::prelude::*;

use super::attributes::Attributes;
use super::compile::{Materials, Needs};
use super::error::ResolveError;
use super::stage::Stage;
use crate::description::{self, Assignment, Description, ImageTexture, Object, Placing, World};
use crate::memory::Budget;
use crate::mesh::{Mesh, Repair, Wanted};
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
                let described = description.meshes.get(name)?;
                let path = description.resolve_path(&described.file);
                let wanted = Wanted {
                    uvs: used.uvs,
                    normals: true,
                    colors: false,
                };
                // A mesh takes about as much as its text.
                let length = std::fs::metadata(&path).map_or(0, |file| file.len());
                let loaded = budget
                    .take(length, format!("the mesh {}", path.display()))
                    .map_err(|e| e.to_string())
                    .and_then(|()| Mesh::load(&path, wanted).map_err(|e| e.to_string()));
                let loaded = loaded.and_then(|(mut mesh, mut repairs)| {
                    let add = |mesh: &mut Mesh| used.add(mesh, described, description, budget);
                    repairs.extend(add(&mut mesh)?);
                    Ok((mesh, repairs))
                });
                Some((name.clone(), loaded))
            })
            .collect();
        let images = Images::new(budget);
        let attributes = materials.attributes();
        let textures: Vec<_> = materials
            .textures()
            .par_iter()
            .filter(|name| !stage.has_texture(name))
            .filter_map(|name| {
                let texture = description.textures.get(name)?.image()?;
                let path = description.resolve_path(&texture.file);
                let loaded = images.texture(&path, lookup(texture, attributes));
                let loaded =
                    loaded
                        .map_err(|e| e.to_string())
                        .and_then(|(mut texture, repairs)| {
                            if materials.is_filtered(name) {
                                average_slopes(&mut texture, &path, budget)?;
                            }
                            Ok((texture, repairs))
                        });
                Some((name.clone(), loaded))
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

fn lookup(texture: &ImageTexture, attributes: &Attributes) -> Lookup {
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
        uv_map: attributes.uv_map(texture.uv_map.as_deref()),
    }
}

fn average_slopes(texture: &mut Texture, path: &Path, budget: &Budget) -> Result<(), String> {
    const BYTES_PER_PIXEL: u64 = 36;
    let [width, height] = texture.size().map(|side| side as u64);
    let what = format!("the slopes of {}", path.display());
    let taken = budget.take(BYTES_PER_PIXEL * width * height, what);
    taken.map_err(|error| error.to_string())?;
    if texture.average_slopes() {
        Ok(())
    } else {
        Err(format!(
            "{}: `filter: slopes` takes one image, not tiles",
            path.display()
        ))
    }
}

/// What objects reach.
#[derive(Default)]
struct Used {
    /// By name.
    meshes: BTreeMap<String, UsedMesh>,
    attributes: Attributes,
}

/// What materials look at of a mesh.
#[derive(Clone, Debug, Default)]
struct UsedMesh {
    uvs: bool,
    tangents: bool,
    /// And whether their tangents.
    uv_maps: BTreeMap<String, bool>,
    colors: BTreeSet<String>,
}

impl UsedMesh {
    fn with(&mut self, needs: &Needs) {
        self.uvs |= needs.uvs;
        self.tangents |= needs.tangents;
        for (name, tangents) in &needs.uv_maps {
            *self.uv_maps.entry(name.clone()).or_default() |= tangents;
        }
        self.colors.extend(needs.colors.iter().cloned());
    }

    /// Adds to a mesh what stands in other files, as far as the description has it, and
    /// tangents.
    fn add(
        &self,
        mesh: &mut Mesh,
        described: &description::Mesh,
        description: &Description,
        budget: &Budget,
    ) -> Result<Vec<Repair>, String> {
        // For each corner, the most that takes: Mikkelsen's algorithm, measured.
        const BYTES_PER_CORNER: u64 = 100;
        let corners = 3 * mesh.triangles.len() as u64;
        let take = |what: &str, file: &Path| {
            let what = format!("{what} of the mesh {}", file.display());
            let taken = budget.take(BYTES_PER_CORNER * corners, what);
            taken.map_err(|error| error.to_string())
        };
        let mut repairs = Vec::new();
        for name in self.uv_maps.keys() {
            if let Some(file) = described.uv_maps.get(name) {
                take("an UV map", file)?;
                let path = description.resolve_path(file);
                repairs.extend(mesh.add_uv_map(name, &path).map_err(|e| e.to_string())?);
            }
        }
        for name in &self.colors {
            if let Some(file) = described.colors.get(name) {
                take("colours", file)?;
                let path = description.resolve_path(file);
                repairs.extend(mesh.add_colors(name, &path).map_err(|e| e.to_string())?);
            }
        }
        if self.tangents {
            take("the tangents", &described.file)?;
            mesh.add_tangents();
        }
        for (name, _) in self.uv_maps.iter().filter(|(_, tangents)| **tangents) {
            take("the tangents", &described.file)?;
            mesh.add_tangents_of(name);
        }
        Ok(repairs)
    }
}

impl Used {
    fn by(description: &Description, materials: &mut Materials<'_>) -> Self {
        let mut used = Self {
            attributes: materials.attributes().clone(),
            ..Self::default()
        };
        for object in &description.objects {
            let mesh = used.meshes.entry(object.mesh.clone()).or_default();
            for name in materials_of(object, materials) {
                // What is wrong with it is told when an object turns out to have it.
                if let Some(Ok(compiled)) = materials.get(&name) {
                    mesh.with(&compiled.needs);
                }
            }
        }
        used
    }

    /// What each mesh is kept under.
    fn keys(&self, description: &Description, stage: &Stage) -> BTreeMap<String, String> {
        let places = stage.places(description);
        let meshes = self.meshes.iter().filter_map(|(name, used)| {
            let mesh = description.meshes.get(name)?;
            // The numbers of what they look at count, too.
            let content = format!("{name:?} {mesh:?} {used:?} {:?}", self.attributes);
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

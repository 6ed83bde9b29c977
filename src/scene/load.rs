//! Files that a description names, read in parallel, all errors together.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::resolve::ResolveError;
use crate::description::{
    Assignment, Color, Description, Material, MaterialRef, Object, Reflectance, Rough, Roughness,
    Scalar, Tangent, World,
};
use crate::memory::Budget;
use crate::mesh::{Mesh, Wanted};
use crate::texture::{EnvironmentImage, Images, Texture, load_environment};

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
    /// Reads what the description's objects and world need, and nothing else.
    ///
    /// # Errors
    /// Everything that could not be read, or for which the budget has no room.
    pub fn load(description: &Description, budget: &Budget) -> Result<Self, ResolveError> {
        let used = Used::by(description);
        let meshes: Vec<_> = used
            .meshes
            .par_iter()
            .filter_map(|(name, uvs)| {
                let path = description.resolve_path(&description.meshes.get(name)?.file);
                let wanted = Wanted {
                    uvs: *uvs,
                    normals: true,
                };
                Some((
                    name.clone(),
                    Mesh::load(&path, wanted).map_err(|e| e.to_string()),
                ))
            })
            .collect();
        let images = Images::new(budget);
        let textures: Vec<_> = used
            .textures
            .par_iter()
            .filter_map(|name| {
                let texture = description.textures.get(name)?;
                let path = description.resolve_path(&texture.file);
                let loaded = images.texture(
                    &path,
                    texture.color_space,
                    texture.interpolation,
                    texture.scale,
                    texture.offset,
                );
                Some((name.clone(), loaded.map_err(|e| e.to_string())))
            })
            .collect();
        let environment = match &description.world {
            Some(World::Environment { file, .. }) => {
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

/// What objects reach.
#[derive(Default)]
struct Used {
    /// Mesh names, and whether their texture coordinates are looked at.
    meshes: BTreeMap<String, bool>,
    textures: BTreeSet<String>,
}

impl Used {
    fn by(description: &Description) -> Self {
        let mut used = Self::default();
        for object in &description.objects {
            let mut visit = Visit {
                description,
                textures: BTreeSet::new(),
                uvs: false,
            };
            for material in materials_of(object, description) {
                visit.material(material);
            }
            let uvs = visit.uvs || !visit.textures.is_empty();
            used.textures.append(&mut visit.textures);
            *used.meshes.entry(object.mesh.clone()).or_default() |= uvs;
        }
        used
    }
}

/// The materials an object may turn out to have. Slots are known only once the
/// mesh is read, so an object that takes them from there may have any.
fn materials_of<'a>(object: &'a Object, description: &'a Description) -> Vec<&'a Material> {
    match &object.materials {
        Assignment::All(name) => description.materials.get(name).into_iter().collect(),
        Assignment::BySlot(slots) => slots
            .values()
            .filter_map(|name| description.materials.get(name))
            .collect(),
        Assignment::FromMesh => description.materials.values().collect(),
    }
}

struct Visit<'a> {
    description: &'a Description,
    textures: BTreeSet<String>,
    uvs: bool,
}

impl Visit<'_> {
    fn material(&mut self, material: &Material) {
        match material {
            Material::Conductor(conductor) => {
                self.rough(&conductor.rough);
                if let Reflectance::Color(color) = &conductor.reflectance {
                    self.color(color);
                }
            }
            Material::Dielectric(glass) => {
                self.rough(&glass.rough);
                self.color(&glass.color);
            }
            Material::RoughDiffuse(matte) => {
                self.rough(&matte.rough);
                self.color(&matte.color);
            }
            Material::Diffuse(diffuse) => self.color(&diffuse.color),
            Material::Emission(emission) => self.color(&emission.color),
            Material::Transparent(_) => {}
            Material::Mix(mix) => {
                self.scalar(&mix.factor);
                for child in [&mix.a, &mix.b] {
                    match child {
                        MaterialRef::Inline(material) => self.material(material),
                        MaterialRef::Name(name) => {
                            if let Some(material) = self.description.materials.get(name) {
                                self.material(material);
                            }
                        }
                    }
                }
            }
        }
    }

    fn rough(&mut self, rough: &Rough) {
        self.scalar(&rough.rotation);
        let isotropic = match &rough.roughness {
            Roughness::Alpha(alpha) => {
                self.scalar(alpha);
                true
            }
            Roughness::AlphaXy { x, y } => {
                self.scalar(x);
                self.scalar(y);
                x == y
            }
            Roughness::Blender {
                roughness,
                anisotropy,
            } => {
                self.scalar(roughness);
                self.scalar(anisotropy);
                *anisotropy == Scalar::Value(0.0)
            }
        };
        self.uvs |= !isotropic && rough.tangent == Tangent::Uv;
    }

    fn scalar(&mut self, scalar: &Scalar) {
        if let Scalar::Texture { name, .. } = scalar {
            self.textures.insert(name.clone());
        }
    }

    fn color(&mut self, color: &Color) {
        if let Color::Texture(name) = color {
            self.textures.insert(name.clone());
        }
    }
}

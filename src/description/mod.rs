//! What a scene file says, before anything is looked up or converted.
//!
//! Names are still strings, angles still degrees and powers still watts; the
//! format itself is described in `docs/scene-format.md`.

mod camera;
mod light;
mod material;
mod settings;
mod transform;
mod value;

pub use camera::{
    Aperture, Camera, DepthOfField, Opening, Orthographic, Perspective, Projection, SensorFit,
};
pub use light::{AreaShape, Light, LightKind};
pub use material::{
    Axis, Conductor, Dielectric, Diffuse, Distribution, Emission, Material, MaterialRef, Metal,
    Mix, Reflectance, Rough, RoughDiffuse, Roughness, Scattering, Tangent, Transparent,
};
pub use settings::{Aov, Estimator, Film, Filter, LightUnits, Sampling, World};
pub use transform::Transform;
pub use value::{Channel, Color, Scalar};

use crate::texture::{ColorSpace, Interpolation};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A whole scene file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// The version of the format; 1 is the only one so far.
    #[serde(rename = "smithwalk")]
    pub version: u32,
    /// How the watts of lights become radiance.
    #[serde(default)]
    pub light_units: LightUnits,
    /// The camera; only rendering needs one.
    pub camera: Option<Camera>,
    /// The image.
    #[serde(default)]
    pub film: Film,
    /// How many paths, how long, and by which estimator.
    #[serde(default)]
    pub sampling: Sampling,
    /// What surrounds the scene; black when absent.
    pub world: Option<World>,
    /// Image textures by name.
    #[serde(default)]
    pub textures: BTreeMap<String, Texture>,
    /// Materials by name.
    #[serde(default)]
    pub materials: BTreeMap<String, Material>,
    /// Meshes by name.
    #[serde(default)]
    pub meshes: BTreeMap<String, Mesh>,
    /// Instances of meshes.
    #[serde(default)]
    pub objects: Vec<Object>,
    /// Lights other than emissive meshes.
    #[serde(default)]
    pub lights: Vec<Light>,
    /// The directory that the file's relative paths start from.
    #[serde(skip)]
    pub directory: PathBuf,
}

impl Description {
    /// The path of a file that the description names.
    pub fn resolve_path(&self, file: &Path) -> PathBuf {
        self.directory.join(file)
    }
}

/// An image and how it is looked up.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Texture {
    /// The image file, relative to the scene file.
    pub file: PathBuf,
    /// How stored values become linear ones.
    #[serde(default)]
    pub color_space: ColorSpace,
    /// What happens between pixel centres.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// The factors that multiply u and v.
    #[serde(default = "value::ones")]
    pub scale: [f32; 2],
    /// What is then added to u and v.
    #[serde(default)]
    pub offset: [f32; 2],
}

/// A mesh file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// The Wavefront OBJ file, relative to the scene file.
    pub file: PathBuf,
}

/// One instance of a mesh.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawObject")]
pub struct Object {
    /// A name for messages.
    pub name: Option<String>,
    /// The name of the mesh.
    pub mesh: String,
    /// Which faces get which material.
    pub materials: Assignment,
    /// From the mesh's space to the world's.
    pub transform: Transform,
    /// Whether camera rays see the object.
    pub visible_to_camera: bool,
}

/// Which faces of an object get which material.
#[derive(Clone, Debug, PartialEq)]
pub enum Assignment {
    /// All faces have the material of this name.
    All(String),
    /// From the OBJ's `usemtl` name to the name of a material.
    BySlot(BTreeMap<String, String>),
    /// The OBJ's `usemtl` names are names of materials.
    FromMesh,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawObject {
    name: Option<String>,
    mesh: String,
    material: Option<String>,
    materials: Option<BTreeMap<String, String>>,
    #[serde(default)]
    transform: Transform,
    #[serde(default = "value::yes")]
    visible_to_camera: bool,
}

impl TryFrom<RawObject> for Object {
    type Error = value::Clash;

    fn try_from(raw: RawObject) -> Result<Self, value::Clash> {
        let materials = match (raw.material, raw.materials) {
            (Some(_), Some(_)) => return Err(value::Clash::between("material", "materials")),
            (Some(name), None) => Assignment::All(name),
            (None, Some(by_slot)) => Assignment::BySlot(by_slot),
            (None, None) => Assignment::FromMesh,
        };
        Ok(Self {
            name: raw.name,
            mesh: raw.mesh,
            materials,
            transform: raw.transform,
            visible_to_camera: raw.visible_to_camera,
        })
    }
}

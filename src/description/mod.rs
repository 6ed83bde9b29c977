//! What a scene file says, before anything is looked up or converted.
//!
//! Names are still strings, angles still degrees and powers still watts; the
//! format itself is described in `docs/scene-format.md`.

mod animation;
mod camera;
mod conductor;
mod document;
mod factor;
mod filled;
mod layered;
mod light;
mod material;
mod mixes;
mod node;
mod openpbr;
mod overrides;
mod principled;
mod problem;
mod read;
mod relief;
mod rough;
mod settings;
mod texture;
mod transform;
mod tree;
mod validate;
mod value;

pub use crate::texture::{Alpha, Channel, ColorSpace, Extension, Interpolation};
pub use animation::{Animation, Changes, Frame};
pub use camera::{
    Aperture, Camera, DepthOfField, Opening, Orthographic, Perspective, Projection, SensorFit,
};
pub use conductor::{Conductor, Metal, Reflectance, ThinFilm};
pub use factor::Factor;
pub use filled::{Filled, Interior};
pub(crate) use layered::fits;
pub use layered::{Interface, Layered, Slab};
pub use light::{AreaShape, Light, LightKind};
pub use material::{
    Colored, Dielectric, Diffuse, Emission, Material, MaterialRef, Mix, RoughDiffuse, Sheen, Sum,
    Translucent, Velvet,
};
pub use openpbr::OpenPbr;
pub use principled::{Layering, Principled, Principled3, Principled4, Sockets, Version};
pub use problem::{Problem, Problems};
pub use relief::{Bump, NormalFilter, NormalMap, NormalSpace, Relief};
pub use rough::{Axis, Distribution, Rough, Roughness, Scattering, Tangent};
pub use settings::{Estimator, Film, Filter, LightUnits, Sampling, ViewTransform, World};
pub use texture::{ImageTexture, Placing, Texture};
pub use transform::Transform;
pub use value::{Color, Scalar};

pub(crate) use problem::nearest;

use problem::Sources;
use tree::Node;

use crate::memory::Budget;
use crate::numbered::Numbered;
use crate::rays::{RayKind, RayKinds};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How many bytes of memory reading takes for each byte of a scene file: a million
/// objects of a mesh and a place in space, measured.
const MEMORY_PER_BYTE: u64 = 12;

/// How files begin that are given for scenes by mistake, and what to say.
const OTHER_FORMATS: [(&[u8], &str); 7] = [
    (
        b"BLENDER",
        "a Blender file: blender/export.py makes a scene of it",
    ),
    (
        b"\x28\xb5\x2f\xfd",
        "a Zstandard file, as of Blender: blender/export.py makes a scene of it",
    ),
    (b"\x1f\x8b", "a gzip file"),
    (b"PK\x03\x04", "a ZIP file"),
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xfe", "UTF-16: save it as UTF-8"),
    (b"\xfe\xff", "UTF-16: save it as UTF-8"),
];

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
    /// The files that say what is otherwise in each frame, relative to the scene file.
    pub frames: Option<Numbered>,
    /// The directory that the file's relative paths start from.
    #[serde(skip)]
    pub directory: PathBuf,
    /// Where what is looked up on meshes is first asked for, since what they lack shows
    /// when they are read: by `material NAME`, for those that look along the surface as
    /// normal maps do, `UV map NAME` and `set of colours NAME`.
    #[serde(skip)]
    pub places: BTreeMap<String, String>,
}

impl Description {
    /// Reads a scene file and replaces the values that `overrides` (dotted
    /// path, YAML) name.
    ///
    /// # Errors
    /// All that is wrong with the file and the overrides, in types, ranges
    /// and references alike; files that the scene names are not opened.
    pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Self, Problems> {
        let name = path.display().to_string();
        let text = read_text(path, &name)?;
        let mut description = Self::from_str(&text, &name, overrides)?;
        description.directory = folder_of(path);
        Ok(description)
    }

    /// As [`Description::load`], with paths relative to the working directory.
    ///
    /// # Errors
    /// As [`Description::load`]; `source_name` stands for the file's name.
    pub fn from_str(
        text: &str,
        source_name: &str,
        overrides: &[(String, String)],
    ) -> Result<Self, Problems> {
        let mut sources = Sources::default();
        let Some(mut tree) = tree_of(text, source_name, &mut sources) else {
            return Err(sources.into_problems());
        };
        for (path, value) in overrides {
            overrides::apply(&mut tree, path, value, &mut sources);
        }
        Self::from_tree(&mut tree, sources)
    }

    /// What the tree says, if nothing is wrong with it or was before.
    fn from_tree(tree: &mut Node, mut sources: Sources<'_>) -> Result<Self, Problems> {
        let mut description = read::read::<Self>(tree, &mut sources);
        if let Some(description) = &mut description {
            description.places = validate::description(description, tree, &mut sources);
        }
        match description {
            Some(description) if sources.count() == 0 => Ok(description),
            _ => Err(sources.into_problems()),
        }
    }

    /// The path of a file that the description names.
    pub fn resolve_path(&self, file: &Path) -> PathBuf {
        self.directory.join(file)
    }
}

/// The text of a scene file, or of one that belongs to it.
fn read_text(path: &Path, name: &str) -> Result<String, Problems> {
    let whole = |message| Problems::new(vec![Problem::of_source(name, message)]);
    let cannot_read = |error| whole(format!("the scene can't be read: {error}"));
    let mut file = crate::file::open(path).map_err(cannot_read)?;
    let length = file.metadata().map_err(cannot_read)?.len();
    Budget::of_machine()
        .take(length.saturating_mul(MEMORY_PER_BYTE), "the scene file")
        .map_err(|error| whole(error.to_string()))?;
    let mut bytes = Vec::new();
    std::io::Read::read_to_end(&mut file, &mut bytes).map_err(cannot_read)?;
    for (beginning, found) in OTHER_FORMATS {
        if bytes.starts_with(beginning) {
            return Err(whole(format!("expected a scene in YAML, found {found}")));
        }
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..valid]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count()
            + 1;
        whole(format!("expected UTF-8, found other bytes in line {line}"))
    })
}

/// Where the relative paths of a scene file start from.
fn folder_of(path: &Path) -> PathBuf {
    path.parent().map(Path::to_path_buf).unwrap_or_default()
}

/// A text without the byte order mark that some editors put before it.
fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// The tree of a scene's text; without one there is a problem.
fn tree_of<'a>(text: &'a str, name: &str, sources: &mut Sources<'a>) -> Option<Node> {
    let text = without_mark(text);
    let source = sources.add(name, text);
    let tree = document::parse(text, source, 0, sources);
    if tree.is_none() && sources.count() == 0 {
        sources.report_whole(source, "the scene is empty");
    }
    tree
}

impl Material {
    /// Reads a single material, which can name neither textures nor other
    /// materials.
    ///
    /// # Errors
    /// All that is wrong with the text.
    pub fn from_yaml(text: &str) -> Result<Self, Problems> {
        let mut sources = Sources::default();
        let source = sources.add("material", text);
        let Some(mut tree) = document::parse(text, source, 0, &mut sources) else {
            if sources.count() == 0 {
                sources.report_whole(source, "the material is empty");
            }
            return Err(sources.into_problems());
        };
        let material = read::read::<Self>(&mut tree, &mut sources);
        if let Some(material) = &material {
            validate::material(material, &tree, &mut sources);
        }
        match material {
            Some(material) if sources.count() == 0 => Ok(material),
            _ => Err(sources.into_problems()),
        }
    }
}

/// A mesh file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// The Wavefront OBJ file, relative to the scene file.
    pub file: PathBuf,
    /// OBJ files of the same faces, whose texture coordinates are UV maps by name.
    #[serde(default)]
    pub uv_maps: BTreeMap<String, PathBuf>,
    /// OBJ files of the same faces, or this one, whose vertices have colours.
    #[serde(default)]
    pub colors: BTreeMap<String, PathBuf>,
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
    /// Other rays that pass it.
    pub hidden_from: Vec<RayKind>,
    /// Whether it is a hole in the image: black, and transparent on a transparent film.
    pub holdout: bool,
}

impl Object {
    /// The rays that meet it.
    #[must_use]
    pub fn seen_by(&self) -> RayKinds {
        light::seen_by(self.visible_to_camera, &self.hidden_from)
    }
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
    #[serde(default)]
    hidden_from: Vec<RayKind>,
    #[serde(default)]
    holdout: bool,
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
            hidden_from: raw.hidden_from,
            holdout: raw.holdout,
        })
    }
}

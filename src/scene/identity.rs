//! What decides about a render's samples: canonical values of the description, the
//! contents of the files that it names, the program and the processor.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use super::load::Assets;
use crate::description::{Description, Film, ImageTexture, Object, Sampling, World};
use crate::embree;
use crate::film::Identity;
use crate::mesh::Mesh as Triangles;
use crate::texture;

/// Names what decides about the samples of a render, each with a hash or a short value.
/// Where files lie, what objects are called, the number of samples, exposure and view
/// transform of PNGs do not take part; what does by its name (meshes, materials, textures) is taken
/// as referred to.
///
/// XXH3 is fast enough for gigabytes of textures, its results are specified to stay,
/// and nobody gains by a collision. `built` says how the scene is built, where that is
/// otherwise than usual.
pub(super) fn identity(
    description: &Description,
    contents: &Contents,
    built: Option<String>,
) -> Identity {
    let Description {
        version: _,
        light_units,
        camera,
        film,
        sampling,
        world,
        textures,
        materials,
        meshes: _,
        objects,
        lights,
        frames: _,
        directory: _,
        places: _,
    } = description;
    let Film {
        width,
        height,
        filter,
        exposure: _,
        gain,
        transparent,
        view: _,
        aovs: _,
    } = film;
    let Sampling {
        spp: _,
        seed,
        max_bounces,
        roulette_start,
        branches,
        estimator,
    } = sampling;
    let mut identity = Identity::new();
    let mut add = |name: String, value: String| {
        identity.insert(name, value);
    };
    add("program".into(), env!("CARGO_PKG_VERSION").into());
    add("processor".into(), processor());
    add("camera".into(), of_value(camera));
    add("resolution".into(), format!("{width} × {height}"));
    add("filter".into(), of_value(filter));
    add("gain".into(), gain.to_string());
    add("transparent".into(), transparent.to_string());
    add("seed".into(), seed.to_string());
    add("max_bounces".into(), max_bounces.to_string());
    add("roulette_start".into(), format!("{roulette_start:?}"));
    add("branches".into(), format!("{branches:?}"));
    add("estimator".into(), format!("{estimator:?}"));
    add("light_units".into(), format!("{light_units:?}"));
    let mut surroundings = world.clone();
    if let Some(World::Environment { file, .. }) = &mut surroundings {
        *file = PathBuf::new();
    }
    add(
        "world".into(),
        of_value(&(surroundings, contents.environment)),
    );
    for (index, light) in lights.iter().enumerate() {
        add(format!("light {index}"), of_value(light));
    }
    for (name, material) in materials {
        add(format!("material `{name}`"), of_value(material));
    }
    for (index, object) in objects.iter().enumerate() {
        let object = Object {
            name: None,
            ..object.clone()
        };
        add(format!("object {index}"), of_value(&object));
    }
    for (name, mesh) in &contents.meshes {
        add(format!("mesh `{name}`"), mesh.clone());
    }
    for (name, content) in &contents.textures {
        let Some(texture) = textures.get(name) else {
            continue;
        };
        let described = texture.image().map(|image| ImageTexture {
            file: PathBuf::new(),
            ..image.clone()
        });
        add(format!("texture `{name}`"), of_value(&(described, content)));
    }
    if let Some(built) = built {
        add("frame".into(), of_value(&built));
    }
    identity
}

/// Hashes of what is in the files that a description names.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// By the names of meshes.
    pub meshes: BTreeMap<String, String>,
    /// By the names of textures; `None` where a file can't be read.
    pub textures: BTreeMap<String, Option<u128>>,
    /// The width of the world's image, and its pixels.
    pub environment: Option<(usize, u128)>,
}

impl Contents {
    pub fn of(description: &Description, assets: &Assets) -> Self {
        let meshes = assets.meshes.iter();
        let textures = assets.textures.keys().filter_map(|name| {
            let file = &description.textures.get(name)?.image()?.file;
            Some((name.clone(), of_files(&description.resolve_path(file))))
        });
        let image = assets.environment.as_ref();
        Self {
            meshes: meshes
                .map(|(name, mesh)| (name.clone(), of_value(&of_mesh(mesh))))
                .collect(),
            textures: textures.collect(),
            environment: image.map(|image| (image.width, of_floats(image.pixels.as_flattened()))),
        }
    }
}

/// Of the one file of a texture, or of its tiles with their numbers.
fn of_files(path: &Path) -> Option<u128> {
    let of_file = |path: &Path| std::fs::read(path).ok().map(|bytes| xxh3_128(&bytes));
    match &texture::files(path).ok()?[..] {
        [(None, path)] => of_file(path),
        tiles => {
            let hashes: Vec<_> = tiles.iter().map(|(n, path)| (n, of_file(path))).collect();
            Some(xxh3_128(format!("{hashes:?}").as_bytes()))
        }
    }
}

/// Of all fields; floats are written so that they come back with the same bits.
fn of_value(value: &impl std::fmt::Debug) -> String {
    format!("{:032x}", xxh3_128(format!("{value:?}").as_bytes()))
}

fn of_floats(values: &[f32]) -> u128 {
    let mut hasher = Xxh3::new();
    for chunk in values.chunks(1024) {
        let bytes: Vec<u8> = chunk.iter().flat_map(|value| value.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
    hasher.digest128()
}

fn of_mesh(mesh: &Triangles) -> impl std::fmt::Debug {
    let Triangles {
        positions,
        triangles,
        normals,
        uvs,
        // They follow from the rest.
        tangents: _,
        uv_maps,
        colors,
        material_of_triangle,
        material_names,
    } = mesh;
    let mut indices = Xxh3::new();
    for index in triangles.as_flattened() {
        indices.update(&index.to_le_bytes());
    }
    let uv_maps: Vec<_> = uv_maps
        .iter()
        .map(|(name, map)| (name.clone(), of_floats(map.uvs.as_flattened())))
        .collect();
    let colors: Vec<_> = colors
        .iter()
        .map(|(name, colors)| (name.clone(), of_floats(colors.as_flattened())))
        .collect();
    let slots = material_of_triangle.as_ref().map(|slots| {
        let bytes: Vec<u8> = slots.iter().flat_map(|slot| slot.to_le_bytes()).collect();
        xxh3_128(&bytes)
    });
    (
        of_floats(positions.as_flattened()),
        indices.digest128(),
        normals.as_ref().map(|n| of_floats(n.as_flattened())),
        uvs.as_ref().map(|uvs| of_floats(uvs.as_flattened())),
        slots,
        material_names.clone(),
        uv_maps,
        colors,
    )
}

/// What decides about the last bits: Embree's instructions, and whether this program
/// was built to multiply and add in one step.
fn processor() -> String {
    let fused = if cfg!(target_feature = "fma") {
        ", FMA"
    } else {
        ""
    };
    format!("{}{fused}", embree::instructions())
}

//! White objects in a white world, through the whole renderer.

use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};
use std::io::Write;

use anyhow::Context;
use serde_json::{Value, json};
use smithwalk::description::{Description, Estimator};
use smithwalk::film::{Aov, PixelFilter};
use smithwalk::integrator::{Control, render};
use smithwalk::memory::Budget;
use smithwalk::mesh::Mesh;
use smithwalk::scene::{Assets, Limits, RenderSettings, Resolved, Scene, assemble};
use smithwalk::texture::EnvironmentImage;

use super::table::{ALPHAS, DISTRIBUTIONS, KINDS, white};

/// What the pixels of a furnace show, mean of the channels.
pub struct Furnace {
    pub pixels: usize,
    pub mean: f64,
    /// Standard error of the mean.
    pub se: f64,
    pub least: f64,
    pub most: f64,
}

impl Furnace {
    pub fn to_json(&self) -> Value {
        json!({
            "pixels": self.pixels, "mean": self.mean, "se": self.se,
            "least": self.least, "most": self.most,
        })
    }
}

/// A white object.
pub struct Row {
    kind: &'static str,
    distribution: &'static str,
    alpha: [f32; 2],
    shape: &'static str,
    pub furnace: Furnace,
}

impl Row {
    pub fn to_json(&self) -> Value {
        json!({
            "material": self.kind, "distribution": self.distribution,
            "alpha_x": self.alpha[0], "alpha_y": self.alpha[1],
            "shape": self.shape, "mean": self.furnace.mean, "se": self.furnace.se,
            "least": self.furnace.least, "most": self.furnace.most,
        })
    }
}

/// Renders `scene` and averages the pixels that see a surface.
pub fn render_furnace(
    scene: &Scene,
    settings: RenderSettings,
    spp: u32,
    seed: u64,
) -> anyhow::Result<Furnace> {
    let settings = RenderSettings {
        filter: PixelFilter::box_filter(),
        aovs: [Aov::Depth, Aov::Variance].into_iter().collect(),
        seed,
        limits: Limits::samples(spp),
        ..settings
    };
    let mut film = settings.film();
    render(scene, &settings, &mut film, Control::default())?;
    let image = film.develop();
    let depth = image
        .layer(Aov::Depth.name())
        .and_then(|l| l.planes.first())
        .context("no depth")?;
    let variance = image.layer(Aov::Variance.name()).context("no variance")?;
    let mean_of = |values: [f32; 3]| values.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0;
    let seen: Vec<(f64, f64)> = (0..image.color.len())
        .filter(|&i| depth[i] < 1e9)
        .map(|i| {
            let channels = [0, 1, 2].map(|c| variance.planes[c][i]);
            // Channels share their paths: the mean of their variances, not its third.
            (mean_of(image.color[i]), mean_of(channels))
        })
        .collect();
    let n = seen.len().max(1) as f64;
    Ok(Furnace {
        pixels: seen.len(),
        mean: seen.iter().map(|p| p.0).sum::<f64>() / n,
        se: seen.iter().map(|p| p.1).sum::<f64>().sqrt() / n,
        least: seen.iter().map(|p| p.0).fold(f64::INFINITY, f64::min),
        most: seen.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max),
    })
}

type Shape = (&'static str, fn() -> Mesh);

/// The shapes that stand in the furnace. Smooth normals differ from the triangles' by up
/// to 18° on the coarse sphere and 4° on the fine one.
const SHAPES: [Shape; 4] = [
    ("plane", plane),
    ("flat 48x24", || sphere(48, 24, false)),
    ("smooth 64x32", || sphere(64, 32, true)),
    ("smooth 12x8", || sphere(12, 8, true)),
];

/// Every material of the table, and first those without roughness, where the
/// distribution does not matter: mirror, interface and Lambert's law.
fn materials() -> impl Iterator<Item = (&'static str, &'static str, [f32; 2])> {
    KINDS.into_iter().flat_map(|kind| {
        let rough = DISTRIBUTIONS
            .into_iter()
            .flat_map(move |normals| ALPHAS.map(|alpha| (kind, normals, alpha)));
        std::iter::once((kind, DISTRIBUTIONS[0], [0.0; 2])).chain(rough)
    })
}

/// White shapes in a world image of ones, so that light samples, evaluation and
/// their combination with walks all take part.
pub fn measure(estimator: Estimator, spp: u32, seed: u64) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (kind, distribution, alpha) in materials() {
        for (shape, mesh) in SHAPES {
            let text = format!(
                "smithwalk: 1\n\
                 camera: {{projection: {{orthographic: {{scale: 1.3}}}}, transform: {{look_at: {{from: [0, -3, 1.5], to: [0, 0, 0]}}}}}}\n\
                 film: {{width: 48, height: 48}}\n\
                 sampling: {{max_bounces: 4096, roulette_start: 4096}}\n\
                 world: {{environment: {{file: white.exr}}}}\n\
                 materials: {{white: {{{}}}}}\n\
                 meshes: {{shape: {{file: shape.obj}}}}\n\
                 objects: [{{mesh: shape, material: white}}]\n",
                white(kind, distribution, alpha)
            );
            let mut description = Description::from_str(&text, "furnace", &[])?;
            description.sampling.estimator = estimator;
            let assets = Assets {
                meshes: BTreeMap::from([("shape".to_owned(), mesh())]),
                environment: Some(EnvironmentImage {
                    width: 16,
                    height: 8,
                    pixels: vec![[1.0; 3]; 128],
                }),
                ..Assets::default()
            };
            let Resolved {
                scene, settings, ..
            } = assemble(&description, assets, &Budget::of_machine())?;
            rows.push(Row {
                kind,
                distribution,
                alpha,
                shape,
                furnace: render_furnace(&scene, settings, spp, seed)?,
            });
        }
    }
    Ok(rows)
}

/// A sphere of radius 1, with normals for each triangle or for each vertex.
fn sphere(segments: u32, rings: u32, smooth: bool) -> Mesh {
    let vertex = |ring: u32, segment: u32| {
        let (sin_t, cos_t) = (ring as f32 / rings as f32 * PI).sin_cos();
        let (sin_p, cos_p) = ((segment % segments) as f32 / segments as f32 * TAU).sin_cos();
        [sin_t * cos_p, sin_t * sin_p, cos_t]
    };
    let mut positions = Vec::new();
    let mut uvs = Vec::new();
    for ring in 0..=rings {
        for segment in 0..=segments {
            positions.push(vertex(ring, segment));
            uvs.push([
                segment as f32 / segments as f32,
                1.0 - ring as f32 / rings as f32,
            ]);
        }
    }
    let index = |ring: u32, segment: u32| ring * (segments + 1) + segment;
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let [a, b] = [index(ring, segment), index(ring, segment + 1)];
            let [c, d] = [index(ring + 1, segment + 1), index(ring + 1, segment)];
            if ring > 0 {
                triangles.push([a, d, b]);
            }
            if ring + 1 < rings {
                triangles.push([b, d, c]);
            }
        }
    }
    Mesh {
        normals: smooth.then(|| positions.clone()),
        positions,
        triangles,
        uvs: Some(uvs),
        ..Mesh::default()
    }
}

/// A square of side 4 in the plane z = 0.
fn plane() -> Mesh {
    Mesh {
        positions: vec![
            [-2.0, -2.0, 0.0],
            [2.0, -2.0, 0.0],
            [2.0, 2.0, 0.0],
            [-2.0, 2.0, 0.0],
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        uvs: Some(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        ..Mesh::default()
    }
}

pub fn write(rows: &[Row], out: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(
        out,
        "\n{:<14} {:<9} {:>5} {:>5} {:>13}   {:>22}   {:>17}",
        "material", "normals", "α_x", "α_y", "shape", "rendered", "pixels"
    )?;
    for row in rows {
        let [x, y] = row.alpha;
        let Furnace {
            mean,
            se,
            least,
            most,
            ..
        } = row.furnace;
        writeln!(
            out,
            "{:<14} {:<9} {x:>5} {y:>5} {:>13}   {mean:>10.6} ± {se:>9.6}   {least:>7.4} to {most:>6.4}",
            row.kind, row.distribution, row.shape
        )?;
    }
    Ok(())
}

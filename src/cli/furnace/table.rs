//! White materials one by one: directional albedos.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::io::Write;

use glam::Vec3;
use rand::SeedableRng;
use rayon::prelude::*;
use serde_json::{Value, json};
use smithwalk::bsdf::Bsdf;
use smithwalk::description::{Estimator, Material};
use smithwalk::scene::compile_alone;
use smithwalk_model::{Draw, Stream};

pub const KINDS: [&str; 3] = ["conductor", "dielectric", "rough_diffuse"];
pub const DISTRIBUTIONS: [&str; 2] = ["ggx", "beckmann"];
/// α along and across the tangent.
pub const ALPHAS: [[f32; 2]; 8] = [
    [0.05, 0.05],
    [0.1, 0.1],
    [0.2, 0.2],
    [0.5, 0.5],
    [1.0, 1.0],
    [0.05, 0.2],
    [0.1, 1.0],
    [1.0, 0.25],
];
const COSINES: [f32; 3] = [0.999, 0.5, 0.1];

/// A white material as a scene file has it.
pub fn white(kind: &str, distribution: &str, [x, y]: [f32; 2]) -> String {
    format!("{kind}: {{distribution: {distribution}, alpha_x: {x}, alpha_y: {y}}}")
}

/// The albedo of one material from one direction.
pub struct Row {
    kind: &'static str,
    distribution: &'static str,
    alpha: [f32; 2],
    cos: f32,
    /// Mean weight of sampled walks.
    pub sampled: f64,
    pub sampled_se: f64,
    /// The same by evaluation and sampling combined, as the renderer does it.
    pub combined: f64,
    pub combined_se: f64,
}

impl Row {
    pub fn to_json(&self) -> Value {
        json!({
            "material": self.kind, "distribution": self.distribution,
            "alpha_x": self.alpha[0], "alpha_y": self.alpha[1], "cos": self.cos,
            "sampled": self.sampled, "sampled_se": self.sampled_se,
            "combined": self.combined, "combined_se": self.combined_se,
        })
    }
}

pub fn measure(samples: u64, seed: u64) -> anyhow::Result<Vec<Row>> {
    let mut cases = Vec::new();
    for kind in KINDS {
        for distribution in DISTRIBUTIONS {
            for alpha in ALPHAS {
                cases.extend(COSINES.map(|cos| (kind, distribution, alpha, cos)));
            }
        }
    }
    cases
        .into_par_iter()
        .enumerate()
        .map(|(index, (kind, distribution, alpha, cos))| {
            let material = Material::from_yaml(&white(kind, distribution, alpha))?;
            let stream = seed.wrapping_mul(1 << 20).wrapping_add(index as u64);
            let mut rng = Stream(rand_pcg::Pcg64Mcg::seed_from_u64(stream));
            let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let bsdf = compile_alone(&material, Estimator::Auto)?.horizontal(wo);
            let (sampled, combined) = albedos(&bsdf, wo, samples, &mut rng);
            Ok(Row {
                kind,
                distribution,
                alpha,
                cos,
                sampled: sampled.0,
                sampled_se: sampled.1,
                combined: combined.0,
                combined_se: combined.1,
            })
        })
        .collect()
}

/// Mean and standard error of both estimates.
fn albedos(
    bsdf: &Bsdf,
    wo: Vec3,
    samples: u64,
    rng: &mut impl Draw<f32>,
) -> ((f64, f64), (f64, f64)) {
    let mut sampled = Sums::default();
    let mut combined = Sums::default();
    for _ in 0..samples {
        let mut both = 0.0;
        let choice = rng.draw();
        let walk = bsdf.sample(wo, choice, rng);
        if let Some(sample) = walk {
            let pdf = bsdf.pdf(wo, sample.wi);
            both += sample.weight.x * pdf / (pdf + cosine_pdf(sample.wi));
        }
        sampled.add(walk.map_or(0.0, |sample| sample.weight.x));
        let wi = cosine_direction(rng);
        let value = bsdf.eval(wo, wi, rng).total().x;
        both += value / (bsdf.pdf(wo, wi) + cosine_pdf(wi)).max(f32::MIN_POSITIVE);
        combined.add(both);
    }
    (sampled.mean(samples), combined.mean(samples))
}

/// Cosine lobes on both sides, |cosθ|/2π.
fn cosine_direction(rng: &mut impl Draw<f32>) -> Vec3 {
    let (u, v, side) = (rng.draw(), rng.draw(), rng.draw());
    let (sin, cos) = (v * TAU).sin_cos();
    let (r, z) = (u.sqrt(), (1.0 - u).sqrt());
    Vec3::new(r * cos, r * sin, if side < 0.5 { z } else { -z })
}

fn cosine_pdf(wi: Vec3) -> f32 {
    wi.z.abs() * FRAC_1_PI / 2.0
}

#[derive(Default)]
struct Sums {
    sum: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, value: f32) {
        let value = f64::from(value);
        self.sum += value;
        self.squares += value * value;
    }

    fn mean(&self, n: u64) -> (f64, f64) {
        let n = n as f64;
        let mean = self.sum / n;
        (
            mean,
            ((self.squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt(),
        )
    }
}

pub fn write(rows: &[Row], out: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(
        out,
        "{:<14} {:<9} {:>5} {:>5} {:>6}   {:>22}   {:>22}",
        "material", "normals", "α_x", "α_y", "cosθ", "walks", "walks and evaluation"
    )?;
    for row in rows {
        let [x, y] = row.alpha;
        writeln!(
            out,
            "{:<14} {:<9} {x:>5} {y:>5} {:>6}   {:>10.6} ± {:>9.6}   {:>10.6} ± {:>9.6}",
            row.kind,
            row.distribution,
            row.cos,
            row.sampled,
            row.sampled_se,
            row.combined,
            row.combined_se
        )?;
    }
    Ok(())
}

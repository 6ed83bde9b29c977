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
    /// The largest single one of the combined estimates.
    largest: f64,
    /// Fourth central moment of the combined estimates over the square of the second;
    /// normal numbers have 3.
    kurtosis: f64,
}

impl Row {
    pub fn to_json(&self) -> Value {
        json!({
            "material": self.kind, "distribution": self.distribution,
            "alpha_x": self.alpha[0], "alpha_y": self.alpha[1], "cos": self.cos,
            "sampled": self.sampled, "sampled_se": self.sampled_se,
            "combined": self.combined, "combined_se": self.combined_se,
            "largest": self.largest, "kurtosis": self.kurtosis,
        })
    }
}

pub fn measure(estimator: Estimator, samples: u64, seed: u64) -> anyhow::Result<Vec<Row>> {
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
            let bsdf = compile_alone(&material, estimator)?.horizontal(wo);
            let [sampled, combined] = albedos(&bsdf, wo, samples, &mut rng);
            let n = samples as f64;
            Ok(Row {
                kind,
                distribution,
                alpha,
                cos,
                sampled: sampled.mean(n),
                sampled_se: sampled.standard_error(n),
                combined: combined.mean(n),
                combined_se: combined.standard_error(n),
                largest: combined.largest,
                kurtosis: combined.kurtosis(n),
            })
        })
        .collect()
}

/// Both estimates: sampled, and combined.
fn albedos(bsdf: &Bsdf, wo: Vec3, samples: u64, rng: &mut impl Draw<f32>) -> [Sums; 2] {
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
    [sampled, combined]
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

/// Sums of the powers of estimates less 1, which white ones scatter about.
#[derive(Default)]
struct Sums {
    powers: [f64; 4],
    largest: f64,
}

impl Sums {
    fn add(&mut self, value: f32) {
        let value = f64::from(value);
        let mut power = 1.0;
        for sum in &mut self.powers {
            power *= value - 1.0;
            *sum += power;
        }
        self.largest = self.largest.max(value);
    }

    fn mean(&self, n: f64) -> f64 {
        1.0 + self.powers[0] / n
    }

    fn variance(&self, n: f64) -> f64 {
        let [first, second, ..] = self.powers.map(|sum| sum / n);
        (second - first * first).max(0.0)
    }

    fn standard_error(&self, n: f64) -> f64 {
        (self.variance(n) / (n - 1.0)).sqrt()
    }

    fn kurtosis(&self, n: f64) -> f64 {
        let [m, second, third, fourth] = self.powers.map(|sum| sum / n);
        let central = fourth - 4.0 * m * third + 6.0 * m * m * second - 3.0 * m.powi(4);
        central / self.variance(n).powi(2).max(f64::MIN_POSITIVE)
    }
}

pub fn write(rows: &[Row], out: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(
        out,
        "{:<14} {:<9} {:>5} {:>5} {:>6}   {:>22}   {:>22}   {:>9} {:>9}",
        "material",
        "normals",
        "α_x",
        "α_y",
        "cosθ",
        "walks",
        "walks and evaluation",
        "largest",
        "kurtosis"
    )?;
    for row in rows {
        let [x, y] = row.alpha;
        writeln!(
            out,
            "{:<14} {:<9} {x:>5} {y:>5} {:>6}   {:>10.6} ± {:>9.6}   {:>10.6} ± {:>9.6}   {:>9.2} {:>9.1}",
            row.kind,
            row.distribution,
            row.cos,
            row.sampled,
            row.sampled_se,
            row.combined,
            row.combined_se,
            row.largest,
            row.kurtosis
        )?;
    }
    Ok(())
}

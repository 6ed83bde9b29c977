//! `smithwalk bsdf albedo`.

use std::io::Write;

use glam::Vec3;
use rayon::prelude::*;
use serde_json::json;
use smithwalk::bsdf::Bsdf;
use smithwalk::description::Estimator;
use smithwalk::tables::Moments;
use smithwalk_model::Draw;

use super::{LEVEL, MOST_SAMPLES, MaterialArgs};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    material: MaterialArgs,
    /// Cosines of the viewing angle; negative ones look from inside
    #[arg(long, value_name = "C,…", value_delimiter = ',', required = true, value_parser = parse_cosine, allow_hyphen_values = true)]
    cos: Vec<f32>,
    /// Azimuth of the viewing direction from the tangent, degrees
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_parser = parse_azimuth)]
    azimuth: f32,
    /// Walks per angle
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(2..=MOST_SAMPLES))]
    samples: u64,
}

fn parse_cosine(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(c) if f64::from(c.abs()) > LEVEL && (-1.0..=1.0).contains(&c) => Ok(c),
        _ => Err(format!(
            "expected a cosine from -1 to 1, and not within {LEVEL:e} of the horizon, where materials scatter nothing"
        )),
    }
}

fn parse_azimuth(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(degrees) if degrees.is_finite() => Ok(degrees),
        _ => Err("expected a number of degrees".to_owned()),
    }
}

/// Orders beyond this are counted with the last one.
const MAX_ORDERS: usize = 1000;

/// Walks that one task does: enough to amortise its start, few enough to
/// balance.
const BATCH: u64 = 1 << 16;

/// Sums over walks from one direction.
#[derive(Clone)]
struct Albedo {
    reflected: Moments,
    transmitted: Moments,
    /// Σ weight (mean of the channels) by order, from 1.
    orders: Vec<f64>,
    facets: u64,
    walks: u64,
}

impl Albedo {
    fn measure(bsdf: &Bsdf, wo: Vec3, walks: u64, rng: &mut impl Draw<f32>) -> Self {
        let mut sums = Self {
            reflected: Moments::default(),
            transmitted: Moments::default(),
            orders: Vec::new(),
            facets: 0,
            walks,
        };
        for _ in 0..walks {
            let choice = rng.draw();
            let Some(sample) = bsdf.sample(wo, choice, rng) else {
                continue;
            };
            let same_side = sample.wi.z * wo.z > 0.0;
            let side = if same_side {
                &mut sums.reflected
            } else {
                &mut sums.transmitted
            };
            side.add(sample.weight);
            let order = (sample.order as usize).min(MAX_ORDERS);
            if sums.orders.len() < order {
                sums.orders.resize(order, 0.0);
            }
            sums.orders[order - 1] += f64::from(sample.weight.element_sum()) / 3.0;
            sums.facets += u64::from(sample.order);
        }
        sums
    }

    fn merge(mut self, other: Self) -> Self {
        self.reflected.merge(&other.reflected);
        self.transmitted.merge(&other.transmitted);
        let length = self.orders.len().max(other.orders.len());
        self.orders.resize(length, 0.0);
        for (sum, more) in self.orders.iter_mut().zip(other.orders) {
            *sum += more;
        }
        self.facets += other.facets;
        self.walks += other.walks;
        self
    }
}

/// Writes an array with an object for each cosine: reflected and transmitted
/// share `r` and `t` per channel with standard errors, `orders[k-1]` the share
/// that met k facets (mean of the channels), and `mean_order`, the mean number
/// of facets met by a walk.
pub fn run(args: &Args, out: &mut dyn Write) -> anyhow::Result<()> {
    let material = args.material.compile(Estimator::Auto)?;
    let mut rows = Vec::new();
    for (index, &cos) in args.cos.iter().enumerate() {
        let (sin_phi, cos_phi) = args.azimuth.to_radians().sin_cos();
        let c = f64::from(cos.abs());
        let sin = (1.0 - c * c).sqrt() as f32;
        let wo = Vec3::new(sin * cos_phi, sin * sin_phi, cos);
        let bsdf = material.horizontal(wo);
        let batches = args.samples.div_ceil(BATCH);
        // Collected in order before they are added, so that the sums do not
        // depend on the number of threads.
        let parts: Vec<Albedo> = (0..batches)
            .into_par_iter()
            .map(|batch| {
                let walks = BATCH.min(args.samples - batch * BATCH);
                let stream = (index as u64) << 32 | batch;
                Albedo::measure(&bsdf, wo, walks, &mut args.material.rng(stream))
            })
            .collect();
        let sums = parts
            .into_iter()
            .reduce(Albedo::merge)
            .expect("at least one batch");
        let n = sums.walks;
        let orders: Vec<f64> = sums.orders.iter().map(|sum| sum / n as f64).collect();
        rows.push(json!({
            "cos": cos,
            "r": sums.reflected.mean(n),
            "t": sums.transmitted.mean(n),
            "r_se": sums.reflected.standard_error(n),
            "t_se": sums.transmitted.standard_error(n),
            "orders": orders,
            "mean_order": sums.facets as f64 / n as f64,
            "samples": n,
        }));
    }
    writeln!(out, "{}", serde_json::Value::from(rows))?;
    Ok(())
}

//! `smithwalk bsdf sample`.

use std::io::Write;

use glam::Vec3;
use serde_json::json;
use smithwalk::description::Estimator;
use smithwalk_model::Draw;

use super::{MaterialArgs, parse_direction};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    material: MaterialArgs,
    /// Direction towards the viewer, local frame (z = normal); z < 0 is from inside
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true)]
    wo: Vec3,
    /// How many directions
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    samples: u64,
}

/// Writes one object of columns. Samples that the closure refused (rounding at
/// grazing angles) have no row: `samples` says how many were asked for.
pub fn run(args: &Args, out: &mut dyn Write) -> anyhow::Result<()> {
    let material = args.material.compile(Estimator::Auto)?;
    let bsdf = material.horizontal(args.wo);
    let wo = args.wo;
    let mut rng = args.material.rng(0);
    let mut columns: [Vec<f32>; 4] = Default::default();
    let mut weights = Vec::new();
    let mut orders = Vec::new();
    for _ in 0..args.samples {
        let choice = rng.draw();
        let Some(sample) = bsdf.sample(wo, choice, &mut rng) else {
            continue;
        };
        let wi = sample.wi;
        let pdf = bsdf.pdf(wo, wi);
        for (column, value) in columns.iter_mut().zip([wi.x, wi.y, wi.z, pdf]) {
            column.push(value);
        }
        weights.push(sample.weight.to_array());
        orders.push(sample.order);
    }
    let [wi_x, wi_y, wi_z, pdf] = columns;
    let table = json!({
        "wi_x": wi_x, "wi_y": wi_y, "wi_z": wi_z,
        "weight": weights, "order": orders, "pdf": pdf,
        "samples": args.samples,
    });
    writeln!(out, "{table}")?;
    Ok(())
}

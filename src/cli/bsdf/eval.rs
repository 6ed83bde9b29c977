//! `smithwalk bsdf eval`.

use std::io::Write;
use std::time::Instant;

use anyhow::ensure;
use glam::Vec3;
use serde_json::json;
use smithwalk::color::Rgb;
use smithwalk_model::PerOrder;

use super::super::render::EstimatorName;
use super::{MaterialArgs, Moments, parse_direction};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    material: MaterialArgs,
    /// Direction towards the viewer, local frame (z = normal); z < 0 is from inside
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true)]
    wo: Vec3,
    /// Direction towards the light
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true)]
    wi: Vec3,
    /// How many estimates to average
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(2..))]
    samples: u64,
    /// How multiple scattering is computed
    #[arg(long, default_value = "auto")]
    estimator: EstimatorName,
}

/// Writes one object: `value` is f·|cosθ_i| in sr⁻¹ per channel with its
/// standard error `se`; `orders[k-1]` the part that met k facets; `ns` the time
/// of one estimate in nanoseconds, measured without the tally of orders.
pub fn run(args: &Args, out: &mut dyn Write) -> anyhow::Result<()> {
    let material = args.material.compile(args.estimator.into())?;
    let bsdf = material.horizontal(args.wo);
    ensure!(
        bsdf.has_smooth(),
        "all of this material's light goes into single directions"
    );
    let (wo, wi) = (args.wo, args.wi);

    let mut total = Moments::default();
    let mut orders: Vec<Moments> = Vec::new();
    let mut rng = args.material.rng(0);
    for _ in 0..args.samples {
        let mut estimate = PerOrder::default();
        bsdf.eval_orders(wo, wi, &mut rng, &mut estimate);
        let values = || estimate.0.iter().map(|value| Rgb::from(value.0));
        total.add(values().sum());
        if orders.len() < estimate.0.len() {
            orders.resize(estimate.0.len(), Moments::default());
        }
        for (sum, value) in orders.iter_mut().zip(values()) {
            sum.add(value);
        }
    }
    let mut rng = args.material.rng(1);
    let start = Instant::now();
    for _ in 0..args.samples {
        std::hint::black_box(bsdf.eval(wo, wi, &mut rng));
    }
    let ns = start.elapsed().as_secs_f64() * 1e9 / args.samples as f64;

    let n = args.samples;
    let orders_se: Vec<_> = orders.iter().map(|order| order.standard_error(n)).collect();
    let orders: Vec<_> = orders.iter().map(|order| order.mean(n)).collect();
    let report = json!({
        "value": total.mean(n), "se": total.standard_error(n),
        "orders": orders, "orders_se": orders_se,
        "ns": ns, "samples": n,
    });
    writeln!(out, "{report}")?;
    Ok(())
}

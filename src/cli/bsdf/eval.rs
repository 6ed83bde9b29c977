//! `smithwalk bsdf eval`.

use std::io::Write;
use std::time::Instant;

use anyhow::ensure;
use glam::Vec3;
use serde_json::json;
use smithwalk::color::Rgb;
use smithwalk::tables::Moments;
use smithwalk_model::PerOrder;

use super::super::render::EstimatorName;
use super::tail::{HEAVY, Tail};
use super::{MOST_SAMPLES, MaterialArgs, parse_direction};

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
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(2..=MOST_SAMPLES))]
    samples: u64,
    /// How multiple scattering is computed
    #[arg(long, default_value = "auto")]
    estimator: EstimatorName,
}

/// Writes one object: `value` is f·|cosθ_i| in sr⁻¹ per channel with its
/// standard error `se`; `orders[k-1]` the part that met k facets; `ns` the time
/// of one estimate in nanoseconds, measured without the tally of orders.
/// `largest` and `orders_largest` are the largest single estimates, `tail` and
/// `orders_tail` the indices of their tails ([`Tail::index`]). Where these say
/// that a standard error is not to be trusted, a sentence goes to `log`.
pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<()> {
    let material = args.material.compile(args.estimator.into())?;
    let bsdf = material.horizontal(args.wo);
    ensure!(
        bsdf.has_smooth(),
        "all of this material's light goes into single directions"
    );
    let (wo, wi) = (args.wo, args.wi);

    let mut total = (Moments::default(), Tail::new(args.samples));
    let mut orders: Vec<(Moments, Tail)> = Vec::new();
    let mut rng = args.material.rng(0);
    for _ in 0..args.samples {
        let mut estimate = PerOrder::default();
        bsdf.eval_orders(wo, wi, &mut rng, &mut estimate);
        let values = || estimate.0.iter().map(|value| Rgb::from(value.0));
        let add = |(sum, tail): &mut (Moments, Tail), value: Rgb| {
            sum.add(value);
            tail.add(value.max_element());
        };
        add(&mut total, values().sum());
        while orders.len() < estimate.0.len() {
            orders.push((Moments::default(), Tail::new(args.samples)));
        }
        for (sum, value) in orders.iter_mut().zip(values()) {
            add(sum, value);
        }
    }
    let mut rng = args.material.rng(1);
    let start = Instant::now();
    for _ in 0..args.samples {
        std::hint::black_box(bsdf.eval(wo, wi, &mut rng));
    }
    let ns = start.elapsed().as_secs_f64() * 1e9 / args.samples as f64;

    let n = args.samples;
    let of = |f: &dyn Fn(&Moments) -> [f64; 3]| -> Vec<[f64; 3]> {
        orders.iter().map(|(order, _)| f(order)).collect()
    };
    let tails: Vec<_> = orders.iter().map(|(_, tail)| tail.index()).collect();
    let report = json!({
        "value": total.0.mean(n), "se": total.0.standard_error(n),
        "orders": of(&|order| order.mean(n)),
        "orders_se": of(&|order| order.standard_error(n)),
        "largest": total.0.largest, "tail": total.1.index(),
        "orders_largest": of(&|order| order.largest), "orders_tail": tails,
        "ns": ns, "samples": n,
    });
    writeln!(out, "{report}")?;
    if let Some(remark) = remark(&total, &orders) {
        writeln!(log, "{remark}")?;
    }
    Ok(())
}

/// The least share of the value that an order is remarked on for.
const LEAST_SHARE: f64 = 1e-4;

/// Whose standard errors are not to be trusted, in words.
fn remark(total: &(Moments, Tail), orders: &[(Moments, Tail)]) -> Option<String> {
    let whole: f64 = total.0.sum.iter().sum();
    let heavy = |(order, tail): &(Moments, Tail)| {
        order.sum.iter().sum::<f64>() > LEAST_SHARE * whole && tail.is_heavy()
    };
    let mut subjects: Vec<String> = orders
        .iter()
        .enumerate()
        .filter(|(_, order)| heavy(order))
        .map(|(k, _)| format!("order {}", k + 1))
        .collect();
    if subjects.len() > 4 {
        let more = subjects.len() - 3;
        subjects.truncate(3);
        subjects.push(format!("{more} more orders"));
    }
    if heavy(total) {
        subjects.insert(0, "the value".to_owned());
    }
    let last = subjects.pop()?;
    let subjects = if subjects.is_empty() {
        last
    } else {
        format!("{} and {last}", subjects.join(", "))
    };
    Some(format!(
        "the standard error of {subjects} is not to be trusted: a few of the estimates make most of it (tail index above {HEAVY}), and rarer ones that are larger still may not have come; --estimator auto or more samples may tell"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(estimates: impl Iterator<Item = f32>) -> (Moments, Tail) {
        let mut sums = (Moments::default(), Tail::new(1000));
        for x in estimates {
            sums.0.add(Rgb::splat(x));
            sums.1.add(x);
        }
        sums
    }

    #[test]
    fn rare_large_estimates_are_remarked_on() {
        let even = || of((0..1000).map(|_| 1.0));
        let rare = || of((0..1000).map(|i| if i % 100 == 0 { 50.0 } else { 0.0 }));
        assert_eq!(remark(&even(), &[even()]), None);
        let text = remark(&even(), &[even(), rare()]).unwrap();
        assert!(text.contains("error of order 2 is"), "{text}");
        let text = remark(&rare(), &[rare(), rare(), rare(), rare(), rare()]).unwrap();
        assert!(
            text.contains("of the value, order 1, order 2, order 3 and 2 more orders is"),
            "{text}"
        );
        // Too faint to matter.
        let faint = of((0..1000).map(|i| if i == 0 { 1e-3 } else { 0.0 }));
        assert_eq!(remark(&even(), &[even(), faint]), None);
    }
}

//! A million evaluations of a GGX metal, all orders, one estimate each, on all cores:
//! what `benches/python_speed.py` holds the Python package against. Prints the seconds
//! of each repeat and the mean of the green channel.
//!
//! ```text
//! cargo run --release -p smithwalk-validation --example million -- REPEATS
//! ```

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use smithwalk_model::*;
use smithwalk_validation::{stream, uniform};

/// Pairs of directions.
const PAIRS: usize = 1_000_000;

fn main() {
    let repeats = std::env::args().nth(1).and_then(|n| n.parse().ok());
    // As of a material that is read from a file: no constant for the compiler.
    let gold = black_box(Microsurface {
        ndf: Ggx::isotropic(0.5),
        facets: Conductor {
            fresnel: ConductorFresnel::Constant(Rgb([1.0, 0.71, 0.29])),
        },
    });
    let mut rng = stream(1, 0);
    let mut direction = || {
        let cos = 0.05 + 0.95 * uniform(&mut rng);
        Vector3::spherical(cos, TAU * uniform(&mut rng))
    };
    let pairs: Vec<_> = (0..PAIRS).map(|_| (direction(), direction())).collect();
    for _ in 0..repeats.unwrap_or(1) {
        let begin = Instant::now();
        let values: Vec<Rgb<f64>> = pairs
            .par_iter()
            .enumerate()
            .map(|(pair, &(wi, wo))| {
                let mut rng = Stream(Pcg64Mcg::seed_from_u64(pair as u64));
                let mut total = Total::default();
                gold.eval(Estimator::PositionFree, wi, wo, &mut rng, &mut total);
                total.0
            })
            .collect();
        let seconds = begin.elapsed().as_secs_f64();
        let mean = values.iter().map(|v| v.0[1]).sum::<f64>() / PAIRS as f64;
        println!("{seconds:.4} s, mean {mean:.4}");
    }
}

//! Time per call of the microsurface model, in single precision, over the
//! grid material × roughness × angle; and, printed first, the mean order of a
//! walk and how the estimators compare in variance × time.
//!
//! `cargo bench --bench walk` for times, `cargo bench --bench walk -- variance`
//! for the comparison alone.

use criterion::{BenchmarkId, Criterion};
use rand::SeedableRng;
use rand_pcg::Pcg32;
use smithwalk_model::*;
use std::hint::black_box;
use std::time::{Duration, Instant};

const COSINES: [f32; 3] = [0.999, 0.5, 0.1];

fn stream(seed: u64) -> Stream<Pcg32> {
    Stream(Pcg32::seed_from_u64(seed))
}

/// What the benchmarks call on a surface of any kind.
trait Surface {
    fn sample(&self, wi: Vector3<f32>, rng: &mut Stream<Pcg32>) -> Option<Exit<f32>>;
    fn eval(
        &self,
        estimator: Estimator,
        wi: Vector3<f32>,
        wo: Vector3<f32>,
        rng: &mut Stream<Pcg32>,
    ) -> Rgb<f32>;
}

impl<N: Ndf<Scalar = f32>, I: Facets<Scalar = f32>> Surface for Microsurface<N, I> {
    fn sample(&self, wi: Vector3<f32>, rng: &mut Stream<Pcg32>) -> Option<Exit<f32>> {
        Microsurface::sample(self, wi, rng)
    }

    fn eval(
        &self,
        estimator: Estimator,
        wi: Vector3<f32>,
        wo: Vector3<f32>,
        rng: &mut Stream<Pcg32>,
    ) -> Rgb<f32> {
        let mut total = Total::default();
        Microsurface::eval(self, estimator, wi, wo, rng, &mut total);
        total.0
    }
}

/// The grid; conductors and glass are white, so that nothing cuts walks short.
fn surfaces() -> Vec<(String, bool, Box<dyn Surface>)> {
    let mut list: Vec<(String, bool, Box<dyn Surface>)> = Vec::new();
    let mirror = Conductor {
        fresnel: ConductorFresnel::Constant(Rgb::white()),
    };
    for alpha in [0.1, 0.2, 0.5, 1.0] {
        list.push((
            format!("conductor α {alpha}"),
            true,
            Box::new(Microsurface {
                ndf: Ggx::isotropic(alpha),
                facets: mirror,
            }),
        ));
    }
    let glass = Dielectric {
        eta: 1.5,
        tint: Rgb::white(),
    };
    for alpha in [0.1, 0.4, 1.0] {
        list.push((
            format!("dielectric α {alpha}"),
            false,
            Box::new(Microsurface {
                ndf: Ggx::isotropic(alpha),
                facets: glass,
            }),
        ));
    }
    let chalk = Diffuse {
        albedo: Rgb::white(),
    };
    for alpha in [0.5, 1.0] {
        list.push((
            format!("diffuse α {alpha}"),
            false,
            Box::new(Microsurface {
                ndf: Ggx::isotropic(alpha),
                facets: chalk,
            }),
        ));
    }
    for alpha in [0.2, 0.5] {
        list.push((
            format!("conductor, Beckmann α {alpha}"),
            true,
            Box::new(Microsurface {
                ndf: Beckmann::isotropic(alpha),
                facets: mirror,
            }),
        ));
    }
    list
}

fn times(criterion: &mut Criterion) {
    for (name, conductor, surface) in &surfaces() {
        let mut group = criterion.benchmark_group(name);
        for cos in COSINES {
            let wi = Vector3::spherical(cos, 0.3);
            let mut rng = stream(1);
            group.bench_function(BenchmarkId::new("sample", cos), |b| {
                b.iter(|| surface.sample(black_box(wi), &mut rng))
            });
            // Outgoing directions as walks produce them.
            let exits: Vec<_> = (0..1024)
                .filter_map(|_| surface.sample(wi, &mut rng))
                .collect();
            let estimators = [
                ("walk", Estimator::Walk),
                ("two-walk", Estimator::TwoWalk),
                ("position-free", Estimator::PositionFree),
            ];
            for (label, estimator) in estimators.into_iter().take(if *conductor { 3 } else { 2 }) {
                let mut next = 0;
                group.bench_function(BenchmarkId::new(label, cos), |b| {
                    b.iter(|| {
                        next = (next + 1) % exits.len();
                        surface.eval(estimator, black_box(wi), exits[next].direction, &mut rng)
                    })
                });
            }
        }
        group.finish();
    }
}

fn mean_orders() {
    println!("mean order of a walk at cosθ {COSINES:?}; ns per sample");
    for (name, _, surface) in &surfaces() {
        let mut rng = stream(2);
        print!("{name:32}");
        for cos in COSINES {
            let (batches, size) = (2_000, 100_u32);
            let mut orders = 0;
            let mut times: Vec<_> = (0..batches)
                .map(|_| {
                    let start = Instant::now();
                    let exits = (0..size)
                        .filter_map(|_| surface.sample(Vector3::spherical(cos, 0.3), &mut rng));
                    orders += exits.map(|exit| u64::from(exit.order)).sum::<u64>();
                    start.elapsed().as_nanos() as f64 / f64::from(size)
                })
                .collect();
            let mean = orders as f64 / (f64::from(batches) * f64::from(size));
            print!("  {mean:6.3} [{:4.0}]", median(&mut times));
        }
        println!();
    }
}

/// Mean over outgoing directions, uniform on the hemispheres that have light,
/// of the variance of one evaluation, with its standard error; and the time
/// of an evaluation, ns. Sharp lobes met by chance make the variance itself
/// hard to measure: mind the error.
fn variance(
    surface: &dyn Surface,
    estimator: Estimator,
    cos: f32,
    both_sides: bool,
) -> (f64, f64, f64) {
    let wi = Vector3::spherical(cos, 0.3);
    let mut rng = stream(3);
    let (directions, repeats) = (10_000, 100_u32);
    let (mut sum, mut sum2) = (0.0, 0.0);
    // A batch is much shorter than a slice of the scheduler: the median of
    // their times is blind to other processes on the machine.
    let mut times = Vec::with_capacity(directions);
    for i in 0..directions {
        let draw = |rng: &mut Stream<Pcg32>| -> f32 { rng.draw() };
        let z = draw(&mut rng);
        let wo = Vector3::spherical(
            if both_sides && i % 2 == 1 { -z } else { z },
            6.2831855 * draw(&mut rng),
        );
        let (mut mean, mut squares) = (0.0, 0.0);
        let start = Instant::now();
        for k in 0..repeats {
            let x = f64::from(surface.eval(estimator, wi, wo, &mut rng).0[0]);
            let delta = x - mean;
            mean += delta / f64::from(k + 1);
            squares += delta * (x - mean);
        }
        times.push(start.elapsed().as_nanos() as f64 / f64::from(repeats));
        let found = squares / f64::from(repeats - 1);
        sum += found;
        sum2 += found * found;
    }
    let n = directions as f64;
    let mean = sum / n;
    (
        mean,
        ((sum2 / n - mean * mean) / n).sqrt(),
        median(&mut times),
    )
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn efficiencies() {
    println!(
        "variance × (time + 1 µs of a traced ray), walk over estimator, hemisphere mean ± standard error; ns per evaluation in brackets"
    );
    for (name, conductor, surface) in &surfaces() {
        let both_sides = name.starts_with("dielectric");
        for cos in COSINES {
            let measure = |estimator| variance(surface.as_ref(), estimator, cos, both_sides);
            let (walk, walk_error, walk_time) = measure(Estimator::Walk);
            print!("{name:32} cosθ {cos:5}  walk [{walk_time:4.0}]");
            let estimators = [
                ("two-walk", Estimator::TwoWalk),
                ("position-free", Estimator::PositionFree),
            ];
            for (label, estimator) in estimators.into_iter().take(if *conductor { 2 } else { 1 }) {
                let (var, error, time) = measure(estimator);
                let gain = walk * (walk_time + 1e3) / (var * (time + 1e3));
                let spread = gain * (walk_error / walk).hypot(error / var);
                print!("  {label} {gain:6.2} ± {spread:.2} [{time:4.0}]");
            }
            println!();
        }
    }
}

fn main() {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    mean_orders();
    efficiencies();
    if arguments.iter().any(|a| a == "variance") {
        return;
    }
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(400))
        .sample_size(20)
        .without_plots()
        .configure_from_args();
    times(&mut criterion);
    criterion.final_summary();
}

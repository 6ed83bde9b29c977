//! The model at the edges of its domain, in both precisions: everything
//! finite and non-negative, energy kept, walks that end; and what single
//! precision costs against double.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use smithwalk::microsurface::*;

fn stream(seed: u64) -> Stream<Pcg64Mcg> {
    Stream(Pcg64Mcg::seed_from_u64(seed))
}

/// Counts draws, and replaces the first of them.
struct Metered<'a, F> {
    first: &'a [F],
    rest: Stream<Pcg64Mcg>,
    drawn: usize,
}

impl<F: Real> Draw<F> for Metered<'_, F>
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    fn draw(&mut self) -> F {
        self.drawn += 1;
        self.first
            .get(self.drawn - 1)
            .copied()
            .unwrap_or_else(|| self.rest.draw())
    }
}

/// Roughness pairs: tiny, huge, and 10⁶ : 1.
const ALPHAS: [(f64, f64); 12] = [
    (1e-8, 1e-8),
    (1e-5, 1e-5),
    (1e-3, 1e-3),
    (0.03, 0.03),
    (0.3, 0.3),
    (1.0, 1.0),
    (8.0, 8.0),
    (100.0, 100.0),
    (1e4, 1e4),
    (1e-6, 1.0),
    (1.0, 1e-6),
    (1e-3, 1e3),
];

const COSINES: [f64; 12] = [
    1.0,
    1.0 - 1e-7,
    0.99995,
    0.7,
    0.1,
    1e-3,
    1e-5,
    1e-8,
    1e-12,
    1e-29,
    1e-40,
    0.0,
];

/// A direction at exactly this cosine, also where 1 − cos² rounds to 1 or 0.
fn direction<F: Real>(cos: f64, phi: f64) -> Vector3<F> {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    Vector3::new(F::of(sin * phi.cos()), F::of(sin * phi.sin()), F::of(cos))
}

fn valid<F: Real>(value: Rgb<F>) -> bool {
    value.0.iter().all(|c| c.is_finite() && *c >= F::zero())
}

/// One surface and pair of directions through every entry point.
fn exercise<F: Real, N: Ndf<F>, I: Facets<F>>(
    what: &str,
    surface: &Microsurface<N, I>,
    wi: Vector3<F>,
    wo: Vector3<F>,
    first: &[F],
    seed: u64,
) -> usize
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    let meter = || Metered {
        first,
        rest: stream(seed),
        drawn: 0,
    };
    let mut rng = meter();
    let mut most = 0;
    let context = || format!("{what}, {wi:?} → {wo:?}, first draws {first:?}, seed {seed}");
    let exit = surface.sample(wi, &mut rng);
    most = most.max(rng.drawn);
    for exit in [exit, surface.sample_single(wi, &mut meter())]
        .into_iter()
        .flatten()
    {
        assert!(valid(exit.weight), "{}: {exit:?}", context());
        let length = exit.direction.length().as_f64();
        assert!(
            (length - 1.0).abs() < 1e-5,
            "{}: {exit:?} of length {length}",
            context()
        );
        assert!(
            exit.direction.z != F::zero() && exit.order >= 1,
            "{}: {exit:?}",
            context()
        );
        let pdf = surface.pdf(wi, exit.direction);
        assert!(
            pdf.is_finite() && (pdf > F::zero() || surface.facets.invisible().is_some()),
            "{}: {exit:?} has pdf {pdf:?}",
            context()
        );
        let pdf = surface.pdf_single(wi, exit.direction);
        assert!(
            pdf.is_finite() && pdf >= F::zero(),
            "{}: {exit:?} has pdf_single {pdf:?}",
            context()
        );
    }
    for estimator in [Estimator::Walk, Estimator::TwoWalk, Estimator::PositionFree] {
        let mut total = Total::default();
        let mut rng = meter();
        surface.eval(estimator, wi, wo, &mut rng, &mut total);
        assert!(
            valid(total.0),
            "{}: {estimator:?} gives {total:?}",
            context()
        );
        most = most.max(rng.drawn);
    }
    let single = surface.eval_single(wi, wo, &mut meter());
    assert!(valid(single), "{}: single {single:?}", context());
    most
}

/// All the facets on one distribution of normals.
fn exercise_all<F: Real, N: Ndf<F>>(
    name: &str,
    ndf: N,
    wi: Vector3<F>,
    wo: Vector3<F>,
    first: &[F],
    seed: u64,
) -> usize
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    let rgb = |v: [f64; 3]| Rgb(v.map(F::of));
    let mut most = 0;
    for fresnel in [
        ConductorFresnel::Constant(rgb([1.0, 0.5, 0.0])),
        ConductorFresnel::Complex {
            eta: rgb([1e-3, 1.0, 1e3]),
            k: rgb([1e4, 0.0, 1.0]),
        },
    ] {
        let surface = Microsurface {
            ndf,
            facets: Conductor { fresnel },
        };
        most = most.max(exercise(
            &format!("{name} {fresnel:?}"),
            &surface,
            wi,
            wo,
            first,
            seed,
        ));
    }
    for eta in [
        1e-3,
        0.5,
        1.0 - 1e-7,
        1.0 - 1e-4,
        1.0,
        1.0 + 1e-7,
        1.0 + 1e-5,
        1.5,
        1e3,
    ] {
        let surface = Microsurface {
            ndf,
            facets: Dielectric {
                eta: F::of(eta),
                tint: Rgb::white(),
            },
        };
        for wo in [wo, -wo] {
            most = most.max(exercise(
                &format!("{name} η {eta}"),
                &surface,
                wi,
                wo,
                first,
                seed,
            ));
        }
    }
    let surface = Microsurface {
        ndf,
        facets: Diffuse {
            albedo: rgb([0.9, 0.0, 0.5]),
        },
    };
    most.max(exercise(
        &format!("{name} diffuse"),
        &surface,
        wi,
        wo,
        first,
        seed,
    ))
}

/// The grid in one precision; the largest number of draws of a call.
fn grid<F: Real>(seed: u64) -> usize
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    let largest = F::one() - F::epsilon() / F::of(2.0);
    let (zero, half) = (F::zero(), F::of(0.5));
    let starts: [&[F]; 5] = [
        &[],
        &[zero; 12],
        &[largest; 12],
        &[half, zero, largest, zero, largest],
        &[zero, largest, half, largest],
    ];
    let mut most = 0;
    for (ax, ay) in ALPHAS {
        let (alpha_x, alpha_y) = (F::of(ax), F::of(ay));
        for (i, ci) in COSINES.into_iter().enumerate() {
            // Half of the pairs, each cosine as often.
            for (o, co) in COSINES.into_iter().enumerate().skip(i / 2 % 2).step_by(2) {
                let first = starts[(i + o) % starts.len()];
                let (wi, wo) = (
                    direction(ci, 0.3),
                    direction(
                        co,
                        if o % 2 == 0 {
                            0.3 + std::f64::consts::PI
                        } else {
                            1.0
                        },
                    ),
                );
                let seed = seed + (i * COSINES.len() + o) as u64;
                most = most.max(exercise_all(
                    &format!("GGX {ax} {ay}"),
                    Ggx { alpha_x, alpha_y },
                    wi,
                    wo,
                    first,
                    seed,
                ));
                most = most.max(exercise_all(
                    &format!("Beckmann {ax} {ay}"),
                    Beckmann { alpha_x, alpha_y },
                    wi,
                    wo,
                    first,
                    seed,
                ));
                if ax == 1.0 && ay == 1.0 {
                    most = most.max(exercise_all("Quadratic", Quadratic, wi, wo, first, seed));
                }
            }
        }
    }
    most
}

/// A walk gets to order n > 4096 with a chance of (4096/n)³ at most, and draws
/// five numbers a step; two walks a call. So 100 times 4096 orders have a
/// chance of 2e-6 per call that gets past 4096, of which the grid has hundreds.
const MOST_DRAWS: usize = 5 * 100 * 4096;

#[test]
fn the_grid_holds_in_single_precision() {
    let most = grid::<f32>(0);
    assert!(most < MOST_DRAWS, "{most} draws");
}

#[test]
fn the_grid_holds_in_double_precision() {
    let most = grid::<f64>(0);
    assert!(most < MOST_DRAWS, "{most} draws");
}

/// The same, 1e8 calls: `cargo test --release --test microsurface_extremes -- --ignored`.
#[test]
#[ignore = "takes an hour"]
fn the_grid_holds_for_long() {
    let calls_per_grid = 25 * 50 * 21 * 6;
    for seed in 1..=100_000_000 / calls_per_grid / 2 {
        grid::<f32>(seed * 1000);
        grid::<f64>(seed * 1000);
    }
}

/// Largest relative difference of single from double precision over a grid,
/// the inputs being the same: those that single precision can hold.
struct Worst {
    difference: f64,
    at: String,
}

impl Worst {
    fn new() -> Self {
        Self {
            difference: 0.0,
            at: String::new(),
        }
    }

    fn compare(&mut self, single: f32, double: f64, at: impl Fn() -> String) {
        // Below the normal numbers of f32 there is no relative precision.
        if double.abs() > 1e-35 && double.abs() < 1e37 {
            let difference = (f64::from(single) / double - 1.0).abs();
            if difference > self.difference || difference.is_nan() {
                self.difference = difference;
                self.at = format!("{}: {single:e} against {double:e}", at());
            }
        }
    }

    fn below(&self, what: &str, bound: f64) {
        println!("{what}: {:.1e} at {}", self.difference, self.at);
        assert!(
            self.difference < bound,
            "{what}: {:.1e} at {}",
            self.difference,
            self.at
        );
    }
}

/// The f64 vector with exactly the components of the f32 one.
fn widened(v: Vector3<f32>) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

fn precision<S: Ndf<f32>, D: Ndf<f64>>(name: &str, pairs: &[(S, D)]) {
    let (mut sigma, mut lambda, mut density, mut visible) =
        (Worst::new(), Worst::new(), Worst::new(), Worst::new());
    for (k, (single, double)) in pairs.iter().enumerate() {
        for i in 0..200 {
            for cos in [
                1.0 - 10f64.powf(-f64::from(i) / 25.0),
                10f64.powf(-f64::from(i) / 20.0),
            ] {
                let w = direction::<f32>(cos, 0.3 + f64::from(i));
                let at = || format!("pair {k}, {w:?}");
                for w in [w, -w] {
                    sigma.compare(
                        single.projected_area(w),
                        double.projected_area(widened(w)),
                        at,
                    );
                }
                if w.z > 0.0 {
                    lambda.compare(single.lambda(w), double.lambda(widened(w)), at);
                }
                // Normals as they are met.
                let u = [(f64::from(i) + 0.5) / 200.0, 0.3];
                let m = double.sample_visible(widened(w), u);
                let rounded = Vector3::new(m.x as f32, m.y as f32, m.z as f32);
                density.compare(
                    single.density(rounded),
                    double.density(widened(rounded)),
                    at,
                );
                let from_single = single.sample_visible(w, u.map(|u| u as f32));
                visible.compare(
                    1.0 + (widened(from_single)
                        - double.sample_visible(widened(w), u.map(|u| f64::from(u as f32))))
                    .length() as f32,
                    1.0,
                    at,
                );
            }
        }
    }
    sigma.below(&format!("{name} σ"), 3e-5);
    lambda.below(&format!("{name} Λ"), 3e-5);
    density.below(&format!("{name} D"), 3e-6);
    visible.below(&format!("{name} visible normal (absolute)"), 1e-5);
}

#[test]
fn single_precision_follows_double() {
    let alphas = ALPHAS.map(|(x, y)| (x as f32, y as f32));
    let widen = |(x, y): (f32, f32)| (f64::from(x), f64::from(y));
    let ggx: Vec<_> = alphas
        .iter()
        .map(|&a| {
            let (x, y) = widen(a);
            (
                Ggx {
                    alpha_x: a.0,
                    alpha_y: a.1,
                },
                Ggx {
                    alpha_x: x,
                    alpha_y: y,
                },
            )
        })
        .collect();
    precision("GGX", &ggx);
    let beckmann: Vec<_> = alphas
        .iter()
        .map(|&a| {
            let (x, y) = widen(a);
            (
                Beckmann {
                    alpha_x: a.0,
                    alpha_y: a.1,
                },
                Beckmann {
                    alpha_x: x,
                    alpha_y: y,
                },
            )
        })
        .collect();
    precision("Beckmann", &beckmann);
    precision("quadratic", &[(Quadratic, Quadratic)]);

    let mut beta = Worst::new();
    for i in 0..60 {
        for j in 0..60 {
            let (x, y) = (
                1.0 + 10f32.powf(i as f32 / 5.0 - 4.0),
                1.0 + 10f32.powf(j as f32 / 5.0 - 4.0),
            );
            let double = f64::from(x) * ln_beta(f64::from(x), f64::from(y)).exp();
            beta.compare(x * ln_beta(x, y).exp(), double, || format!("B({x}, {y})"));
        }
    }
    beta.below("x B(x, y)", 5e-5);
}

/// ∫ f |cosθ_o| dω_o over ω_o picked evenly or like single scattering, in
/// single precision: the mean and its standard error.
fn furnace<N: Ndf<f32>, I: Facets<f32>>(
    surface: &Microsurface<N, I>,
    cos: f64,
    both: bool,
    seed: u64,
) -> (f64, f64) {
    let wi = direction::<f32>(cos, 0.7);
    let mut rng = stream(seed);
    let uniform = |rng: &mut Stream<Pcg64Mcg>| -> f32 { rng.draw() };
    let even = if I::CLOSED_PHASE { 0.25 } else { 1.0 };
    let sphere = if both { 2.0 } else { 1.0 } * std::f32::consts::TAU;
    let (n, mut sum, mut squares) = (20_000, 0.0, 0.0);
    for _ in 0..n {
        let wo = if uniform(&mut rng) < even {
            let z = uniform(&mut rng);
            let z = if both && uniform(&mut rng) < 0.5 {
                -z
            } else {
                z
            };
            Some(Vector3::spherical(
                z,
                std::f32::consts::TAU * uniform(&mut rng),
            ))
        } else {
            surface
                .sample_single(wi, &mut rng)
                .map(|exit| exit.direction)
        };
        if let Some(wo) = wo {
            let density = even / sphere + (1.0 - even) * surface.pdf_single(wi, wo);
            let mut total = Total::default();
            surface.eval(Estimator::TwoWalk, wi, wo, &mut rng, &mut total);
            let x = f64::from(total.0.0[0] / density);
            sum += x;
            squares += x * x;
        }
    }
    let mean = sum / f64::from(n);
    (
        mean,
        ((squares / f64::from(n) - mean * mean) / f64::from(n - 1)).sqrt(),
    )
}

/// 4.5 standard errors over 120 configurations: a false alarm in 1200 choices
/// of seeds, were the estimates normally distributed.
#[test]
fn energy_is_kept_in_single_precision() {
    let white = ConductorFresnel::Constant(Rgb::white());
    let check = |what: String, (mean, error): (f64, f64)| {
        assert!((mean - 1.0).abs() < 4.5 * error, "{what}: {mean} ± {error}");
    };
    for alpha in [0.03, 0.2, 1.0, 4.0f32] {
        for (k, cos) in [1.0, 0.99995, 0.6, 0.1, 1e-3].into_iter().enumerate() {
            if cos < 0.1 && alpha < 0.1 {
                continue; // two sharp reflections in a row: tails too heavy for 20 000 samples
            }
            let seed = k as u64;
            let ndf = Ggx::isotropic(alpha);
            let what = |name: &str| format!("{name} α {alpha} cos {cos}");
            check(
                what("mirror"),
                furnace(
                    &Microsurface {
                        ndf,
                        facets: Conductor { fresnel: white },
                    },
                    cos,
                    false,
                    seed,
                ),
            );
            check(
                what("diffuse"),
                furnace(
                    &Microsurface {
                        ndf,
                        facets: Diffuse {
                            albedo: Rgb::white(),
                        },
                    },
                    cos,
                    false,
                    seed,
                ),
            );
            for eta in [1.5, 1.0 / 1.5, 1.05] {
                let glass = Dielectric {
                    eta,
                    tint: Rgb::white(),
                };
                check(
                    what(&format!("η {eta}")),
                    furnace(&Microsurface { ndf, facets: glass }, cos, true, seed),
                );
            }
            let ndf = Beckmann::isotropic(alpha);
            check(
                what("Beckmann mirror"),
                furnace(
                    &Microsurface {
                        ndf,
                        facets: Conductor { fresnel: white },
                    },
                    cos,
                    false,
                    seed,
                ),
            );
        }
    }
}

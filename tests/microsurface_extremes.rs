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

const COSINES: [f64; 10] = [
    1.0,
    1.0 - 1e-7,
    0.99995,
    0.7,
    0.1,
    1e-3,
    1e-5,
    1e-8,
    1e-12,
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
    let mut rng = Metered {
        first,
        rest: stream(seed),
        drawn: 0,
    };
    let context = || format!("{what}, {wi:?} → {wo:?}, first draws {first:?}, seed {seed}");
    for exit in [
        surface.sample(wi, &mut rng),
        surface.sample_single(wi, &mut rng),
    ]
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
        let mut metered = Metered {
            first,
            rest: stream(seed),
            drawn: 0,
        };
        surface.eval(estimator, wi, wo, &mut metered, &mut total);
        assert!(
            valid(total.0),
            "{}: {estimator:?} gives {total:?}",
            context()
        );
        rng.drawn += metered.drawn;
    }
    let single = surface.eval_single(wi, wo, &mut rng);
    assert!(valid(single), "{}: single {single:?}", context());
    rng.drawn
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
fn grid<F: Real>() -> usize
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
            for (o, co) in COSINES.into_iter().enumerate() {
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
                let seed = (i * COSINES.len() + o) as u64;
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

/// Four draws a step, eleven calls: roulette bounds the steps of each by
/// 2·4096 on the average, and 40 times that has a chance below 1e-12 (the
/// chance to reach order n is (4096/n)², its tail at 1.3 million 1e-5 per
/// walk that gets past 4096 at all).
const MOST_DRAWS: usize = 4 * 40 * 8192;

#[test]
fn the_grid_holds_in_single_precision() {
    let most = grid::<f32>();
    assert!(most < MOST_DRAWS, "{most} draws");
}

#[test]
fn the_grid_holds_in_double_precision() {
    let most = grid::<f64>();
    assert!(most < MOST_DRAWS, "{most} draws");
}

//! No jump where a formula changes.
//!
//! Every function is followed along its argument and halved wherever two
//! neighbours differ by more than a tolerance, down to adjacent floating-point
//! numbers: whatever jumps by more is found, wherever it is.

use super::domain::{Metered, direction, largest};
use super::findings::{Findings, Kind};
use super::means::Mean;
use smithwalk_model::*;

/// Two arguments between which `f` changes by more than `tolerance` without
/// any in between. `differ` says by how much two values do.
pub fn jump<F: Real, V: Copy>(
    nodes: impl IntoIterator<Item = F>,
    tolerance: f64,
    f: impl Fn(F) -> V,
    differ: impl Fn(V, V) -> f64,
) -> Option<(F, F)> {
    let ends: Vec<(F, V)> = nodes.into_iter().map(|x| (x, f(x))).collect();
    let mut open: Vec<_> = ends.windows(2).map(|pair| (pair[0], pair[1])).collect();
    while let Some((a, b)) = open.pop() {
        // Not a number is no small difference.
        if differ(a.1, b.1) <= tolerance {
            continue;
        }
        let x = a.0 + (b.0 - a.0) * F::of(0.5);
        if x == a.0 || x == b.0 {
            return Some((a.0, b.0));
        }
        let middle = (x, f(x));
        open.push((a, middle));
        open.push((middle, b));
    }
    None
}

/// Numbers from 10^`from` to 10^`to`, `count` to a decade.
pub fn decades<F: Real>(from: i32, to: i32, count: i32) -> impl Iterator<Item = F> {
    (from * count..=to * count).map(move |k| F::of(10f64.powf(f64::from(k) / f64::from(count))))
}

/// Relative to the larger one; numbers below the normal range are equal.
fn relative<F: Real>(a: F, b: F) -> f64 {
    let scale = a.abs().max(b.abs());
    if scale < F::min_positive_value() / F::epsilon() {
        0.0
    } else {
        ((a - b) / scale).as_f64().abs()
    }
}

fn distance<F: Real>(a: Vector3<F>, b: Vector3<F>) -> f64 {
    (a - b).length().as_f64()
}

/// What adjacent numbers may differ by: in `f32` a few times its rounding
/// errors ([`super::precision`]); in `f64` what a scan has time for.
fn tolerance<F: Real>() -> f64 {
    if F::epsilon().as_f64() > 1e-10 {
        2e-4
    } else {
        5e-5
    }
}

/// A chance that never comes true.
const NEVER: f64 = 1e-20;

/// σ, Λ and the visible normals along tanθ, from the pole to the horizon,
/// above and below. `alpha`, the larger roughness, is what rounding of a slope
/// is stretched by.
pub fn follow_normals<F: Real, N: Ndf<Scalar = F>>(
    name: &str,
    ndf: N,
    alpha: f64,
    found: &mut Findings,
) {
    let (one, zero) = (F::one(), F::zero());
    let up = |t: F| Vector3::new(t, zero, one).normalized();
    let down = |t: F| Vector3::new(t, zero, -one).normalized();
    let tangents = || decades::<F>(-12, 12, 8);
    // From below, where a ray may collide at all: Λ is that chance.
    let met = |t: &F| ndf.projected_area(down(*t)) > F::of(NEVER);
    let tolerance = tolerance::<F>();
    let coarse = tolerance + 16.0 * alpha * F::epsilon().as_f64();
    let mut expect = |what: &str, jump: Option<(F, F)>| {
        found.calls += 1;
        found.expect(jump.is_none(), Kind::Jump, || {
            format!("{name}: {what} jumps between tanθ {jump:?}")
        });
    };
    let scan = |f: &dyn Fn(F) -> F| jump(tangents(), tolerance, f, relative);
    expect("σ(ω)", scan(&|t| ndf.projected_area(up(t))));
    expect("σ(−ω)", scan(&|t| ndf.projected_area(down(t))));
    expect("Λ", scan(&|t| ndf.lambda(up(t))));
    for u in [[0.1, 0.3], [0.9, 0.8], [0.5, 0.05]] {
        let u = u.map(F::of);
        let scan = |f: &dyn Fn(F) -> Vector3<F>| jump(tangents(), coarse, f, distance);
        expect("a normal", scan(&|t| ndf.sample_visible(up(t), u)));
        let normal = |t| ndf.sample_visible(down(t), u);
        let found = jump(tangents().filter(met), coarse, normal, distance);
        expect("a normal from below", found);
        // Through the horizon.
        let heights = (-8..=8).map(|k| F::of(f64::from(k) / 1000.0));
        let level = |z: F| Vector3::new((one - z * z).sqrt(), zero, z);
        let normal = |z| ndf.sample_visible(level(z), u);
        expect(
            "a normal at the horizon",
            jump(heights, coarse, normal, distance),
        );
        // Along the random numbers.
        let w = up(F::of(1.5));
        let units = || (0..=16).map(|k| (F::of(f64::from(k) / 16.0)).min(largest()));
        let last = |v: F, k: usize| {
            let mut u = u;
            u[k] = v;
            u
        };
        for k in 0..2 {
            let normal = |v| ndf.sample_visible(w, last(v, k));
            // Quantiles of the last float before 0 and 1 lie far apart.
            let inner = units().map(|v| v.max(F::of(1e-4)).min(F::of(1.0 - 1e-4)));
            expect("a normal over u", jump(inner, coarse, normal, distance));
        }
    }
}

const ROUGHNESS: [(f64, f64); 8] = [
    (1e-8, 1e-8),
    (1e-3, 1e-3),
    (0.3, 0.3),
    (1.0, 1.0),
    (10.0, 10.0),
    (1e4, 1e4),
    (1e-6, 1.0),
    (1e3, 1e-3),
];

fn follow_all<F: Real>() -> Findings {
    let mut found = Findings::default();
    for (x, y) in ROUGHNESS {
        let (alpha_x, alpha_y) = (F::of(x), F::of(y));
        let ggx = Ggx { alpha_x, alpha_y };
        follow_normals(&format!("GGX {x} {y}"), ggx, x.max(y), &mut found);
        let beckmann = Beckmann { alpha_x, alpha_y };
        follow_normals(&format!("Beckmann {x} {y}"), beckmann, x.max(y), &mut found);
    }
    follow_normals::<F, _>("Quadratic", Quadratic::<F>::new(), 1.0, &mut found);
    found
}

#[test]
fn normals_do_not_jump_in_single_precision() {
    follow_all::<f32>().assert_clean();
}

#[test]
fn normals_do_not_jump_in_double_precision() {
    follow_all::<f64>().assert_clean();
}

/// Where the formulas of special functions change, in `f64` and in `f32`: the
/// values left and right of it. ierfc and the Mills excess change at 3 (`f32`:
/// 2), the remainder of ln Γ at 12, the Fresnel formulas at cosθ = 1/2 and at
/// η² − k² = sin²θ.
#[test]
fn special_functions_do_not_jump() {
    fn everywhere<F: Real>(tolerance: f64) {
        let finds = |what: &str, found: Option<(F, F)>| {
            assert!(found.is_none(), "{what} jumps between {found:?}");
        };
        // 1e-5 around the switch, so that the function itself hardly changes.
        let near = |x: f64| [F::of(x * (1.0 - 1e-12)), F::of(x), F::of(x * (1.0 + 1e-12))];
        let near = |x: f64| {
            if F::epsilon().as_f64() > 1e-10 {
                [-2.0, -1.0, 0.0, 1.0, 2.0]
                    .map(|k| F::of(x * (1.0 + k * 6e-8)))
                    .to_vec()
            } else {
                near(x).to_vec()
            }
        };
        for x in [2.0, 3.0] {
            finds("ierfc", jump(near(x), tolerance, F::ierfc, relative));
            let excess = F::mills_excess;
            finds("Mills excess", jump(near(x), tolerance, excess, relative));
        }
        for other in [1.0, 2.5, 11.9, 300.0, 1e6] {
            let beta = |x| ln_beta(x, F::of(other)).exp();
            // The logarithm is |ln B| ulp off, which the exponential turns
            // into a relative error.
            let slack = 1.0 + ln_beta(12.0, other).abs();
            finds(
                "B(x, y)",
                jump(near(12.0), tolerance * slack, beta, relative),
            );
            let swapped = |x| ln_beta(F::of(other), x).exp();
            let found = jump(near(12.0), tolerance * slack, swapped, relative);
            finds("B(y, x)", found);
            let sum = |x| ln_beta(F::of(6.0), x).exp();
            finds("B(6, x)", jump(near(6.0), tolerance * 10.0, sum, relative));
        }
        for eta in [1e-3, 0.7, 1.0 - 1e-7, 1.0 + 1e-4, 1.5, 1e3] {
            let reflectance = |cos| fresnel::dielectric(cos, F::of(eta)).0;
            let found = jump(near(0.5), tolerance * 20.0, reflectance, relative);
            finds(&format!("Fresnel η {eta}"), found);
        }
        // (η − k)(η + k) = sin²θ at cosθ = 0.6
        let metal = |k| fresnel::complex(F::of(0.6), F::of(1.0), k);
        let found = jump(near(0.6), tolerance * 10.0, metal, relative);
        finds("complex Fresnel", found);
    }
    everywhere::<f64>(3e-13);
    everywhere::<f32>(6e-6);
}

/// Reflectance over the whole range of angles, through total reflection, and
/// of indices, through 1.
#[test]
fn reflectances_do_not_jump() {
    // Square roots start at the critical angle: adjacent numbers are √ε apart;
    // at η = 1e-3 that is an eightieth of all angles with partial reflection.
    for (eta, tolerance) in [
        (1e-3, 0.1),
        (0.5, 1e-6),
        (0.999, 1e-4),
        (1.001, 1e-6),
        (1.5, 1e-6),
        (1e3f64, 1e-6),
    ] {
        let nodes = decades::<f64>(-12, 0, 8);
        let f = |cos: f64| fresnel::dielectric(cos.min(1.0), eta).0;
        let found = jump(nodes, tolerance, f, |a, b| (a - b).abs());
        assert!(found.is_none(), "η {eta} jumps between {found:?}");
    }
    for cos in [1.0, 0.7, 0.1, 1e-3] {
        // The reflectance at 1 ± δ is (δ/2)²: a relative scan never ends there.
        let nodes = (-200..=200).map(|k| 1.0 + f64::from(k) * 1e-9);
        let f = |eta: f64| fresnel::dielectric(cos, eta).0;
        let found = jump(nodes, 1e-4, f, |a, b| (a - b).abs());
        assert!(found.is_none(), "cos {cos} jumps between {found:?}");
        let nodes = decades::<f64>(-3, 4, 16);
        let f = |k: f64| fresnel::complex(cos, 1.2, k);
        let found = jump(nodes, 1e-5, f, |a, b| (a - b).abs());
        assert!(found.is_none(), "k at cos {cos} jumps between {found:?}");
    }
}

/// Keeps the first order alone.
#[derive(Default)]
struct First(f64);

impl Tally<f64> for First {
    fn add(&mut self, order: u32, value: Rgb<f64>) {
        if order == 1 {
            self.0 += value.0[0];
        }
    }
}

/// The first order of transmission over the first random number u, which sets
/// the depth: without a jump, also where that changes its formula (depth ln 2).
/// Its integral over u is the closed form by the Beta function.
#[test]
fn depths_do_not_jump_at_the_change_of_side() {
    for (alpha, wi, wo) in [
        (0.5, 0.8, 0.6),
        (1.0, 0.2, 0.6),
        (8.0, 0.5, 0.5),
        (1.0, 0.05, 0.3),
    ] {
        let surface = Microsurface {
            ndf: Ggx::isotropic(alpha),
            facets: Dielectric {
                eta: 1.5,
                tint: Rgb::white(),
            },
        };
        let wi = direction::<f64>(wi, 0.0);
        let wo = -direction::<f64>(wo, 0.3);
        let value = |u: f64| {
            let mut first = First::default();
            let mut rng = Metered::new(std::slice::from_ref(&u), 5);
            surface.eval(Estimator::Walk, wi, wo, &mut rng, &mut first);
            first.0
        };
        let nodes = (0..=64).map(|k| (f64::from(k) / 64.0).clamp(1e-6, 1.0 - 1e-6));
        let scale = nodes.clone().map(value).fold(0.0, f64::max);
        let found = jump(nodes, 1e-5, value, |a, b| (a - b).abs() / scale);
        assert!(found.is_none(), "α {alpha} jumps between {found:?}");
        // The substitution u = s²(3 − 2s) tames both ends.
        let n = 20_000;
        let integral: f64 = (0..n)
            .map(|k| (f64::from(k) + 0.5) / f64::from(n))
            .map(|s| value(s * s * (3.0 - 2.0 * s)) * 6.0 * s * (1.0 - s))
            .sum::<f64>()
            / f64::from(n);
        let mut unused = Metered::<f64>::new(&[], 0);
        let closed = surface.eval_single(wi, wo, &mut unused).0[0];
        let off = integral / closed - 1.0;
        assert!(off.abs() < 1e-5, "α {alpha}: {integral} against {closed}");
    }
}

/// The estimator without depths hands over to the two walks at
/// Λ(tanθ = 2) = 5, for GGX at α = √30: all agree on both sides of it.
///
/// Fifteen comparisons at 4 standard errors: a false alarm in a thousand
/// choices of seeds.
#[test]
fn steep_surfaces_agree_across_the_change_of_estimator() {
    for (k, (wi, wo)) in [(0.9, 0.7), (0.3, 0.6), (0.05, 0.4)]
        .into_iter()
        .enumerate()
    {
        let mean = |alpha: f64, estimator, seed| {
            let surface = Microsurface {
                ndf: Ggx::isotropic(alpha),
                facets: Conductor {
                    fresnel: ConductorFresnel::Constant(Rgb::splat(0.9)),
                },
            };
            let (wi, wo) = (direction::<f64>(wi, 0.0), direction::<f64>(wo, 2.0));
            let mut rng = super::domain::stream(seed);
            Mean::of((0..20_000).map(|_| {
                let mut total = Total::default();
                surface.eval(estimator, wi, wo, &mut rng, &mut total);
                total.0.0[0]
            }))
        };
        let steep = 30f64.sqrt();
        let reference = mean(steep, Estimator::Walk, 100 + k as u64);
        for (j, factor) in [1.0 - 1e-3, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.0 + 1e-3]
            .into_iter()
            .enumerate()
        {
            let other = mean(steep * factor, Estimator::PositionFree, (10 * k + j) as u64);
            let score = reference.score(other);
            assert!(
                score.abs() < 4.0,
                "{wi} → {wo}, α √30 · {factor}: {reference:?}, {other:?}"
            );
        }
    }
}

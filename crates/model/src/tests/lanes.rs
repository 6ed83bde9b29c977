//! Eight walks at a time against the scalar code in double precision.

use super::*;
use crate::lanes::{Directions, NdfLanes, erf_inv_of_twice_less_one, ierfc};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::fmt::Debug;
use wide::f32x8;

macro_rules! for_each_distribution {
    ($($check:ident)*) => {
        mod ggx {
            $(#[test] fn $check() { super::$check::<super::Ggx<f64>>(); })*
        }
        mod beckmann {
            $(#[test] fn $check() { super::$check::<super::Beckmann<f64>>(); })*
        }
    };
}

for_each_distribution! {
    pick_the_same_normals
    project_the_same_areas
    evaluate_what_the_walk_does
    evaluate_one_direction_eightfold
    leave_as_the_walk_does
    keep_the_energy
}

/// Independent numbers in every lane.
struct Eight(Stream<Pcg64Mcg>);

impl Draw<f32x8> for Eight {
    fn draw(&mut self) -> f32x8 {
        f32x8::from(std::array::from_fn::<f32, LANES, _>(|_| self.0.draw()))
    }
}

/// A distribution in double precision, with its counterpart in lanes.
trait Paired: Ndf<Scalar = f64> + Debug {
    type Single: NdfInLanes + Debug;

    /// The relative error that the first order may have.
    const PRECISION: f64;

    /// What orders above the first are held against.
    const REFERENCE: Estimator;

    fn new(alpha_x: f64, alpha_y: f64) -> Self;
    fn single(&self) -> Self::Single;
}

impl Paired for Ggx<f64> {
    type Single = Ggx<f32>;
    const PRECISION: f64 = 3e-5;
    const REFERENCE: Estimator = Estimator::Walk;

    fn new(alpha_x: f64, alpha_y: f64) -> Self {
        Self { alpha_x, alpha_y }
    }

    fn single(&self) -> Ggx<f32> {
        Ggx {
            alpha_x: self.alpha_x as f32,
            alpha_y: self.alpha_y as f32,
        }
    }
}

impl Paired for Beckmann<f64> {
    type Single = Beckmann<f32>;
    /// The exponent of e^{−x²} goes to 87, and has the error of a few numbers.
    const PRECISION: f64 = 2e-4;
    /// The walk comes upon the paths that matter so rarely, where a lobe is faint, that
    /// its own error is not to be trusted.
    const REFERENCE: Estimator = Estimator::TwoWalk;

    fn new(alpha_x: f64, alpha_y: f64) -> Self {
        Self { alpha_x, alpha_y }
    }

    fn single(&self) -> Beckmann<f32> {
        Beckmann {
            alpha_x: self.alpha_x as f32,
            alpha_y: self.alpha_y as f32,
        }
    }
}

/// Metals of every Fresnel curve, on surfaces from smooth to rough.
fn metals<N: Paired>() -> Vec<(N, ConductorFresnel<f64>)> {
    let fresnels = [
        ConductorFresnel::Constant(Rgb([1.0, 0.71, 0.29])),
        ConductorFresnel::Complex {
            eta: Rgb([0.18, 0.42, 1.37]),
            k: Rgb([3.42, 2.35, 0.5]),
        },
        ConductorFresnel::Schlick {
            f0: Rgb([0.9, 0.5, 0.04]),
        },
        ConductorFresnel::F82 {
            f0: Rgb([0.9, 0.6, 0.5]),
            f82: Rgb([0.8, 0.6, 0.9]),
        },
        ConductorFresnel::Dielectric {
            eta: 1.5,
            f0: Rgb([0.5, 0.6, 0.4]),
            f90: Rgb([1.0, 0.8, 0.9]),
        },
    ];
    let alphas = [(0.64, 0.64), (0.2, 0.2), (1.5, 1.5), (0.8, 0.2), (0.5, 0.5)];
    alphas
        .into_iter()
        .zip(fresnels)
        .map(|((alpha_x, alpha_y), fresnel)| (N::new(alpha_x, alpha_y), fresnel))
        .collect()
}

fn single(v: Vector3<f64>) -> Vector3<f32> {
    Vector3::new(v.x as f32, v.y as f32, v.z as f32)
}

/// The same metal in single precision.
fn in_single<N: Paired>(
    ndf: &N,
    fresnel: &ConductorFresnel<f64>,
) -> Microsurface<N::Single, Conductor<f32>> {
    let fresnel = fresnel.to_single();
    Microsurface {
        ndf: ndf.single(),
        facets: Conductor { fresnel },
    }
}

/// A direction for each lane: all around, from the zenith to near the horizon.
fn around() -> [Vector3<f64>; LANES] {
    std::array::from_fn(|i| Vector3::spherical(1.0 - 0.12 * i as f64, 2.4 * i as f64))
}

/// The first order to the precision of its numbers; those above it have the mean of
/// the walk, whether they are evaluated always or with a chance.
fn evaluate_what_the_walk_does<N: Paired>() {
    let cosines = [0.95, 0.5, 0.15];
    let metals = metals::<N>();
    let bound = worst_score(metals.len() * cosines.len() * LANES * 3);
    let mut worst: f64 = 0.0;
    for (k, (ndf, fresnel)) in metals.iter().enumerate() {
        let exact = Microsurface {
            ndf: *ndf,
            facets: Conductor { fresnel: *fresnel },
        };
        let lanes = in_single(ndf, fresnel);
        for (c, cos) in cosines.into_iter().enumerate() {
            let (wi, wo) = (Vector3::spherical(cos, 0.4), around());
            let chance = [[1.0; LANES], [0.4; LANES]][(k + c) % 2];
            let mut rng = Eight(stream((10 * k + c) as u64));
            let mut found = [[Mean::default(); 3]; LANES];
            for _ in 0..20_000 {
                let values = lanes.eval_lanes(single(wi), &wo.map(single), chance, &mut rng);
                for ((found, value), &wo) in found.iter_mut().zip(values).zip(&wo) {
                    let first = exact.eval_single(wi, wo, &mut rng.0);
                    for ((found, value), (first, multiple)) in found
                        .iter_mut()
                        .zip(value.single.0)
                        .zip(first.0.into_iter().zip(value.multiple.0))
                    {
                        let off = (f64::from(value) - first).abs();
                        assert!(
                            off <= N::PRECISION * first + 1e-30,
                            "{ndf:?} {cos} {wo:?}: {value} {first}"
                        );
                        found.add(multiple.into());
                    }
                }
            }
            for (lane, &wo) in wo.iter().enumerate() {
                let mut expected = [Mean::default(); 3];
                for _ in 0..100_000 {
                    let mut split = Split::default();
                    exact.eval(N::REFERENCE, wi, wo, &mut rng.0, &mut split);
                    for (expected, value) in expected.iter_mut().zip(split.multiple.0) {
                        expected.add(value);
                    }
                }
                for (found, expected) in found[lane].iter().zip(&expected) {
                    let score = found.score_against(expected).abs();
                    assert!(
                        score < bound,
                        "{ndf:?} {fresnel:?}, cos {cos} → {wo:?}: {} ± {}, scalar {} ± {}",
                        found.mean,
                        found.error(),
                        expected.mean,
                        expected.error()
                    );
                    worst = worst.max(score);
                }
            }
        }
    }
    println!("worst score {worst:.2}, bound {bound:.2}");
}

/// The mean of eight evaluations of one direction has the mean of the scalar estimator,
/// for the second order and for those above it.
fn evaluate_one_direction_eightfold<N: Paired>() {
    let metals = metals::<N>();
    let ends = [(0.95, 0.7), (0.5, 0.8), (0.5, 0.3), (0.15, 0.4)];
    let bound = worst_score(metals.len() * ends.len() * 2);
    for (k, (ndf, fresnel)) in metals.iter().enumerate() {
        let exact = Microsurface {
            ndf: *ndf,
            facets: Conductor { fresnel: *fresnel },
        };
        let lanes = in_single(ndf, fresnel);
        for (e, (cos_i, cos_o)) in ends.into_iter().enumerate() {
            let (wi, wo) = (
                Vector3::spherical(cos_i, 0.4),
                Vector3::spherical(cos_o, 3.2),
            );
            let mut rng = stream((200 + 10 * k + e) as u64);
            let mut numbers = Stream(Pcg64Mcg::seed_from_u64((300 + 10 * k + e) as u64));
            let mut means = [[Mean::default(); 2]; 2];
            let mut note = |which: usize, orders: &[f64]| {
                let second = orders.get(1).copied().unwrap_or(0.0);
                means[which][0].add(second);
                means[which][1].add(orders.iter().skip(2).sum());
            };
            for _ in 0..40_000 {
                let mut found = PerOrder::default();
                lanes.eval_multiple_in_lanes(single(wi), single(wo), &mut numbers, &mut found);
                assert_eq!(found.0.first().map_or(0.0, |first| first.0[0]), 0.0);
                note(
                    0,
                    &found.0.iter().map(|c| c.0[0].into()).collect::<Vec<_>>(),
                );
            }
            for _ in 0..200_000 {
                let mut expected = PerOrder::default();
                exact.eval(N::REFERENCE, wi, wo, &mut rng, &mut expected);
                note(1, &expected.0.iter().map(|c| c.0[0]).collect::<Vec<_>>());
            }
            for (order, (found, expected)) in means[0].iter().zip(&means[1]).enumerate() {
                let score = found.score_against(expected).abs();
                assert!(
                    score < bound,
                    "{ndf:?} {cos_i} → {cos_o}, order {}: {} ± {}, scalar {} ± {}",
                    order + 2,
                    found.mean,
                    found.error(),
                    expected.mean,
                    expected.error()
                );
            }
        }
    }
}

/// Cells of direction and order that exits are counted in.
fn cell(direction: Vector3<f64>, order: u32) -> usize {
    let ring = ((direction.z * direction.z) * 6.0).min(5.0) as usize;
    let turn = direction.y.atan2(direction.x) / std::f64::consts::TAU + 0.5;
    let sector = (turn * 8.0).min(7.0) as usize;
    (order.min(4) as usize - 1) * 48 + ring * 8 + sector
}

/// Exits fall into cells of direction and order as often as those of the scalar
/// walk, with the same mean weight; their density is the scalar one.
fn leave_as_the_walk_does<N: Paired>() {
    const WALKS: usize = 400_000;
    let cosines = [1.0, 0.6, 0.1];
    let metals = metals::<N>();
    let count = metals.len() * cosines.len();
    for (k, (ndf, fresnel)) in metals.iter().enumerate() {
        let exact = Microsurface {
            ndf: *ndf,
            facets: Conductor { fresnel: *fresnel },
        };
        let lanes = in_single(ndf, fresnel);
        for (c, cos) in cosines.into_iter().enumerate() {
            let wi = Vector3::spherical(cos, 0.4);
            let mut rng = Eight(stream((100 + 10 * k + c) as u64));
            let mut seen = [[0.0f64; 4 * 48]; 2];
            let mut weights = [[Mean::default(); 3]; 2];
            let mut note = |which: usize, direction, weight: [f64; 3], order| {
                seen[which][cell(direction, order)] += 1.0;
                for (mean, weight) in weights[which].iter_mut().zip(weight) {
                    mean.add(weight);
                }
            };
            for _ in 0..WALKS / LANES {
                for (exit, pdf) in lanes.sample_lanes(single(wi), &mut rng).iter().flatten() {
                    let d = exit.direction;
                    let direction = Vector3::new(d.x.into(), d.y.into(), d.z.into());
                    note(0, direction, exit.weight.0.map(f64::from), exit.order);
                    let expected = exact.pdf(wi, direction);
                    assert!(
                        (f64::from(*pdf) - expected).abs() < 1e-3 * expected,
                        "{ndf:?} {cos} {direction:?}: {pdf} {expected}"
                    );
                }
            }
            for _ in 0..WALKS {
                if let Some(exit) = exact.sample(wi, &mut rng.0) {
                    note(1, exit.direction, exit.weight.0, exit.order);
                }
            }
            let (mut sum, mut cells) = (0.0, 0.0);
            for (a, b) in seen[0].iter().zip(&seen[1]) {
                if a + b >= 20.0 {
                    sum += (a - b).powi(2) / (a + b);
                    cells += 1.0;
                }
            }
            let chance = 1.0 - ChiSquared::new(cells).expect("cells").cdf(sum);
            assert!(
                chance > sidak(count),
                "{ndf:?} cos {cos}: χ² {sum:.1} in {cells} cells, chance {chance:.1e}"
            );
            for (a, b) in weights[0].iter().zip(&weights[1]) {
                let score = a.score_against(b).abs();
                assert!(
                    score < worst_score(3 * count),
                    "{ndf:?} cos {cos}: weights {} and {}",
                    a.mean,
                    b.mean
                );
            }
        }
    }
}

/// White mirrors keep every walk, with its whole weight.
fn keep_the_energy<N: Paired>() {
    let white = ConductorFresnel::Constant(Rgb::white());
    for alpha in [1e-4, 0.3, 1.0, 2.0] {
        let surface = in_single(&N::new(alpha, alpha), &white);
        for cos in [1.0, 0.3, 1e-3] {
            let wi = single(Vector3::spherical(cos, 1.0));
            let mut rng = Eight(stream(7));
            for _ in 0..20_000 / LANES {
                for exit in surface.sample_lanes(wi, &mut rng) {
                    let (exit, _) = exit.expect("an exit of each walk");
                    assert_eq!(exit.weight, Rgb::white(), "α {alpha}, cos {cos}");
                }
            }
        }
    }
}

/// Directions from the zenith to the nadir, with a slope that is far from α and with
/// one that is near it.
fn all_around() -> Vec<Vector3<f64>> {
    let cosines = [1.0, 0.999_999, 0.99, 0.9, 0.6, 0.3, 0.1, 0.01, 1e-4];
    let both = cosines.into_iter().flat_map(|cos| [cos, -cos]);
    both.map(|cos| Vector3::spherical(cos, 0.7)).collect()
}

const STRETCHES: [(f64, f64); 5] = [(0.01, 0.01), (0.2, 0.2), (0.8, 0.2), (1.0, 1.0), (4.0, 4.0)];

/// A direction in all lanes, as near as single precision has it, and that one.
fn rounded(w: Vector3<f64>) -> (Directions, Vector3<f64>) {
    let w = single(w);
    let exact = Vector3::new(w.x.into(), w.y.into(), w.z.into());
    (Directions::splat(w), exact.normalized())
}

/// The same normals from the same numbers. The latter are 6e-8 apart near 1, so where
/// only few facets are above or below, more than rounding is left open.
fn pick_the_same_normals<N: Paired>() {
    let numbers = [
        1e-6, 1e-4, 0.01, 0.1, 0.25, 0.5, 0.7, 0.9, 0.97, 0.999, 0.99999f32,
    ];
    let mut worst: f64 = 0.0;
    for (alpha_x, alpha_y) in STRETCHES {
        let ndf = N::new(alpha_x, alpha_y);
        let lanes = ndf.single().in_lanes();
        for w in all_around() {
            let (w, exact) = rounded(w);
            for (u, v) in numbers.into_iter().flat_map(|u| numbers.map(|v| (u, v))) {
                let m = lanes.sample_visible(w, [u.into(), v.into()]);
                let [x, y, z] = [m.x, m.y, m.z].map(|c| f64::from(c.to_array()[3]));
                let expected = ndf.sample_visible(exact, [u.into(), v.into()]);
                let rare = u.min(1.0 - u).min(v).min(1.0 - v);
                let off = (Vector3::new(x, y, z) - expected).length() * f64::from(rare).sqrt();
                assert!(
                    off < 1e-5,
                    "{ndf:?} {exact:?} {u} {v}: {x} {y} {z}, {expected:?}: {off:e}"
                );
                worst = worst.max(off);
            }
        }
    }
    println!("worst error {worst:.1e}");
}

/// As many digits as the exponent of e^{−x²} leaves: the area below the horizon is
/// right to 1e-6 and what x² loses.
fn project_the_same_areas<N: Paired>() {
    for (alpha_x, alpha_y) in STRETCHES {
        let ndf = N::new(alpha_x, alpha_y);
        let lanes = ndf.single().in_lanes();
        for w in all_around() {
            let (w, exact) = rounded(w);
            let found = lanes
                .projected_areas(w)
                .map(|area| f64::from(area.to_array()[3]));
            for (found, expected) in found.into_iter().zip(ndf.projected_areas(exact)) {
                let off = (found - expected).abs();
                assert!(
                    off <= N::PRECISION * expected + 1e-37,
                    "{ndf:?} {exact:?}: {found:e}, {expected:e}"
                );
            }
        }
    }
}

/// ierfc and the Gaussian quantile against double precision, over all they are for.
#[test]
fn special_functions_have_their_digits() {
    let in_lanes = |f: fn(f32x8) -> f32x8, x: f64| f64::from(f((x as f32).into()).to_array()[5]);
    let (mut near, mut tail, mut quantile) = (0.0f64, 0.0f64, 0.0f64);
    for i in 0..=93_000 {
        let x = f64::from((f64::from(i) * 1e-4) as f32);
        let off = in_lanes(ierfc, x) / x.ierfc() - 1.0;
        if x <= 1.0 {
            near = near.max(off.abs());
        }
        tail = tail.max(off.abs() / (1.0 + x * x));
    }
    for i in 1..1 << 16 {
        let u = f64::from(i) / f64::from(1 << 16);
        let expected = (2.0 * u - 1.0).erf_inv();
        let off = in_lanes(erf_inv_of_twice_less_one, u) - expected;
        quantile = quantile.max(off.abs() / expected.abs().max(0.1));
    }
    println!("ierfc {near:.1e}, per 1 + x² {tail:.1e}; quantile {quantile:.1e}");
    assert!(near < 1e-6 && tail < 3e-7 && quantile < 2e-6);
    assert_eq!(in_lanes(ierfc, f64::INFINITY), 0.0);
}

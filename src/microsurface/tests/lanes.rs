//! Eight walks at a time against the scalar code in double precision.

use super::*;
use crate::microsurface::lanes::LANES;
use wide::f32x8;

/// Independent numbers in every lane.
struct Eight(Stream<Pcg64Mcg>);

impl Draw<f32x8> for Eight {
    fn draw(&mut self) -> f32x8 {
        f32x8::from(std::array::from_fn::<f32, LANES, _>(|_| self.0.draw()))
    }
}

/// Metals of every Fresnel curve, on surfaces from smooth to rough.
fn metals() -> Vec<(Ggx<f64>, ConductorFresnel<f64>)> {
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
    ];
    let alphas = [(0.64, 0.64), (0.2, 0.2), (1.5, 1.5), (0.8, 0.2)];
    alphas
        .into_iter()
        .zip(fresnels)
        .map(|((alpha_x, alpha_y), fresnel)| (Ggx { alpha_x, alpha_y }, fresnel))
        .collect()
}

fn single(v: Vector3<f64>) -> Vector3<f32> {
    Vector3::new(v.x as f32, v.y as f32, v.z as f32)
}

/// The same metal in single precision.
fn in_single(
    ndf: &Ggx<f64>,
    fresnel: &ConductorFresnel<f64>,
) -> Microsurface<Ggx<f32>, Conductor<f32>> {
    let rgb = |c: Rgb<f64>| Rgb(c.0.map(|c| c as f32));
    let fresnel = match *fresnel {
        ConductorFresnel::Constant(color) => ConductorFresnel::Constant(rgb(color)),
        ConductorFresnel::Complex { eta, k } => ConductorFresnel::Complex {
            eta: rgb(eta),
            k: rgb(k),
        },
        ConductorFresnel::Schlick { f0 } => ConductorFresnel::Schlick { f0: rgb(f0) },
        ConductorFresnel::F82 { f0, f82 } => ConductorFresnel::F82 {
            f0: rgb(f0),
            f82: rgb(f82),
        },
    };
    Microsurface {
        ndf: Ggx {
            alpha_x: ndf.alpha_x as f32,
            alpha_y: ndf.alpha_y as f32,
        },
        facets: Conductor { fresnel },
    }
}

/// A direction for each lane: all around, from the zenith to near the horizon.
fn around() -> [Vector3<f64>; LANES] {
    std::array::from_fn(|i| Vector3::spherical(1.0 - 0.12 * i as f64, 2.4 * i as f64))
}

/// The first order to the precision of its numbers; those above it have the mean of
/// the walk, whether they are evaluated always or with a chance.
#[test]
fn lanes_evaluate_what_the_walk_does() {
    let cosines = [0.95, 0.5, 0.15];
    let metals = metals();
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
                        assert!(off <= 3e-5 * first, "{ndf:?} {cos} {wo:?}: {value} {first}");
                        found.add(multiple.into());
                    }
                }
            }
            for (lane, &wo) in wo.iter().enumerate() {
                let mut expected = [Mean::default(); 3];
                for _ in 0..100_000 {
                    let mut split = Split::default();
                    exact.eval(Estimator::Walk, wi, wo, &mut rng.0, &mut split);
                    for (expected, value) in expected.iter_mut().zip(split.multiple.0) {
                        expected.add(value);
                    }
                }
                for (found, expected) in found[lane].iter().zip(&expected) {
                    let score = found.score_against(expected).abs();
                    assert!(
                        score < bound,
                        "{ndf:?} {fresnel:?}, cos {cos} → {wo:?}: {} ± {}, walk {} ± {}",
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

/// Cells of direction and order that exits are counted in.
fn cell(direction: Vector3<f64>, order: u32) -> usize {
    let ring = ((direction.z * direction.z) * 6.0).min(5.0) as usize;
    let turn = direction.y.atan2(direction.x) / std::f64::consts::TAU + 0.5;
    let sector = (turn * 8.0).min(7.0) as usize;
    (order.min(4) as usize - 1) * 48 + ring * 8 + sector
}

/// Exits fall into cells of direction and order as often as those of the scalar
/// walk, with the same mean weight; their density is the scalar one.
#[test]
fn lanes_leave_as_the_walk_does() {
    const WALKS: usize = 400_000;
    let cosines = [1.0, 0.6, 0.1];
    let metals = metals();
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
#[test]
fn lanes_keep_the_energy() {
    let white = ConductorFresnel::Constant(Rgb::white());
    for alpha in [1e-4, 0.3, 1.0, 2.0] {
        let surface = in_single(&Ggx::isotropic(alpha), &white);
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

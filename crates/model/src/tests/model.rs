//! The whole model: energy, reciprocity, orders, the closed case.

use super::*;

/// f(ω_i, ω_o) cosθ_o in the first channel, all orders.
fn estimate<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>>(
    surface: &Microsurface<N, I>,
    estimator: Estimator,
    wi: Vector3<f64>,
    wo: Vector3<f64>,
    samples: usize,
    rng: &mut Stream<Pcg64Mcg>,
) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..samples {
        let mut total = Total::default();
        surface.eval(estimator, wi, wo, rng, &mut total);
        mean.add(total.0.0[0]);
    }
    mean
}

/// A direction out of a mixture of the uniform one and the proxy density, and
/// its density.
fn pick_direction<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>>(
    surface: &Microsurface<N, I>,
    wi: Vector3<f64>,
    rng: &mut Stream<Pcg64Mcg>,
) -> Option<(Vector3<f64>, f64)> {
    let even = if I::CLOSED_PHASE { 0.25 } else { 1.0 };
    let wo = if uniform(rng) < even {
        let z = uniform(rng);
        let below = I::TRANSMITS && uniform(rng) < 0.5;
        Vector3::spherical(
            if below { -z } else { z },
            std::f64::consts::TAU * uniform(rng),
        )
    } else {
        surface.sample_single(wi, rng)?.direction
    };
    let sphere = if I::TRANSMITS { 2.0 } else { 1.0 } * std::f64::consts::TAU;
    Some((
        wo,
        even / sphere + (1.0 - even) * surface.pdf_single(wi, wo),
    ))
}

/// Statement 6, white furnace: ∫ f cosθ_o dω_o = 1.
fn furnace<I: Facets<Scalar = f64>>(name: &str, facets: I, estimator: Estimator, cases: &[Case]) {
    let cosines = [1.0, 0.7, 0.2, 0.02];
    let bound = worst_score(cases.len() * cosines.len());
    let mut rng = stream(11);
    for &case in cases {
        for cos in cosines {
            let surface = Microsurface { ndf: case, facets };
            let wi = Vector3::spherical(cos, 0.7);
            let mut mean = Mean::default();
            for _ in 0..20_000 {
                let mut value = 0.0;
                if let Some((wo, density)) = pick_direction(&surface, wi, &mut rng) {
                    let mut total = Total::default();
                    surface.eval(estimator, wi, wo, &mut rng, &mut total);
                    value = total.0.0[0] / density;
                }
                mean.add(value);
            }
            let score = mean.score(1.0);
            assert!(
                score.abs() < bound,
                "{name}, {}, cos {cos}: {} ± {} (score {score:.1})",
                case.name(),
                mean.mean,
                mean.error()
            );
        }
    }
}

#[test]
fn walks_keep_the_energy() {
    let cases = Case::wide();
    furnace("mirror", mirror(1.0), Estimator::Walk, &cases);
    furnace("glass", glass(1.5), Estimator::Walk, &cases);
    furnace(
        "glass from inside",
        glass(1.0 / 1.5),
        Estimator::Walk,
        &cases,
    );
    furnace("diffuse", chalk(), Estimator::Walk, &cases);
}

/// Statement 12: the quadratic distribution's mirror in closed form, all
/// orders and first.
fn closed_form(estimator: Estimator, pairs: usize, samples: usize) {
    let surface = Microsurface {
        ndf: Quadratic::new(),
        facets: mirror(1.0),
    };
    let bound = worst_score(pairs);
    let mut rng = stream(12);
    for _ in 0..pairs {
        let mut direction = || {
            Vector3::spherical(
                0.02 + 0.98 * uniform(&mut rng),
                std::f64::consts::TAU * uniform(&mut rng),
            )
        };
        let (wi, wo) = (direction(), direction());
        let mean = estimate(&surface, estimator, wi, wo, samples, &mut rng);
        let score = mean.score(Quadratic::mirror_all_orders(wi, wo));
        assert!(score.abs() < bound, "{wi:?} {wo:?}: score {score:.1}");
        let first = surface.eval_single(wi, wo, &mut rng).0[0];
        assert!((first / Quadratic::mirror_first_order(wi, wo) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_walk_meets_the_closed_form() {
    closed_form(Estimator::Walk, 60, 40_000);
}

/// Statement 12 to a relative standard error of 3e-4, at 500 pairs.
#[test]
#[ignore = "takes an hour"]
fn two_walks_meet_the_closed_form_to_three_digits() {
    let surface = Microsurface {
        ndf: Quadratic::new(),
        facets: mirror(1.0),
    };
    let pairs = 500;
    let bound = worst_score(pairs);
    for estimator in [Estimator::PositionFree, Estimator::TwoWalk, Estimator::Walk] {
        let mut rng = stream(500);
        let (mut worst, mut chi2) = (0.0f64, 0.0);
        for _ in 0..pairs {
            let mut direction = || {
                Vector3::spherical(
                    0.02 + 0.98 * uniform(&mut rng),
                    std::f64::consts::TAU * uniform(&mut rng),
                )
            };
            let (wi, wo) = (direction(), direction());
            let mut mean = estimate(&surface, estimator, wi, wo, 100_000, &mut rng);
            // The number of samples must not depend on the estimates but by
            // their spread, of which the first batch tells.
            let relative = mean.error() / mean.mean;
            let batches = (relative / 2.7e-4).powi(2).ceil() as usize;
            mean = estimate(&surface, estimator, wi, wo, 100_000 * batches, &mut rng);
            let score = mean.score(Quadratic::mirror_all_orders(wi, wo));
            assert!(
                score.abs() < bound,
                "{estimator:?} {wi:?} {wo:?}: score {score:.1}"
            );
            worst = worst.max(score.abs());
            chi2 += score * score;
        }
        println!(
            "{estimator:?}: worst |z| {worst:.2}, bound {bound:.2}, χ²/n {:.3}",
            chi2 / pairs as f64
        );
    }
}

#[test]
fn two_walks_meet_the_closed_form() {
    closed_form(Estimator::TwoWalk, 60, 40_000);
    closed_form(Estimator::PositionFree, 60, 40_000);
}

/// Order by order the other estimators have the walk's mean.
fn estimators_agree<I: Facets<Scalar = f64>>(name: &str, facets: I, estimator: Estimator) {
    const ORDERS: usize = 4;
    let mut pairs = vec![(0.9, 0.3), (0.3, 0.9), (0.15, 0.5), (0.6, 0.6)];
    if I::TRANSMITS {
        pairs.extend([(0.9, -0.3), (0.3, -0.9), (0.7, -0.7)]);
    }
    let cases = Case::wide();
    let bound = worst_score(cases.len() * pairs.len() * ORDERS);
    let mut rng = stream(21);
    for case in cases {
        let surface = Microsurface { ndf: case, facets };
        for &(a, b) in &pairs {
            let (wi, wo) = (Vector3::spherical(a, 0.2), Vector3::spherical(b, 2.5));
            let mut run = |estimator| {
                let mut orders = [Mean::default(); ORDERS];
                for _ in 0..10_000 {
                    let mut found = PerOrder::default();
                    surface.eval(estimator, wi, wo, &mut rng, &mut found);
                    // The last one takes all the orders above it.
                    for (k, order) in orders.iter_mut().enumerate() {
                        let part = found.0.iter().skip(k).take(if k + 1 == ORDERS {
                            usize::MAX
                        } else {
                            1
                        });
                        order.add(part.map(|v| v.0[1]).sum());
                    }
                }
                orders
            };
            let (walk, other) = (run(Estimator::Walk), run(estimator));
            for (k, (a, b)) in walk.iter().zip(&other).enumerate() {
                // Less than this is what a few of the walks add up to, far
                // from normally distributed.
                if a.mean.max(b.mean) > 3e-3 {
                    let score = a.score_against(b);
                    assert!(
                        score.abs() < bound,
                        "{name} {} {wi:?} {wo:?} order {}: {} ± {}, {} ± {} ({score:.1})",
                        case.name(),
                        k + 1,
                        a.mean,
                        a.error(),
                        b.mean,
                        b.error()
                    );
                }
            }
        }
    }
}

#[test]
fn two_walks_have_the_mean_of_the_walk() {
    let gold = ConductorFresnel::Complex {
        eta: Rgb([0.14, 0.37, 1.44]),
        k: Rgb([4.0, 2.4, 1.6]),
    };
    let gold = Conductor { fresnel: gold };
    let tinted = Dielectric {
        eta: 1.5,
        tint: Rgb([1.0, 0.8, 0.5]),
    };
    let chalk = Diffuse {
        albedo: Rgb([1.0, 0.9, 0.3]),
    };
    estimators_agree("gold", gold, Estimator::TwoWalk);
    estimators_agree("gold, position-free", gold, Estimator::PositionFree);
    estimators_agree("glass", tinted, Estimator::TwoWalk);
    estimators_agree("glass from inside", tinted.inverted(), Estimator::TwoWalk);
    estimators_agree("diffuse", chalk, Estimator::TwoWalk);
}

#[test]
fn two_walks_keep_the_energy() {
    let cases = Case::all();
    furnace("mirror", mirror(1.0), Estimator::TwoWalk, &cases);
    furnace(
        "mirror, position-free",
        mirror(1.0),
        Estimator::PositionFree,
        &cases,
    );
    furnace("glass", glass(1.5), Estimator::TwoWalk, &cases);
    furnace(
        "glass from inside",
        glass(1.0 / 1.5),
        Estimator::TwoWalk,
        &cases,
    );
    furnace("diffuse", chalk(), Estimator::TwoWalk, &cases);
}

/// Statement 7: f(ω_i, ω_o) n_i² = f(ω_o, ω_i) n_o².
#[test]
fn walks_are_reciprocal() {
    let pairs = [(0.9, 0.3), (0.2, 0.6), (0.5, 0.3)];
    let cases = Case::wide();
    let bound = worst_score(cases.len() * pairs.len() * 4);
    let mut rng = stream(7);
    for case in cases {
        for (a, b) in pairs {
            let (wi, wo) = (Vector3::spherical(a, 0.2), Vector3::spherical(b, 2.5));
            let check = |name: &str, there: Mean, back: Mean, n2: f64| {
                let scaled = Mean {
                    mean: back.mean * n2 * wo.z / wi.z,
                    squares: back.squares * (n2 * wo.z / wi.z).powi(2),
                    ..back
                };
                let score = there.score_against(&scaled);
                assert!(
                    score.abs() < bound,
                    "{name}, {}, {a} → {b}: {} {} (score {score:.1})",
                    case.name(),
                    there.mean,
                    scaled.mean
                );
            };
            let n = 10_000;
            let walk = Estimator::Walk;
            let surface = Microsurface {
                ndf: case,
                facets: mirror(1.0),
            };
            check(
                "mirror",
                estimate(&surface, walk, wi, wo, n, &mut rng),
                estimate(&surface, walk, wo, wi, n, &mut rng),
                1.0,
            );
            let surface = Microsurface {
                ndf: case,
                facets: chalk(),
            };
            check(
                "diffuse",
                estimate(&surface, walk, wi, wo, n, &mut rng),
                estimate(&surface, walk, wo, wi, n, &mut rng),
                1.0,
            );
            let eta = 1.5;
            let surface = Microsurface {
                ndf: case,
                facets: glass(eta),
            };
            let inverse = Microsurface {
                ndf: case,
                facets: glass(eta).inverted(),
            };
            check(
                "reflection",
                estimate(&surface, walk, wi, wo, n, &mut rng),
                estimate(&surface, walk, wo, wi, n, &mut rng),
                1.0,
            );
            let there = estimate(&surface, walk, wi, -wo, n, &mut rng);
            let back = estimate(&inverse, walk, wo, -wi, n, &mut rng);
            check("transmission", there, back, eta * eta);
        }
    }
}

/// Statements 3 and 8: order 1 of a walk is the closed single scattering,
/// connected (eval) and as it leaves (sample).
fn single_scattering<I: Facets<Scalar = f64>>(name: &str, facets: I) {
    let cosines = [0.95, 0.4, 0.08];
    let cases = Case::all();
    let bound = worst_score(cases.len() * cosines.len() * 2);
    let mut rng = stream(8);
    for case in cases {
        for cos in cosines {
            let surface = Microsurface { ndf: case, facets };
            let wi = Vector3::spherical(cos, 0.4);
            let wo = Vector3::spherical(if I::TRANSMITS { -0.7 } else { 0.7 }, 2.9);
            let (mut connected, mut closed) = (Mean::default(), Mean::default());
            let (mut left, mut weighted) = (Mean::default(), Mean::default());
            for _ in 0..20_000 {
                let mut split = Split::default();
                surface.eval(Estimator::Walk, wi, wo, &mut rng, &mut split);
                connected.add(split.single.0[0]);
                closed.add(surface.eval_single(wi, wo, &mut rng).0[0]);
                left.add(
                    surface
                        .sample(wi, &mut rng)
                        .map_or(0.0, |e| f64::from(u8::from(e.order == 1))),
                );
                weighted.add(
                    surface
                        .sample_single(wi, &mut rng)
                        .map_or(0.0, |e| e.weight.0[0]),
                );
            }
            let score = connected.score_against(&closed);
            let silent = connected.mean == 0.0 && closed.mean == 0.0;
            assert!(
                silent || score.abs() < bound,
                "{name} {} cos {cos}: {} {} ({score:.1})",
                case.name(),
                connected.mean,
                closed.mean
            );
            let score = left.score_against(&weighted);
            assert!(
                score.abs() < bound,
                "{name} {} cos {cos}: leaves {} {} ({score:.1})",
                case.name(),
                left.mean,
                weighted.mean
            );
        }
    }
}

#[test]
fn first_order_is_single_scattering() {
    single_scattering("mirror", mirror(1.0));
    single_scattering("glass", glass(1.5));
    single_scattering("glass from inside", glass(1.0 / 1.5));
    single_scattering("diffuse", chalk());
}

/// What leaves in a solid angle is the integral of what is evaluated there,
/// order by order: eval against sample.
fn exits_follow_the_evaluation<I: Facets<Scalar = f64>>(name: &str, facets: I) {
    let cases = Case::wide();
    let zones = [(-1.0, -0.5), (-0.5, 0.0), (0.0, 0.4), (0.4, 1.0)];
    let bound = worst_score(cases.len() * zones.len() * 2);
    let mut rng = stream(9);
    for case in cases {
        let surface = Microsurface { ndf: case, facets };
        let wi = Vector3::spherical(0.35, 0.4);
        let mut exits = [[Mean::default(); 2]; 4];
        let mut values = [[Mean::default(); 2]; 4];
        for _ in 0..30_000 {
            let exit = surface.sample(wi, &mut rng);
            let mut split = Split::default();
            let (mut z, mut density) = (0.0, 1.0);
            if let Some((wo, p)) = pick_direction(&surface, wi, &mut rng) {
                surface.eval(Estimator::Walk, wi, wo, &mut rng, &mut split);
                (z, density) = (wo.z, p);
            }
            for (k, &(from, to)) in zones.iter().enumerate() {
                let inside = |z: f64| z >= from && z < to;
                for multiple in [false, true] {
                    let left = exit.filter(|e| inside(e.direction.z) && (e.order > 1) == multiple);
                    exits[k][usize::from(multiple)].add(left.map_or(0.0, |e| e.weight.0[0]));
                    let value = if multiple {
                        split.multiple
                    } else {
                        split.single
                    }
                    .0[0];
                    values[k][usize::from(multiple)].add(if inside(z) {
                        value / density
                    } else {
                        0.0
                    });
                }
            }
        }
        for (k, zone) in zones.iter().enumerate() {
            for multiple in 0..2 {
                let (exit, value) = (&exits[k][multiple], &values[k][multiple]);
                if exit.mean.max(value.mean) > 1e-3 {
                    let score = exit.score_against(value);
                    assert!(
                        score.abs() < bound,
                        "{name} {} zone {zone:?} {multiple}: {} {} ({score:.1})",
                        case.name(),
                        exit.mean,
                        value.mean
                    );
                }
            }
        }
    }
}

#[test]
fn sampling_and_evaluation_agree() {
    exits_follow_the_evaluation("mirror", mirror(1.0));
    exits_follow_the_evaluation("glass", glass(1.5));
    exits_follow_the_evaluation("glass from inside", glass(1.0 / 1.5));
    exits_follow_the_evaluation("diffuse", chalk());
}

/// The proxy density integrates to 1 over the directions that light leaves in.
#[test]
fn the_proxy_density_is_normalised() {
    for case in Case::wide() {
        for cos in [1.0, 0.5, 0.05] {
            let wi = Vector3::spherical(cos, 0.7);
            let check = |name: &str, total: f64| {
                assert!(
                    (total - 1.0).abs() < 4e-3,
                    "{name} {} cos {cos}: {total}",
                    case.name()
                )
            };
            let surface = Microsurface {
                ndf: case,
                facets: mirror(1.0),
            };
            check("mirror", over_sphere(160, 0.0, 1.0, |o| surface.pdf(wi, o)));
            let surface = Microsurface {
                ndf: case,
                facets: glass(1.5),
            };
            check(
                "glass",
                over_sphere(200, 0.0, 1.0, |o| surface.pdf(wi, o))
                    + over_sphere(200, -1.0, 0.0, |o| surface.pdf(wi, o)),
            );
            let surface = Microsurface {
                ndf: case,
                facets: chalk(),
            };
            check("diffuse", over_sphere(40, 0.0, 1.0, |o| surface.pdf(wi, o)));
        }
    }
}

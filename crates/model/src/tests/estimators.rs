//! The estimators against each other, and the proxy density.

use super::*;

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

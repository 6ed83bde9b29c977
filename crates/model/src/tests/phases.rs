//! Phase functions: statements 4 and 5, and that scattering samples them.

use super::*;

/// Where light comes from: above and below the horizon.
fn origins() -> [Vector3<f64>; 5] {
    [0.9, 0.4, 0.05, -0.3, -0.8].map(|cos| Vector3::spherical(cos, 1.0 + cos))
}

fn at(case: Case, side: Side, w: Vector3<f64>) -> At<f64> {
    At {
        side,
        w,
        sigma: case.projected_area(w),
    }
}

#[test]
fn phase_functions_integrate_to_one() {
    let up = Vector3::new(0.0, 0.0, 1.0);
    // A mirror reflects nothing into z < −w_z: the normal would point down.
    for case in Case::wide() {
        // Where hardly a normal is seen, those few make a peak too narrow for
        // the quadrature.
        for w in origins()
            .into_iter()
            .filter(|&w| case.projected_area(w) > 1e-3)
        {
            let total = over_sphere(200, -w.z, 1.0, |o| {
                mirror(1.0)
                    .phase(&case, at(case, Side::Above, w), o, false, up)
                    .density
            });
            assert!(
                (total - 1.0).abs() < 2e-3,
                "mirror, {} {w:?}: {total}",
                case.name()
            );
        }
    }
}

/// Statement 5: σ(−ω_i) p(ω_i, ω_o) = σ(−ω_o) p(ω_o, ω_i), and with n² where
/// the light changes sides.
#[test]
fn phase_functions_are_reciprocal() {
    let mut rng = stream(5);
    let up = Vector3::new(0.0, 0.0, 1.0);
    for case in Case::all() {
        for _ in 0..500 {
            let mut direction =
                || Vector3::spherical(2.0 * uniform(&mut rng) - 1.0, 7.0 * uniform(&mut rng));
            let (w, o) = (direction(), direction());
            let eta = 1.6;
            // Far down a Gaussian, the exponent takes the digits.
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (a.abs() + b.abs()) + 1e-30;
            let (there, back) = (at(case, Side::Above, w), at(case, Side::Above, o));
            for (name, a, b) in [
                (
                    "mirror",
                    mirror(1.0).phase(&case, there, o, false, up),
                    mirror(1.0).phase(&case, back, w, false, up),
                ),
                (
                    "reflection",
                    glass(eta).phase(&case, there, o, false, up),
                    glass(eta).phase(&case, back, w, false, up),
                ),
            ] {
                assert!(
                    close(there.sigma * a.density, back.sigma * b.density),
                    "{name} {} {w:?} {o:?}",
                    case.name()
                );
            }
            let below = at(case, Side::Below, -o);
            let there_t = glass(eta).phase(&case, there, o, true, up).density * there.sigma;
            let back_t = glass(eta).phase(&case, below, -w, true, up).density * below.sigma;
            assert!(
                close(there_t, back_t * eta * eta),
                "transmission {} {w:?} {o:?}: {there_t} {back_t}",
                case.name()
            );
        }
    }
}

/// The share of sampled directions in each cell of the sphere, reflected and
/// transmitted, against the phase function integrated over uniform directions.
#[test]
fn scattering_samples_the_phase_function() {
    const CELLS: usize = 4;
    const SAMPLES: usize = 60_000;
    let cell = |o: Vector3<f64>, crosses: bool| {
        let i = (0.5 * (o.z + 1.0) * CELLS as f64) as usize;
        let j = (o.y.atan2(o.x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU
            * CELLS as f64) as usize;
        (usize::from(crosses) * CELLS + i.min(CELLS - 1)) * CELLS + j.min(CELLS - 1)
    };
    let configurations = [(1.5, Side::Above), (1.5, Side::Below), (0.8, Side::Above)];
    let cases = Case::wide();
    let bound =
        worst_score(cases.len() * origins().len() * configurations.len() * 2 * CELLS * CELLS);
    let mut rng = stream(6);
    for case in cases {
        for w in origins() {
            for (eta, side) in configurations {
                let facets = glass(eta);
                let at = at(case, side, w);
                let mut sampled = [Mean::default(); 2 * CELLS * CELLS];
                let mut integrated = sampled;
                for _ in 0..SAMPLES {
                    let m = case.sample_visible(w, [rng.draw(), rng.draw()]);
                    let bounce = facets.scatter(side, w, m, &mut rng);
                    let o = Vector3::spherical(
                        2.0 * uniform(&mut rng) - 1.0,
                        std::f64::consts::TAU * uniform(&mut rng),
                    );
                    let value = |crosses| {
                        4.0 * std::f64::consts::PI * facets.phase(&case, at, o, crosses, o).density
                    };
                    let (reflected, transmitted) = (value(false), value(true));
                    for k in 0..2 * CELLS * CELLS {
                        sampled[k].add(f64::from(u8::from(
                            k == cell(bounce.direction, bounce.crosses),
                        )));
                        integrated[k].add(if k == cell(o, false) {
                            reflected
                        } else if k == cell(o, true) {
                            transmitted
                        } else {
                            0.0
                        });
                    }
                }
                for (k, (a, b)) in sampled.iter().zip(&integrated).enumerate() {
                    // Fewer than some hundred hits are not normally distributed.
                    if a.mean.max(b.mean) > 5e-3 {
                        let score = a.score_against(b);
                        assert!(
                            score.abs() < bound,
                            "η {eta} {side:?} {} {w:?} cell {k}: {} {} ({score:.1})",
                            case.name(),
                            a.mean,
                            b.mean
                        );
                    }
                }
            }
        }
    }
}

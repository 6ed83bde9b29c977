//! Stacks whose light is known in closed form.

use super::*;

/// F̄_e, the mean of F(θ) over a cosine lobe from outside, by quadrature.
fn mean_reflectance(eta: f64) -> f64 {
    let terms = gauss(64).into_iter();
    terms
        .map(|(cos, weight)| 2.0 * cos * weight * fresnel::dielectric(cos, eta).0)
        .sum()
}

/// F̄_i = 1 − (1 − F̄_e)/η², that from inside.
fn mean_internal(eta: f64) -> f64 {
    1.0 - (1.0 - mean_reflectance(eta)) / (eta * eta)
}

/// f(ω_i, ω_o) cosθ_o of a smooth interface over Lambert, without what the
/// interface mirrors: both transmittances, and the light between the two as a
/// geometric series.
fn coated_lambert(eta: f64, rho: f64, wi: Vector3<f64>, wo: Vector3<f64>) -> f64 {
    let through = |cos| 1.0 - fresnel::dielectric(cos, eta).0;
    let inside = rho / (1.0 - rho * mean_internal(eta));
    wo.z * through(wi.z) * through(wo.z) * inside / (std::f64::consts::PI * eta * eta)
}

#[test]
fn mean_reflectances_of_water_and_glass() {
    assert!((mean_reflectance(1.5) - 0.0918).abs() < 1e-4);
    assert!((mean_internal(1.5) - 0.5963).abs() < 1e-4);
}

/// What leaves a smooth interface over Lambert:
/// F + (1 − F)(1 − F̄_i) ρ/(1 − ρ F̄_i).
fn coated_albedo(eta: f64, rho: f64, cos: f64) -> f64 {
    let f = fresnel::dielectric(cos, eta).0;
    let inside = mean_internal(eta);
    f + (1.0 - f) * (1.0 - inside) * rho / (1.0 - rho * inside)
}

#[test]
fn a_smooth_coat_over_lambert_meets_the_closed_form() {
    let cases = [(1.5, 0.8), (1.2, 0.5), (2.5, 0.95), (1.5, 1.0), (1.05, 0.7)];
    let bound = worst_score(cases.len() * 12);
    let mut rng = stream(41);
    for (eta, rho) in cases {
        let stack = stack(&[(eta, 0.0)], lambert(rho));
        for cos in [0.95, 0.5, 0.1] {
            let wi = Vector3::spherical(cos, 0.3);
            let expected = coated_albedo(eta, rho, cos);
            let mean = albedo(&stack, wi, 60_000, &mut rng);
            assert!(
                mean.score(expected).abs() < bound,
                "η {eta}, ρ {rho}, cos {cos}: {} ± {} against {expected}",
                mean.mean,
                mean.error()
            );
            for out in [0.9, 0.4, 0.05] {
                let wo = Vector3::spherical(out, 2.0);
                let expected = coated_lambert(eta, rho, wi, wo);
                let mean = estimate(&stack, wi, wo, 10_000, &mut rng);
                assert!(
                    mean.score(expected).abs() < bound,
                    "η {eta}, ρ {rho}, cos {cos} to {out}: {} ± {} against {expected}",
                    mean.mean,
                    mean.error()
                );
            }
        }
    }
}

/// The same to a standard error of 1e-4 in the albedo, sampled and integrated
/// from evaluation, and of 2e-4 in relative terms in f: `cargo test --release -p
/// smithwalk-model to_four_digits -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes"]
fn a_smooth_coat_over_lambert_meets_the_closed_form_to_four_digits() {
    let cases = [(1.5, 0.8), (1.5, 0.2), (1.3, 0.5)];
    let bound = worst_score(cases.len() * 2 * 4);
    let mut rng = stream(42);
    let check = |what: &str, mean: Mean, expected: f64| {
        let score = mean.score(expected);
        let error = mean.error();
        println!(
            "{what}: {:.6} ± {error:.6}, exact {expected:.6} ({score:+.2})",
            mean.mean
        );
        assert!(score.abs() < bound, "{what}");
    };
    for (eta, rho) in cases {
        let stack = stack(&[(eta, 0.0)], lambert(rho));
        for cos in [0.9, 0.3] {
            let what = format!("n {eta}, ρ {rho}, cos {cos}");
            let wi = Vector3::spherical(cos, 0.3);
            let expected = coated_albedo(eta, rho, cos);
            let mut sampled = Mean::default();
            let mut integrated = Mean::default();
            let mut first = true;
            while first || sampled.error().max(integrated.error()) > 1e-4 {
                first = false;
                for _ in 0..10_000 {
                    let exit = stack.sample(wi, &mut rng);
                    sampled.add(exit.map_or(0.0, |exit| exit.weight.0[0]));
                    let wo = Vector3::spherical(
                        uniform(&mut rng).sqrt(),
                        std::f64::consts::TAU * uniform(&mut rng),
                    );
                    let mut total = Total::default();
                    stack.eval(wi, wo, &mut rng, &mut total);
                    integrated.add(total.0.0[0] * std::f64::consts::PI / wo.z);
                }
            }
            check(&format!("{what}, sampled"), sampled, expected);
            let mirrored = fresnel::dielectric(cos, eta).0;
            check(
                &format!("{what}, integrated"),
                integrated,
                expected - mirrored,
            );
            for out in [0.7, 0.1] {
                let wo = Vector3::spherical(out, 2.0);
                let expected = coated_lambert(eta, rho, wi, wo);
                let mut mean = Mean::default();
                let mut first = true;
                while first || mean.error() > 2e-4 * expected {
                    first = false;
                    for _ in 0..10_000 {
                        let mut total = Total::default();
                        stack.eval(wi, wo, &mut rng, &mut total);
                        mean.add(total.0.0[0]);
                    }
                }
                check(&format!("{what} to {out}"), mean, expected);
            }
        }
    }
}

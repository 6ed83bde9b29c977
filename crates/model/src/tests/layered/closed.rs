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

#[test]
fn a_smooth_coat_over_lambert_meets_the_closed_form() {
    let cases = [(1.5, 0.8), (1.2, 0.5), (2.5, 0.95), (1.5, 1.0), (1.05, 0.7)];
    let bound = worst_score(cases.len() * 12);
    let mut rng = stream(41);
    for (eta, rho) in cases {
        let stack = stack(&[(eta, 0.0)], lambert(rho));
        for cos in [0.95, 0.5, 0.1] {
            let wi = Vector3::spherical(cos, 0.3);
            let f = fresnel::dielectric(cos, eta).0;
            let inside = mean_internal(eta);
            let expected = f + (1.0 - f) * (1.0 - inside) * rho / (1.0 - rho * inside);
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

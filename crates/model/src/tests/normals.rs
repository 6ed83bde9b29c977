//! Distributions of normals.

use super::*;

/// Directions from straight up to nearly straight down.
fn views() -> Vec<Vector3<f64>> {
    [1.0, 0.9, 0.5, 0.1, 1e-3, 0.0, -1e-3, -0.3, -0.8, -0.99]
        .iter()
        .enumerate()
        .map(|(i, &cos)| Vector3::spherical(cos, 0.3 + i as f64))
        .collect()
}

#[test]
fn opposite_areas_differ_by_the_cosine() {
    for case in Case::all() {
        for w in views() {
            let difference = case.projected_area(w) - case.projected_area(-w);
            assert!((difference - w.z).abs() < 1e-14, "{}: {w:?}", case.name());
            if w.z > 0.0 {
                // G1 = 1/(1 + Λ)
                assert!((case.masking(w) * (1.0 + case.lambda(w)) - 1.0).abs() < 1e-12);
            }
        }
    }
}

/// The two slopes of Beckmann are quantiles; so a quantile of the sampler is a
/// value of the distribution function, for any roughness and view.
#[test]
fn beckmann_inverts_to_the_last_digits() {
    for cos in [
        1.0,
        0.999,
        0.5,
        1e-3,
        1e-9,
        0.0,
        -1e-9,
        -1e-3,
        -0.5,
        -0.999,
        -1.0 + 1e-9,
    ] {
        let w = Vector3::<f64>::spherical(cos, 0.0);
        for u in [1e-12, 1e-3, 0.1, 0.5, 0.9, 0.999, 1.0 - 1e-9] {
            let m = Beckmann::isotropic(1.0).sample_visible(w, [u, 0.5]);
            let x = -m.x / m.z;
            // Simpson on the tail that is the smaller.
            let end = if w.x > 0.0 { (w.z / w.x).min(9.0) } else { 9.0 };
            let from = if cos < 0.0 {
                -9.0 - 1.0 / w.x.max(1e-3)
            } else {
                -9.0
            };
            let area = |a: f64, b: f64| {
                let n = 20_000;
                let h = (b - a) / f64::from(n);
                let f = |t: f64| (w.z - t * w.x).max(0.0) * (-t * t).exp();
                (0..n)
                    .map(|i| a + h * f64::from(i))
                    .map(|t| h / 6.0 * (f(t) + 4.0 * f(t + 0.5 * h) + f(t + h)))
                    .sum::<f64>()
            };
            let (below, above) = (area(from.min(x - 1.0), x), area(x, end.max(x)));
            if below + above > 1e-30 {
                let got = below / (below + above);
                assert!(
                    (got - u).abs() < 1e-6 * u.min(1.0 - u) + 1e-10,
                    "cos {cos}, u {u}: {got}"
                );
            }
        }
    }
}

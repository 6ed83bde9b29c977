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

/// Pairs of distributions that must be alike, and how nearly.
fn limits() -> Vec<(Case, StudentT<f64>, f64)> {
    let mut all = vec![];
    for (alpha_x, alpha_y) in [(0.1, 0.1), (0.5, 0.5), (1.0, 0.2)] {
        let student = |gamma| StudentT {
            alpha_x,
            alpha_y,
            gamma,
        };
        all.push((Case::Ggx(Ggx { alpha_x, alpha_y }), student(2.0), 1e-9));
        // The first term that is left out goes with 1/γ and the fourth power of the slope.
        let beckmann = Case::Beckmann(Beckmann { alpha_x, alpha_y });
        all.push((beckmann, student(1e6), 1e-3));
    }
    all
}

#[test]
fn student_is_ggx_at_two_and_beckmann_in_the_end() {
    for (case, student, bar) in limits() {
        for w in views() {
            let name = format!("{student:?} {w:?}");
            let (got, exact) = (student.projected_area(w), case.projected_area(w));
            assert!(
                (got - exact).abs() <= bar * exact.max(1e-3),
                "σ, {name}: {got} against {exact}"
            );
            for u in [[0.01, 0.3], [0.5, 0.5], [0.9, 0.99], [0.3, 0.001]] {
                let m = case.sample_visible(Vector3::spherical(1.0, 0.0), u);
                let (got, exact) = (student.density(m), case.density(m));
                assert!((got / exact - 1.0).abs() < bar, "D, {name}: {got} {exact}");
            }
        }
    }
}

/// ∫ g(m) dm over the hemisphere, by points that crowd at the horizon, where D of
/// long tails is infinite.
fn over_normals(mut g: impl FnMut(Vector3<f64>) -> f64) -> f64 {
    let n = 200;
    let mut sum = 0.0;
    for (t, weight) in gauss(n) {
        for j in 0..2 * n {
            let phi = std::f64::consts::PI * (j as f64 + 0.5) / n as f64;
            sum += 4.0 * t.powi(3) * weight * g(Vector3::spherical(t.powi(4), phi));
        }
    }
    sum * std::f64::consts::PI / n as f64
}

/// From a direction anywhere on the sphere normals have the density D_w, seen in the
/// means of two smooth functions of them, by quadrature over u; and the area of a
/// side that is hidden is Σ over the normals themselves.
#[test]
fn student_normals_have_their_density() {
    for (alpha_x, alpha_y, gamma) in [(0.5, 0.5, 1.7), (1.0, 0.3, 3.0), (0.7, 0.7, 40.0)] {
        let d = StudentT {
            alpha_x,
            alpha_y,
            gamma,
        };
        let total = over_normals(|m| d.density(m) * m.z);
        assert!((total - 1.0).abs() < 1e-6, "{d:?}: ∫ D m_z = {total}");
        for w in views() {
            let area = d.projected_area(w);
            if area < 1e-4 {
                continue;
            }
            let moments = |m: Vector3<f64>| [m.z, m.x * m.y + m.y, m.x * m.x];
            // Points crowd at the ends, where normals change like a root of u.
            let n = 64;
            let mut sampled = [0.0; 3];
            for i in 0..n * n {
                let at = |i: usize| (i as f64 + 0.5) / n as f64;
                let (s, t) = (at(i % n), at(i / n));
                let u = [s, t].map(|s| s * s * (3.0 - 2.0 * s));
                let weight = 36.0 * s * (1.0 - s) * t * (1.0 - t) / (n * n) as f64;
                let m = d.sample_visible(w, u);
                assert!((m.length() - 1.0).abs() < 1e-12 && m.dot(w) > -1e-9);
                for (sum, x) in sampled.iter_mut().zip(moments(m)) {
                    *sum += weight * x;
                }
            }
            let by_area = over_normals(|m| d.visible_density(w, m));
            assert!(
                (by_area - 1.0).abs() < 1e-3,
                "{d:?} {w:?}: σ off by {by_area}"
            );
            for (k, sampled) in sampled.into_iter().enumerate() {
                let exact = over_normals(|m| d.visible_density(w, m) * moments(m)[k]);
                assert!(
                    (sampled - exact).abs() < 1e-3,
                    "{d:?} {w:?} moment {k}: {sampled} against {exact}"
                );
            }
        }
    }
}

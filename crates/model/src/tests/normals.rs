//! Distributions of normals: normalisation, σ, visible normals.

use super::*;

/// The normal whose slope, in units of α, is `r` at azimuth `phi`, and the
/// solid angle per dr dφ.
fn normal_at(case: Case, r: f64, phi: f64) -> (Vector3<f64>, f64) {
    let (ax, ay) = case.stretch();
    let m = Vector3::new(ax * r * phi.cos(), ay * r * phi.sin(), 1.0);
    let n = m.normalized();
    (n, ax * ay * n.z.powi(3) * r)
}

/// ∫ g(m) D(m) dm, with r = x/(1 − x).
fn over_normals(case: Case, g: impl Fn(Vector3<f64>) -> f64) -> f64 {
    let (n, turns) = (120, 240);
    let mut sum = 0.0;
    for (x, weight) in gauss(n) {
        let (r, dr) = (x / (1.0 - x), (1.0 - x).powi(-2));
        for j in 0..turns {
            let (m, measure) = normal_at(
                case,
                r,
                std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(turns),
            );
            sum += weight * dr * measure * case.density(m) * g(m);
        }
    }
    sum * std::f64::consts::TAU / f64::from(turns)
}

/// Directions from straight up to nearly straight down.
fn views() -> Vec<Vector3<f64>> {
    [1.0, 0.9, 0.5, 0.1, 1e-3, 0.0, -1e-3, -0.3, -0.8, -0.99]
        .iter()
        .enumerate()
        .map(|(i, &cos)| Vector3::spherical(cos, 0.3 + i as f64))
        .collect()
}

#[test]
fn normals_and_projected_areas_integrate() {
    for case in Case::all() {
        let whole = over_normals(case, |m| m.z);
        assert!(
            (whole - 1.0).abs() < 1e-6,
            "{}: ∫ D m_z = {whole}",
            case.name()
        );
        for w in views() {
            // The kink at m·w = 0 limits the quadrature.
            let area = over_normals(case, |m| m.dot(w).max(0.0));
            let sigma = case.projected_area(w);
            assert!(
                (area - sigma).abs() < 2e-4 * (0.05 + sigma),
                "{}, {w:?}: ∫ = {area}, σ = {sigma}",
                case.name()
            );
        }
    }
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

/// Statement 9: ∫ G1(ω) ⟨ω·m⟩ D(m)/ω_z dm = 1, by a sampler that must
/// produce exactly the density it claims: χ² over cells in slope and azimuth.
#[test]
fn visible_normals_have_their_density() {
    const CELLS: usize = 12;
    const FINE: usize = 24;
    const SAMPLES: usize = 200_000;
    // From far below, a smooth surface shows its steepest slopes alone, which
    // these cells do not resolve.
    let resolved = |case: Case, w: Vector3<f64>| {
        case.projected_area(w) > 1e-4
            && (w.z > -0.5 || case.stretch().0.min(case.stretch().1) >= 0.5)
    };
    let cases: Vec<_> = Case::all()
        .into_iter()
        .flat_map(|case| views().into_iter().map(move |w| (case, w)))
        .filter(|&(case, w)| resolved(case, w))
        .collect();
    let least = sidak(cases.len());
    for (index, &(case, w)) in cases.iter().enumerate() {
        let cell = |r: f64, phi: f64| {
            let i = ((r / (1.0 + r)) * CELLS as f64) as usize;
            let j = (phi.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * CELLS as f64)
                as usize;
            i.min(CELLS - 1) * CELLS + j.min(CELLS - 1)
        };
        let mut expected = vec![0.0; CELLS * CELLS];
        let n = CELLS * FINE;
        for i in 0..n {
            let x = (i as f64 + 0.5) / n as f64;
            let (r, dr) = (x / (1.0 - x), (1.0 - x).powi(-2));
            for j in 0..n {
                let phi = std::f64::consts::TAU * (j as f64 + 0.5) / n as f64;
                let (m, measure) = normal_at(case, r, phi);
                let share = case.visible_density(w, m) * measure * dr * std::f64::consts::TAU
                    / (n * n) as f64;
                expected[cell(r, phi)] += share * SAMPLES as f64;
            }
        }
        let total: f64 = expected.iter().sum();
        assert!(
            (total / SAMPLES as f64 - 1.0).abs() < 5e-3,
            "{} {w:?}: ∫ D_w = {}",
            case.name(),
            total / SAMPLES as f64
        );

        let mut rng = stream(index as u64);
        let mut seen = vec![0.0; CELLS * CELLS];
        let (ax, ay) = case.stretch();
        for _ in 0..SAMPLES {
            let m = case.sample_visible(w, [rng.draw(), rng.draw()]);
            assert!(
                (m.length() - 1.0).abs() < 1e-12 && m.z >= 0.0 && m.dot(w) > -1e-12,
                "{} {w:?}: {m:?}",
                case.name()
            );
            let (x, y) = (m.x / (ax * m.z), m.y / (ay * m.z));
            seen[cell(x.hypot(y), y.atan2(x))] += 1.0;
        }
        let p = chi_square(&seen, &expected);
        assert!(
            p > least,
            "{} {w:?}: p = {p:e}, needs {least:e}",
            case.name()
        );
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

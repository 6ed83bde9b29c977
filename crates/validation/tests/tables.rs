//! The released tables of `docs/tables` against quadrature, and against themselves, made
//! anew.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use smithwalk_model::{Beckmann, ConductorFresnel, Ggx, Ndf, Rgb, Vector3};
use smithwalk_validation::tables::{cases, measured, orders_header};
use smithwalk_validation::{Distribution, second_order, statistics::gauss};

/// Standard errors that a value may be off by. Rounding to 10⁻⁶ beside it. Of 24
/// comparisons one in 10⁴ tables of other seeds would fail.
const BOUND: f64 = 5.0;

fn rows() -> Vec<BTreeMap<String, String>> {
    let text = include_str!("../../../docs/tables/orders.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    assert_eq!(header.join(","), orders_header());
    lines
        .map(|line| {
            let cells = line.split(',').map(str::to_owned);
            header
                .iter()
                .map(|name| (*name).to_owned())
                .zip(cells)
                .collect()
        })
        .collect()
}

/// A value of a conductor's row and its standard error.
fn value(distribution: &str, alpha: &str, cos: &str, column: &str) -> (f64, f64) {
    let wanted = ["conductor", distribution, alpha, cos];
    let names = ["facets", "distribution", "alpha", "cos"];
    let rows = rows();
    let row = rows
        .iter()
        .find(|row| names.iter().zip(wanted).all(|(n, w)| row[*n] == w))
        .expect("a row");
    let number = |name: &str| row[name].parse().expect("a number");
    (number(column), number(&format!("{column}_stderr")))
}

/// Order 1 of mirrors, ∫ D(m) ⟨m·ω_i⟩ / (cosθ_i (1 + Λ_i + Λ_o)) dm, by points that are
/// even in the distribution of slopes.
fn first_order(slope2: impl Fn(f64) -> f64, lambda: impl Fn(f64) -> f64, cos: f64) -> f64 {
    let wi = Vector3::spherical(cos, 0.0);
    let n = 1200;
    let mut sum = 0.0;
    for i in 0..n {
        let slope = slope2((i as f64 + 0.5) / n as f64).sqrt();
        let z = 1.0 / slope.hypot(1.0);
        for j in 0..n / 2 {
            // One half of the azimuths: the other is its mirror image.
            let phi = PI * (j as f64 + 0.5) / (n / 2) as f64;
            let m = Vector3::spherical(z, phi);
            let facing = wi.dot(m);
            let out = 2.0 * facing * m.z - wi.z;
            if facing > 0.0 && out > 0.0 {
                sum += facing / z / (1.0 + lambda(cos) + lambda(out));
            }
        }
    }
    sum / (cos * (n * n / 2) as f64)
}

#[test]
fn first_orders_are_their_integrals() {
    for (alpha, cos) in [("0.5", "0.5"), ("1", "1"), ("1", "0.25"), ("0.25", "0.75")] {
        let [a, c]: [f64; 2] = [alpha, cos].map(|x| x.parse().expect("a number"));
        let tan = |cos: f64| (1.0 - cos * cos).max(0.0).sqrt() / cos;
        let ggx = first_order(
            |u| a * a * u / (1.0 - u),
            |cos| 0.5 * ((a * tan(cos)).hypot(1.0) - 1.0),
            c,
        );
        let beckmann = Beckmann::isotropic(a);
        let gauss = first_order(
            |u| -a * a * (-u).ln_1p(),
            |cos| beckmann.lambda(Vector3::spherical(cos, 0.0)),
            c,
        );
        for (name, exact) in [("ggx", ggx), ("beckmann", gauss)] {
            let (value, error) = value(name, alpha, cos, "r1");
            // Points make an error of their own, at the horizon.
            let off = (value - exact).abs() - 2e-5;
            assert!(
                off < BOUND * error,
                "{name} {alpha} {cos}: {value} ± {error}, {exact}"
            );
        }
    }
}

#[test]
fn second_orders_are_their_integrals() {
    let white = ConductorFresnel::Constant(Rgb::white());
    let (alpha, cos) = (1.0, 0.5);
    for (name, ndf) in [
        ("ggx", Distribution::Ggx(Ggx::isotropic(alpha))),
        (
            "beckmann",
            Distribution::Beckmann(Beckmann::isotropic(alpha)),
        ),
    ] {
        let wi = Vector3::spherical(cos, 0.0);
        let n = 8;
        let mut sum = 0.0;
        for (x, weight) in gauss(n) {
            for j in 0..n {
                let phi = PI * (j as f64 + 0.5) / n as f64;
                let wo = Vector3::spherical(x, phi);
                sum += weight * second_order(&ndf, &white, wi, wo).0.0[0] * TAU / n as f64;
            }
        }
        let (value, error) = value(name, "1", "0.5", "r2");
        let off = (value - sum).abs() - 2e-4;
        assert!(off < BOUND * error, "{name}: {value} ± {error}, {sum}");
    }
}

/// Another processor's last digits may decide a walk otherwise.
#[test]
fn a_row_comes_out_again() {
    let all = cases();
    assert_eq!(rows().len(), all.len());
    let case = &all[all.len() - 2];
    let found = measured(&all[all.len() - 2..all.len() - 1], 1e-3);
    assert_eq!(case.cos, Some(0.1));
    let rows = rows();
    let released = &rows[all.len() - 2];
    let line = found[0].line();
    for (name, cell) in orders_header().split(',').zip(line.split(',')) {
        if let Some(column) = name
            .strip_suffix("_stderr")
            .or(name.starts_with('r').then_some(name))
        {
            if name.ends_with("_stderr") || released[column].is_empty() {
                continue;
            }
            let [a, b]: [f64; 2] = [cell, &released[column]].map(|x| x.parse().expect("a number"));
            let error: f64 = released[&format!("{column}_stderr")]
                .parse()
                .expect("a number");
            assert!(
                (a - b).abs() <= BOUND * error.hypot(1e-3),
                "{column}: {a} and {b}"
            );
        } else {
            assert_eq!(cell, released[name]);
        }
    }
}

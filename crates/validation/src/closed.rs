//! Statement 12: the distribution whose mirrors are known to all orders.

use super::check::{Case, Check, Statement};
use super::grid::Effort;
use super::model::{Distribution, Model, Rng, stream, uniform};
use super::points::{REPLICATES, replicated};
use super::statistics::{Mean, chi_square, gauss};
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use rayon::prelude::*;
use smithwalk_model::{Estimator, Microsurface, Quadratic, Split, Total, Vector3};
use std::f64::consts::TAU;

/// The relative standard error that the full effort reaches for every pair.
pub const PRECISION: f64 = 3e-4;

/// The least cosine of the directions of a pair. Connections of a walk from one
/// end are rare and high where the other end grazes: there its means would take
/// too long to become normal.
fn least_cosine(estimator: Estimator) -> f64 {
    match estimator {
        Estimator::Walk => 0.1,
        Estimator::TwoWalk | Estimator::PositionFree => 0.02,
    }
}

/// Pairs of directions with cosines above `least`.
fn pairs(count: usize, least: f64) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let mut rng: Rng = stream(12, 0);
    let mut direction = || {
        let cos = least + (1.0 - least) * uniform(&mut rng);
        Vector3::spherical(cos, TAU * uniform(&mut rng))
    };
    (0..count).map(|_| (direction(), direction())).collect()
}

/// The estimator's mean, with enough samples for a relative standard error of
/// `precision`. Their number is set by a run of its own, so that it does not
/// depend on what is tested.
fn measure<M: Model>(
    model: M,
    surface: &Microsurface<M::Ndf, M::Conductor>,
    estimator: Estimator,
    (wi, wo): (Vector3<f64>, Vector3<f64>),
    precision: f64,
    index: usize,
) -> Mean {
    const PILOT: u32 = 512;
    const MOST: u32 = 1 << 20;
    let run = |samples, first_seed| {
        let seed = first_seed + index as u32 * REPLICATES;
        replicated(120 + estimator as u64, seed, samples, |points| {
            let mut total = Total::default();
            model.eval(surface, estimator, wi, wo, points, &mut total);
            total.0.0[0]
        })
    };
    let pilot = run(PILOT, 1 << 24);
    let share = pilot.error() / (pilot.mean * precision);
    // A margin for the pilot's own error.
    let samples = (2.0 * share * share * f64::from(PILOT)).clamp(f64::from(PILOT), f64::from(MOST));
    run((samples as u32).next_power_of_two(), 0)
}

/// Statement 12.
pub fn closed_form<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let surface = Microsurface {
        ndf: model.ndf(Distribution::Quadratic),
        facets: model.conductor(),
    };
    let count = effort.pick(40, 500);
    let precision = effort.pick(5e-3, PRECISION);
    let mut checks = Vec::new();
    for estimator in [Estimator::Walk, Estimator::TwoWalk, Estimator::PositionFree] {
        let measured = pairs(count, least_cosine(estimator));
        let measured = measured.par_iter().enumerate().map(|(i, &pair)| {
            let mean = measure(model, &surface, estimator, pair, precision, i);
            let name = format!("cosθ {:.3} to {:.3}", pair.0.z, pair.1.z);
            let exact = Quadratic::mirror_all_orders(pair.0, pair.1);
            (
                Case::new(name.clone(), mean.score(exact)),
                Case::new(name, mean.error() / exact),
            )
        });
        let (scores, errors): (Vec<_>, Vec<_>) = measured.unzip();
        checks.push(Check::student_scores(
            format!("{estimator:?} against the closed form"),
            f64::from(REPLICATES - 1),
            scores,
        ));
        checks.push(Check::deviations(
            format!("standard error of {estimator:?}"),
            precision,
            errors,
        ));
    }
    let pairs = pairs(count, 0.02);
    let first = pairs.iter().map(|&(wi, wo)| {
        let single = surface.eval_single(wi, wo, &mut stream(121, 0)).0[0];
        let name = format!("cosθ {:.3} to {:.3}", wi.z, wo.z);
        Case::new(name, single / Quadratic::mirror_first_order(wi, wo) - 1.0)
    });
    checks.push(Check::deviations(
        "first order against f/(1 + cosθ_i cosθ_o)",
        1e-12,
        first.collect(),
    ));
    checks.push(Check::p_values(
        "where walks leave, against the closed form",
        exits(model, effort),
    ));
    let wi = Vector3::spherical(0.5, 0.0);
    let angles = || (-17..18).map(|k| 5.0 * f64::from(k));
    let towards = |a: f64| {
        let (sin, cos) = a.to_radians().sin_cos();
        Vector3::new(-sin, 0.0, cos)
    };
    let line = |name: &str, f: fn(Vector3<f64>, Vector3<f64>) -> f64| {
        Series::new(name, Mark::Line, angles().map(|a| (a, f(wi, towards(a)))))
    };
    let dots = |multiple: bool| {
        let surface = &surface;
        angles().enumerate().map(move |(i, a)| {
            let mut rng = stream(122, i);
            let mut mean = Mean::default();
            for _ in 0..20_000 {
                let mut split = Split::default();
                model.eval(
                    surface,
                    Estimator::Walk,
                    wi,
                    towards(a),
                    &mut rng,
                    &mut split,
                );
                let value = if multiple {
                    split.total()
                } else {
                    split.single
                };
                mean.add(value.0[0]);
            }
            (a, mean.mean, mean.error())
        })
    };
    let figure = Chart {
        title: "D = (2/π) m_z²: closed form and walks, ω_i at 60°".into(),
        x: Axis::linear("angle of ω_o in the plane of incidence (°)"),
        y: Axis::linear("f cosθ_o (1/sr)"),
        series: vec![
            line("all orders", Quadratic::mirror_all_orders),
            line("first order", Quadratic::mirror_first_order),
            Series::new("walks, ±1 SE", Mark::Points, dots(true)).colored(0),
            Series::new("their first order", Mark::Points, dots(false)).colored(1),
        ],
    };
    Ok(Statement {
        number: 12,
        title: "An exact case, to all orders",
        equation: "D(m) = (2/π) m_z²:  f = (cosθ_i + cosθ_o) / (π (1 + ω_i·ω_o))",
        checks,
        figures: vec![figure.to_svg()?],
    })
}

/// χ² of walks' exits in cells of cosine and azimuth.
fn exits<M: Model>(model: M, effort: Effort) -> Vec<Case> {
    const SIDE: usize = 16;
    let samples = effort.pick(50_000, 1_000_000);
    let rule = gauss(6);
    let surface = Microsurface {
        ndf: model.ndf(Distribution::Quadratic),
        facets: model.conductor(),
    };
    let tested = effort
        .views()
        .into_par_iter()
        .enumerate()
        .map(|(index, wi)| {
            let mut expected = vec![0.0; SIDE * SIDE];
            for (k, e) in expected.iter_mut().enumerate() {
                for &(x, u) in &rule {
                    for &(y, v) in &rule {
                        let z = ((k / SIDE) as f64 + x) / SIDE as f64;
                        let phi = TAU * ((k % SIDE) as f64 + y) / SIDE as f64;
                        let f = Quadratic::mirror_all_orders(wi, Vector3::spherical(z, phi));
                        *e += u * v * f * TAU / (SIDE * SIDE) as f64 * samples as f64;
                    }
                }
            }
            let mut seen = vec![0.0; SIDE * SIDE];
            let mut rng = stream(123, index);
            for _ in 0..samples {
                if let Some(exit) = model.sample(&surface, wi, &mut rng) {
                    let o = exit.direction;
                    let turn = o.y.atan2(o.x).rem_euclid(TAU) / TAU;
                    let cell = |x: f64| ((x * SIDE as f64) as usize).min(SIDE - 1);
                    seen[cell(o.z) * SIDE + cell(turn)] += exit.weight.0[0];
                }
            }
            Case::new(format!("cosθ {:.2}", wi.z), chi_square(&seen, &expected))
        });
    tested.collect()
}

//! Statement 7: reciprocity.

use super::{each_facets, estimators, wide};
use crate::check::{Case, Check, Statement};
use crate::grid::Effort;
use crate::model::{Distribution, Model, Rng, stream, uniform};
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use crate::statistics::Mean;
use rayon::prelude::*;
use smithwalk_model::{Estimator, Facets, Microsurface, Total, Vector3};
use std::f64::consts::TAU;

/// f |cosθ_o| by an estimator.
fn value<M: Model, I: Facets<Scalar = f64>>(
    model: M,
    surface: &Microsurface<M::Ndf, I>,
    estimator: Estimator,
    (wi, wo): (Vector3<f64>, Vector3<f64>),
    samples: usize,
    rng: &mut Rng,
) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..samples {
        let mut total = Total::default();
        model.eval(surface, estimator, wi, wo, rng, &mut total);
        mean.add(total.0.0[0]);
    }
    mean
}

/// Cells of equal z and azimuth of a hemisphere.
const CELLS: usize = 12;

fn cell(w: Vector3<f64>) -> usize {
    let turn = w.y.atan2(w.x).rem_euclid(TAU) / TAU;
    ((w.z.abs() * 3.0) as usize).min(2) * 4 + ((turn * 4.0) as usize).min(3)
}

/// Walks that enter evenly (∝ cosθ): how many go from each cell of the upper
/// hemisphere to each one of the upper and of the lower.
fn flows<M: Model, I: Facets<Scalar = f64>>(
    model: M,
    surface: &Microsurface<M::Ndf, I>,
    samples: usize,
    rng: &mut Rng,
) -> [Vec<f64>; 2] {
    let mut flows = [vec![0.0; CELLS * CELLS], vec![0.0; CELLS * CELLS]];
    for _ in 0..samples {
        let z = (1.0 - uniform(rng)).sqrt();
        let wi = Vector3::spherical(z, TAU * uniform(rng));
        if let Some(exit) = model.sample(surface, wi, rng) {
            let part = usize::from(exit.direction.z < 0.0);
            flows[part][cell(wi) * CELLS + cell(exit.direction)] += exit.weight.0[0];
        }
    }
    flows
}

/// Detailed balance: as many walks from cell a to b as from b to a; across the
/// surface n² as many.
fn balance<M: Model, I: Facets<Scalar = f64>>(
    model: M,
    d: Distribution,
    facets: (I, I, f64),
    name: &str,
    samples: usize,
    index: usize,
) -> Vec<Case> {
    let (facets, inverse, n2) = facets;
    let ndf = model.ndf(d);
    let mut rng = stream(7, index);
    let [up, down] = flows(model, &Microsurface { ndf, facets }, samples, &mut rng);
    let mut cases = Vec::new();
    let mut compare = |kind: &str, a: usize, b: usize, there: f64, back: f64, n2: f64| {
        // Rarer flows are not normally distributed.
        if there.min(back) > 100.0 {
            let score = (there - n2 * back) / (there + n2 * n2 * back).sqrt();
            let name = format!("{name}, {}, {kind} between cells {a} and {b}", d.name());
            cases.push(Case::new(name, score));
        }
    };
    for a in 0..CELLS {
        for b in 0..a {
            compare(
                "reflection",
                a,
                b,
                up[a * CELLS + b],
                up[b * CELLS + a],
                1.0,
            );
        }
    }
    if I::TRANSMITS {
        // From below; that frame is the point reflection of ours.
        let surface = Microsurface {
            ndf,
            facets: inverse,
        };
        let [_, back] = flows(model, &surface, samples, &mut rng);
        let opposite = |c: usize| c / 4 * 4 + (c + 2) % 4;
        for a in 0..CELLS {
            for b in 0..CELLS {
                let there = down[a * CELLS + b];
                let back = back[opposite(b) * CELLS + opposite(a)];
                compare("transmission", a, b, there, back, n2);
            }
        }
    }
    cases
}

/// Statement 7.
pub fn reciprocal<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let walks = effort.pick(20_000, 200_000);
    let distributions = effort.distributions();
    let balanced = distributions
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, &d)| {
            let mirror = (model.conductor(), model.conductor(), 1.0);
            let diffuse = (model.diffuse(), model.diffuse(), 1.0);
            let mut cases = balance(model, d, mirror, "mirror", walks, i << 8);
            cases.extend(balance(model, d, diffuse, "diffuse", walks, i << 8 | 1));
            for (k, &eta) in effort.indices().iter().enumerate() {
                let glass = (
                    model.dielectric(eta),
                    model.dielectric(1.0 / eta),
                    eta * eta,
                );
                let name = format!("η {eta:.2}");
                cases.extend(balance(model, d, glass, &name, walks, i << 8 | (k + 2)));
            }
            cases
        });
    let balanced = balanced.collect();
    // Values for fixed directions, by the walk from one end and the two-walk
    // estimators, which weight by what reciprocity says of the other end.
    let samples = effort.pick(5_000, 40_000);
    let pairs = [(0.9, 0.3), (0.2, 0.6), (0.5, 0.5), (0.8, -0.4), (0.4, -0.7)];
    let pairs = pairs.map(|(a, b)| (Vector3::spherical(a, 0.2), Vector3::spherical(b, 2.5)));
    let estimates = each_facets!(model, effort, |name, facets, bend| {
        let pairs = pairs
            .iter()
            .filter(|(_, wo)| wo.z > 0.0 || transmits(&facets));
        let jobs: Vec<_> = distributions
            .iter()
            .filter(|&&d| wide(d, &facets, bend))
            .flat_map(|&d| pairs.clone().map(move |&p| (d, p)))
            .enumerate()
            .collect();
        let cases = jobs.par_iter().flat_map_iter(|&(i, (d, (wi, wo)))| {
            let surface = Microsurface {
                ndf: model.ndf(d),
                facets,
            };
            let mut rng = stream(70, i);
            let forth = value(
                model,
                &surface,
                Estimator::Walk,
                (wi, wo),
                samples,
                &mut rng,
            );
            let mut cases = Vec::new();
            let mut compare = |what: String, other: Mean| {
                let name = format!(
                    "{name}, {}, cosθ {:.1} to {:.1}, {what}",
                    d.name(),
                    wi.z,
                    wo.z
                );
                cases.push(Case::new(name, forth.score_against(&other)));
            };
            for &estimator in &estimators(&facets)[1..] {
                let other = value(model, &surface, estimator, (wi, wo), samples, &mut rng);
                compare(format!("{estimator:?}"), other);
            }
            let (scale, back) = if wo.z > 0.0 {
                (1.0, (wo, wi))
            } else {
                (facets.relative_index().powi(2), (-wo, -wi))
            };
            let surface = Microsurface {
                facets: if wo.z > 0.0 {
                    facets
                } else {
                    facets.inverted()
                },
                ..surface
            };
            let mirrored = value(model, &surface, Estimator::Walk, back, samples, &mut rng);
            let scale = scale * wo.z.abs() / wi.z;
            compare("reversed".into(), mirrored.scaled(scale));
            cases
        });
        cases.collect::<Vec<_>>()
    });
    let d = crate::escape::shown_distributions()[1];
    let surface = Microsurface {
        ndf: model.ndf(d),
        facets: model.conductor(),
    };
    let wi = Vector3::spherical(0.5, 0.0);
    let line = |forth: bool| {
        let surface = &surface;
        (-8..9).map(move |k| {
            let a = 10.0 * f64::from(k);
            let (sin, cos) = a.to_radians().sin_cos();
            let wo = Vector3::new(-sin, 0.0, cos);
            let pair = if forth { (wi, wo) } else { (wo, wi) };
            let mut rng = stream(71, (k + 8) as usize * 2 + usize::from(forth));
            let f = value(model, surface, Estimator::Walk, pair, samples, &mut rng)
                .scaled(1.0 / pair.1.z);
            (a, f.mean, f.error())
        })
    };
    let figure = Chart {
        title: format!(
            "f there and back, all orders, mirrors, {}, ω_i at 60°",
            d.name()
        ),
        x: Axis::linear("angle of ω_o in the plane of incidence (°)"),
        y: Axis::linear("f (1/sr)"),
        series: vec![
            Series::new("f(ω_i, ω_o)", Mark::Line, line(true)),
            Series::new("f(ω_o, ω_i), ±1 SE", Mark::Points, line(false)),
        ],
    };
    Ok(Statement {
        number: 7,
        title: "The BSDF is reciprocal, with n² across a dielectric",
        equation: "f(ω_i, ω_o) n_i² = f(ω_o, ω_i) n_o²",
        checks: vec![
            Check::scores("flows of walks between cells, both ways", balanced),
            Check::scores(
                "the walk for fixed directions, against its reverse and the two-walk estimators",
                estimates,
            ),
        ],
        figures: vec![figure.to_svg()?],
    })
}

fn transmits<I: Facets<Scalar = f64>>(_: &I) -> bool {
    I::TRANSMITS
}

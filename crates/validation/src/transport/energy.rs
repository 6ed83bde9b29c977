//! Statement 6: energy.

use super::{Proposal, each_facets, estimators, tame, wide};
use crate::check::{Case, Check, Statement};
use crate::grid::Effort;
use crate::model::{Model, Rng, stream};
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use crate::statistics::Mean;
use rayon::prelude::*;
use smithwalk_model::{Estimator, Facets, Microsurface, Rgb, Split, Tally, Vector3};

/// ∫ f |cosθ_o| dω_o by an estimator: single scattering, and all.
fn albedo<M: Model, I: Facets<Scalar = f64>>(
    model: M,
    proposal: &Proposal<M::Ndf, I>,
    estimator: Estimator,
    wi: Vector3<f64>,
    samples: usize,
    rng: &mut Rng,
) -> (Mean, Mean) {
    let (mut single, mut total) = (Mean::default(), Mean::default());
    for _ in 0..samples {
        let mut split = Split::default();
        let mut scale = 0.0;
        if let Some((wo, density)) = proposal.pick(wi, rng) {
            model.eval(&proposal.surface, estimator, wi, wo, rng, &mut split);
            scale = 1.0 / density;
        }
        single.add(split.single.0[0] * scale);
        total.add(split.total().0[0] * scale);
    }
    (single, total)
}

/// Orders 1, 2, and all above, in the first channel.
#[derive(Default)]
struct ByOrder([f64; 3]);

/// Where an order is in [`ByOrder`].
fn class(order: u32) -> usize {
    (order.max(1) as usize - 1).min(2)
}

impl Tally<f64> for ByOrder {
    fn add(&mut self, order: u32, value: Rgb<f64>) {
        self.0[class(order)] += value.0[0];
    }
}

/// What walks carry out in zones of the sphere by order, against what is
/// evaluated in them.
fn zones<M: Model, I: Facets<Scalar = f64>>(
    model: M,
    proposal: &Proposal<M::Ndf, I>,
    name: &str,
    wi: Vector3<f64>,
    samples: usize,
    rng: &mut Rng,
) -> Vec<Case> {
    const EDGES: [f64; 5] = [-1.0, -0.5, 0.0, 0.4, 1.0];
    let zone = |z: f64| EDGES[1..4].iter().filter(|&&edge| z > edge).count();
    let mut exits = [[Mean::default(); 3]; 4];
    let mut values = exits;
    for _ in 0..samples {
        let mut left = [[0.0; 3]; 4];
        if let Some(exit) = model.sample(&proposal.surface, wi, rng) {
            left[zone(exit.direction.z)][class(exit.order)] = exit.weight.0[0];
        }
        let mut evaluated = [[0.0; 3]; 4];
        if let Some((wo, density)) = proposal.pick(wi, rng) {
            let mut orders = ByOrder::default();
            let estimator = Estimator::TwoWalk;
            model.eval(&proposal.surface, estimator, wi, wo, rng, &mut orders);
            evaluated[zone(wo.z)] = orders.0.map(|value| value / density);
        }
        for k in 0..4 {
            for order in 0..3 {
                exits[k][order].add(left[k][order]);
                values[k][order].add(evaluated[k][order]);
            }
        }
    }
    let mut cases = Vec::new();
    for k in 0..4 {
        for (order, kind) in ["1", "2", "≥ 3"].into_iter().enumerate() {
            let (exit, value) = (&exits[k][order], &values[k][order]);
            // A share of a few samples is not normally distributed.
            if exit.mean.max(value.mean) * samples as f64 > 100.0 {
                let name = format!("{name}, z ≤ {}, order {kind}", EDGES[k + 1]);
                cases.push(Case::new(name, exit.score_against(value)));
            }
        }
    }
    cases
}

/// Statement 6.
pub fn white_furnace<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let samples = effort.pick(4_000, 16_000);
    let all: Vec<_> = effort.views_of_all().into_iter().enumerate().collect();
    let energy = each_facets!(model, effort, |name, facets, bend| {
        let tame = all
            .par_iter()
            .filter(|(_, (d, w))| tame(*d, *w, &facets, bend));
        let cases = tame.flat_map_iter(|&(i, (d, w))| {
            let proposal = Proposal::new(model, d, facets);
            let used = estimators(&facets)
                .iter()
                .filter(move |&&e| e != Estimator::Walk || wide(d, &facets, bend));
            let name = name.clone();
            used.map(move |&estimator| {
                let mut rng = stream(6, i);
                let (_, total) = albedo(model, &proposal, estimator, w, samples, &mut rng);
                let name = format!("{name}, {}, cosθ {:.2}, {estimator:?}", d.name(), w.z);
                Case::new(name, total.score(1.0))
            })
        });
        cases.collect::<Vec<_>>()
    });
    let carried = each_facets!(model, effort, |name, facets, bend| {
        let tame = all
            .par_iter()
            .filter(|(_, (d, w))| tame(*d, *w, &facets, bend));
        let cases = tame.flat_map_iter(|&(i, (d, w))| {
            let proposal = Proposal::new(model, d, facets);
            let name = format!("{name}, {}, cosθ {:.2}", d.name(), w.z);
            zones(model, &proposal, &name, w, samples, &mut stream(60, i))
        });
        cases.collect::<Vec<_>>()
    });
    let kept = each_facets!(model, effort, |name, facets, _bend| {
        let cases = all.par_iter().map(|&(i, (d, w))| {
            let surface = Microsurface {
                ndf: model.ndf(d),
                facets,
            };
            let mut rng = stream(62, i);
            let mut mean = Mean::default();
            for _ in 0..samples {
                let exit = model.sample(&surface, w, &mut rng);
                mean.add(exit.map_or(0.0, |e| e.weight.0[0]));
            }
            let name = format!("{name}, {}, cosθ {:.2}", d.name(), w.z);
            Case::new(name, mean.score(1.0))
        });
        cases.collect::<Vec<_>>()
    });
    let mut series = Vec::new();
    for (color, d) in crate::escape::shown_distributions().into_iter().enumerate() {
        let proposal = Proposal::new(model, d, model.conductor());
        let points = (0..18).map(|k| {
            let a = 5.0 * f64::from(k);
            let w = Vector3::spherical(a.to_radians().cos(), 0.0);
            let mut rng = stream(61, k as usize);
            let (single, total) =
                albedo(model, &proposal, Estimator::TwoWalk, w, samples, &mut rng);
            (a, single, total)
        });
        let points: Vec<_> = points.collect();
        let line = points.iter().map(|(a, single, _)| (*a, single.mean));
        let dots = points
            .iter()
            .map(|(a, _, total)| (*a, total.mean, total.error()));
        series.push(Series::new(d.name(), Mark::Line, line).colored(color));
        series.push(Series::new("", Mark::Points, dots).colored(color));
    }
    let figure = Chart {
        title: "White mirrors: albedo of one bounce (lines) and of all (dots, ±1 SE)".into(),
        x: Axis::linear("angle θ_i (°)").between(0.0, 90.0),
        y: Axis::linear("albedo").between(0.0, 1.1),
        series,
    };
    Ok(Statement {
        number: 6,
        title: "White furnace: no energy is lost or gained",
        equation: "∫ f(ω_i, ω_o) |cosθ_o| dω_o = 1",
        checks: vec![
            Check::scores("the integral, by every estimator", energy),
            Check::scores("what walks carry out", kept),
            Check::scores(
                "what walks carry out by zone and order, against what is evaluated there",
                carried,
            ),
        ],
        figures: vec![figure.to_svg()?],
    })
}

//! Statement 8: single scattering.

use super::{Proposal, each_facets};
use crate::check::{Case, Check, Statement};
use crate::grid::Effort;
use crate::model::{Model, Rng, stream};
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use crate::statistics::Mean;
use rayon::prelude::*;
use smithwalk_model::{Estimator, Microsurface, Split, Vector3};

/// Statement 8.
pub fn single_scattering<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let samples = effort.pick(3_000, 20_000);
    let all: Vec<_> = effort.views_of_all().into_iter().enumerate().collect();
    let order_one = |surface: &Microsurface<M::Ndf, M::Conductor>, wi, wo, rng: &mut Rng| {
        let mut mean = Mean::default();
        for _ in 0..samples {
            let mut split = Split::default();
            model.eval(surface, Estimator::Walk, wi, wo, rng, &mut split);
            mean.add(split.single.0[0]);
        }
        mean
    };
    let shares = each_facets!(model, effort, |name, facets, _bend| {
        let cases = all.par_iter().filter_map(|&(i, (d, wi))| {
            let surface = Microsurface {
                ndf: model.ndf(d),
                facets,
            };
            let mut rng = stream(80, i);
            let (mut left, mut weighted) = (Mean::default(), Mean::default());
            for _ in 0..samples {
                let exit = model.sample(&surface, wi, &mut rng);
                left.add(exit.map_or(0.0, |e| if e.order == 1 { e.weight.0[0] } else { 0.0 }));
                let single = surface.sample_single(wi, &mut rng);
                weighted.add(single.map_or(0.0, |e| e.weight.0[0]));
            }
            let name = format!("{name}, {}, cosθ {:.2}", d.name(), wi.z);
            // A share, of which too few walks have the other fate, is not normal.
            let rare = samples as f64 * weighted.mean.min(1.0 - weighted.mean);
            (rare > 50.0).then(|| Case::new(name, left.score_against(&weighted)))
        });
        cases.collect::<Vec<_>>()
    });
    let values = each_facets!(model, effort, |name, facets, _bend| {
        let cases = all.par_iter().filter_map(|&(i, (d, wi))| {
            let surface = Microsurface {
                ndf: model.ndf(d),
                facets,
            };
            let mut rng = stream(8, i);
            let (wo, _) = Proposal::new(model, d, facets).pick(wi, &mut rng)?;
            let mut walk = Mean::default();
            let mut closed = Mean::default();
            for _ in 0..samples {
                let mut split = Split::default();
                model.eval(&surface, Estimator::Walk, wi, wo, &mut rng, &mut split);
                walk.add(split.single.0[0]);
                closed.add(surface.eval_single(wi, wo, &mut rng).0[0]);
            }
            let name = format!("{name}, {}, cosθ {:.2} to {:.2}", d.name(), wi.z, wo.z);
            (closed.mean > 1e-3).then(|| Case::new(name, walk.score_against(&closed)))
        });
        cases.collect::<Vec<_>>()
    });
    let d = crate::escape::shown_distributions()[1];
    let surface = Microsurface {
        ndf: model.ndf(d),
        facets: model.conductor(),
    };
    let wi = Vector3::spherical(0.5, 0.0);
    let angles = || (-17..18).map(|k| 5.0 * f64::from(k));
    let towards = |a: f64| {
        let (sin, cos) = a.to_radians().sin_cos();
        Vector3::new(-sin, 0.0, cos)
    };
    let closed = angles().map(|a| {
        let value = surface.eval_single(wi, towards(a), &mut stream(81, 0));
        (a, value.0[0])
    });
    let walks = angles().enumerate().map(|(i, a)| {
        let mean = order_one(&surface, wi, towards(a), &mut stream(82, i));
        (a, mean.mean, mean.error())
    });
    let figure = Chart {
        title: format!(
            "Walks cut after one bounce, mirrors, {}, ω_i at 60°",
            d.name()
        ),
        x: Axis::linear("angle of ω_o in the plane of incidence (°)"),
        y: Axis::linear("f |cosθ_o| (1/sr)"),
        series: vec![
            Series::new("closed form", Mark::Line, closed),
            Series::new("walks, ±1 SE", Mark::Points, walks),
        ],
    };
    Ok(Statement {
        number: 8,
        title: "Walks cut after one bounce are the single-scattering BSDF",
        equation: "f₁ cosθ_o = F D(h) / (4 cosθ_i (1 + Λ_i + Λ_o)), and its like",
        checks: vec![
            Check::scores("order 1 of walks against the closed form", values),
            Check::scores(
                "walks that leave after one facet against weighted single scattering",
                shares,
            ),
        ],
        figures: vec![figure.to_svg()?],
    })
}

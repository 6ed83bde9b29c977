//! Statements 6, 7 and 8: energy, reciprocity and single scattering of whole
//! walks.

use super::check::{Case, Check, Statement};
use super::grid::Effort;
use super::model::{Distribution, Model, Rng, stream, uniform};
use super::statistics::Mean;
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use rayon::prelude::*;
use smithwalk_model::{
    Estimator, Facets, Ggx, Microsurface, Ndf, Rgb, Split, Tally, Total, Vector3,
};
use std::f64::consts::TAU;

/// The least |ln η| at which refraction bends light enough. With less, light
/// goes nearly straight on, and its phase function is a peak at any roughness.
const LEAST_BEND: f64 = 0.3;

/// Whether the walk's estimates for fixed directions have tails light enough
/// for normal scores: its connections are as high as the lobe of a facet, which
/// refraction makes narrower.
fn wide<I: Facets<Scalar = f64>>(d: Distribution, _: &I, bend: f64) -> bool {
    let least = if I::TRANSMITS { 1.0 } else { 0.5 };
    d.alpha().0.min(d.alpha().1) >= least && bend >= LEAST_BEND
}

/// Runs `$body` with `$facets` as all the model's facets in turn; collects.
/// `$bend` is |ln η|, ∞ for those that do not refract.
macro_rules! each_facets {
    ($model:expr, $effort:expr, |$name:ident, $facets:ident, $bend:ident| $body:expr) => {{
        let mut all = Vec::new();
        {
            let ($name, $facets, $bend) = ("mirror".to_owned(), $model.conductor(), f64::INFINITY);
            all.extend($body);
        }
        {
            let ($name, $facets, $bend) = ("diffuse".to_owned(), $model.diffuse(), f64::INFINITY);
            all.extend($body);
        }
        for &eta in $effort.indices() {
            let name = format!("η {eta:.2}");
            let ($name, $facets, $bend) = (name, $model.dielectric(eta), eta.ln().abs());
            all.extend($body);
        }
        all
    }};
}

/// The estimators that `facets` have.
fn estimators<I: Facets<Scalar = f64>>() -> &'static [Estimator] {
    if I::MIRRORS {
        &[Estimator::Walk, Estimator::TwoWalk, Estimator::PositionFree]
    } else {
        &[Estimator::Walk, Estimator::TwoWalk]
    }
}

/// Whether an integral of evaluations has tails light enough for normal scores
/// with [`Proposal`]: either higher orders have wide lobes, or there are hardly
/// any. What walks carry out is tested everywhere.
fn tame<I: Facets<Scalar = f64>>(d: Distribution, w: Vector3<f64>, _: &I, bend: f64) -> bool {
    let (x, y) = d.alpha();
    let tan = (1.0 - w.z * w.z).max(0.0).sqrt() / w.z;
    let least = if I::TRANSMITS { 0.5 } else { 0.2 };
    (x.min(y) >= least && bend >= LEAST_BEND) || x.max(y) * tan <= 0.5
}

/// Directions to evaluate in: a mixture of uniform ones, of the first bounce,
/// and of that of a surface twice as rough, whose lobes are as wide as those
/// of higher orders.
struct Proposal<N, I> {
    surface: Microsurface<N, I>,
    rougher: Microsurface<N, I>,
}

impl<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>> Proposal<N, I> {
    fn new<M: Model<Ndf = N>>(model: M, d: Distribution, facets: I) -> Self {
        let (x, y) = d.alpha();
        let rougher = Distribution::Ggx(Ggx {
            alpha_x: 2.0 * x,
            alpha_y: 2.0 * y,
        });
        Self {
            surface: Microsurface {
                ndf: model.ndf(d),
                facets,
            },
            rougher: Microsurface {
                ndf: model.ndf(rougher),
                facets,
            },
        }
    }

    /// A direction and its density (sr⁻¹).
    fn pick(&self, wi: Vector3<f64>, rng: &mut Rng) -> Option<(Vector3<f64>, f64)> {
        let shares = if I::CLOSED_PHASE {
            [0.2, 0.5, 0.3]
        } else {
            [1.0, 0.0, 0.0]
        };
        let u = uniform(rng);
        let wo = if u < shares[0] {
            let z = uniform(rng);
            let below = I::TRANSMITS && uniform(rng) < 0.5;
            Vector3::spherical(if below { -z } else { z }, TAU * uniform(rng))
        } else if u < shares[0] + shares[1] {
            self.surface.sample_single(wi, rng)?.direction
        } else {
            self.rougher.sample_single(wi, rng)?.direction
        };
        let sphere = if I::TRANSMITS { 2.0 } else { 1.0 } * TAU;
        let mut density = shares[0] / sphere;
        if I::CLOSED_PHASE {
            density += shares[1] * self.surface.pdf_single(wi, wo);
            density += shares[2] * self.rougher.pdf_single(wi, wo);
        }
        Some((wo, density))
    }
}

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
            let used = estimators_of(&facets)
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
    for (color, d) in super::escape::shown_distributions().into_iter().enumerate() {
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

/// [`estimators`] of a value.
fn estimators_of<I: Facets<Scalar = f64>>(_: &I) -> &'static [Estimator] {
    estimators::<I>()
}

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
            for &estimator in &estimators_of(&facets)[1..] {
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
    let d = super::escape::shown_distributions()[1];
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
    let d = super::escape::shown_distributions()[1];
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

//! Statements 1, 2, 3 and 9: masking, from first principles.

use super::check::{Case, Check, Statement};
use super::grid::{Effort, cross};
use super::model::{Distribution, Model, stream};
use super::slopes::Slopes;
use super::statistics::Mean;
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use rayon::prelude::*;
use smithwalk_model::heights::{Gaussian, Heights, Uniform};
use smithwalk_model::{At, Estimator, Facets, Microsurface, Ndf, PerOrder, Side, Vector3};

/// Nodes a side of the quadratures over normals.
const NODES: usize = 40;

/// What those quadratures and the ones over heights are good for, relative.
const QUADRATURE: f64 = 1e-6;

/// σ(w) = ∫ ⟨m·w⟩ D(m) dm, by quadrature.
pub fn projected_area(model: impl Model, d: Distribution, w: Vector3<f64>) -> f64 {
    let ndf = model.ndf(d);
    Slopes::seen(d, w).integrate(NODES, |m| m.dot(w).max(0.0) * ndf.density(m))
}

/// Λ(w) = σ(−w)/w_z, by the quadrature over w, of which more is to be seen.
fn lambda(model: impl Model, d: Distribution, w: Vector3<f64>) -> f64 {
    projected_area(model, d, w) / w.z - 1.0
}

/// The mean of e^{−Λ τ} over the heights, with τ(h) = ∫_h^∞ P1/C1 dh′ summed
/// up from the top: the chance of no hit at the rate Λ P1/C1 per height.
fn escapes(heights: &impl Heights<f64>, (low, high): (f64, f64), lambda: f64) -> f64 {
    const STEPS: usize = 4_000;
    // Short steps at the top, where steep rates are decided, and at the
    // bottom, where the rate of uniform heights has a pole.
    let height = |i: usize| {
        let x = i as f64 / STEPS as f64;
        high - (high - low) * x * x * (3.0 - 2.0 * x)
    };
    let rate = |h: f64| heights.density(h) / heights.below(h).max(f64::MIN_POSITIVE);
    let (mut depth, mut sum, mut before) = (0.0, 0.0, 0.0);
    for i in 0..STEPS {
        let (top, bottom) = (height(i), height(i + 1));
        let (step, middle) = (top - bottom, 0.5 * (top + bottom));
        // Simpson's rule for the depth, at the middle and at the bottom.
        let (a, b, c) = (rate(top), rate(middle), rate(bottom));
        let next = depth + step / 6.0 * (a + 4.0 * b + c);
        let half = (depth + step / 24.0 * (5.0 * a + 8.0 * b - c)).clamp(depth, next);
        depth = next;
        let at_middle = heights.density(middle) * (-lambda * half).exp();
        let at_bottom = heights.density(bottom) * (-lambda * depth).exp();
        if i == 0 {
            before = heights.density(top);
        }
        sum += step / 6.0 * (before + 4.0 * at_middle + at_bottom);
        before = at_bottom;
    }
    sum
}

/// The heights that rays start from.
const GAUSSIAN: (f64, f64) = (-7.0, 7.0);
const UNIFORM: (f64, f64) = (-1.0 + 1e-9, 1.0);

/// Statement 1.
pub fn one_direction<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let cases = effort.views_of_all();
    let areas = effort.sphere_of_all();
    let areas = areas.par_iter().map(|&(d, w)| {
        let name = format!("{}, cosθ {:.2}", d.name(), w.z);
        let exact = projected_area(model, d, w);
        Case::new(name, model.ndf(d).projected_area(w) / exact - 1.0)
    });
    let masked = cases.par_iter().flat_map_iter(|&(d, w)| {
        let rate = lambda(model, d, w).max(0.0);
        let masking = model.ndf(d).masking(w);
        [
            ("Gaussian", escapes(&Gaussian, GAUSSIAN, rate)),
            ("uniform", escapes(&Uniform, UNIFORM, rate)),
        ]
        .map(|(heights, escaped)| {
            let name = format!("{}, cosθ {:.2}, {heights} heights", d.name(), w.z);
            Case::new(name, masking / escaped - 1.0)
        })
    });
    let curves = |d: Distribution, color: usize| {
        let view = |degrees: f64| Vector3::spherical(degrees.to_radians().cos(), 0.0);
        let curve = (0..90)
            .map(f64::from)
            .map(|a| (a, model.ndf(d).masking(view(a))));
        let dots = (1..18).map(|i| 5.0 * f64::from(i)).map(|a| {
            let rate = lambda(model, d, view(a)).max(0.0);
            (a, escapes(&Gaussian, GAUSSIAN, rate))
        });
        [
            Series::new(d.name(), Mark::Line, curve).colored(color),
            Series::new("", Mark::Points, dots).colored(color),
        ]
    };
    let shown = shown_distributions();
    let figure = Chart {
        title: "Escape from random heights: G1 (lines) and quadrature (dots)".into(),
        x: Axis::linear("angle θ (°)").between(0.0, 90.0),
        y: Axis::linear("chance of no hit").between(0.0, 1.05),
        series: shown
            .into_iter()
            .enumerate()
            .flat_map(|(i, d)| curves(d, i))
            .collect(),
    };
    Ok(Statement {
        number: 1,
        title: "A ray from a random height escapes with probability G1",
        equation: "E[no hit in ω] = G1(ω) = 1 / (1 + Λ(ω))",
        checks: vec![
            Check::deviations(
                "σ(ω) against ∫ ⟨m·ω⟩ D(m) dm, ω on the whole sphere",
                QUADRATURE,
                areas.collect(),
            ),
            Check::deviations(
                "G1 against the escape through the heights, integrated",
                QUADRATURE,
                masked.collect(),
            ),
        ],
        figures: vec![figure.to_svg()?],
    })
}

/// Those that figures show.
pub fn shown_distributions() -> Vec<Distribution> {
    use smithwalk_model::{Beckmann, Ggx};
    vec![
        Distribution::Ggx(Ggx::isotropic(0.2)),
        Distribution::Ggx(Ggx::isotropic(1.0)),
        Distribution::Beckmann(Beckmann::isotropic(0.2)),
        Distribution::Beckmann(Beckmann::isotropic(1.0)),
        Distribution::Quadratic,
    ]
}

/// Statement 2.
pub fn two_directions<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let pairs = pairs(effort);
    let cases = pairs.par_iter().map(|&(d, (wi, wo))| {
        let ndf = model.ndf(d);
        let rate = lambda(model, d, wi) + lambda(model, d, wo);
        let closed = 1.0 / (1.0 + ndf.lambda(wi) + ndf.lambda(wo));
        let name = format!("{}, cosθ {:.2} and {:.2}", d.name(), wi.z, wo.z);
        Case::new(
            name,
            closed / escapes(&Gaussian, GAUSSIAN, rate.max(0.0)) - 1.0,
        )
    });
    let cases = cases.collect();
    let d = shown_distributions()[1];
    let wi = Vector3::spherical(0.5, 0.0);
    let ndf = model.ndf(d);
    let angles = || (0..18).map(|i| f64::from(5 * i));
    let towards = |degrees: f64| Vector3::spherical(degrees.to_radians().cos(), 2.0);
    let series = |name: &str, mark, f: &dyn Fn(f64) -> f64| {
        Series::new(name, mark, angles().map(|a| (a, f(a))))
    };
    let figure = Chart {
        title: format!("Escape in two directions at once, {}, θ_i = 60°", d.name()),
        x: Axis::linear("angle θ_o (°)").between(0.0, 90.0),
        y: Axis::linear("chance of no hit in either"),
        series: vec![
            series("1/(1 + Λ_i + Λ_o)", Mark::Line, &|a| {
                1.0 / (1.0 + ndf.lambda(wi) + ndf.lambda(towards(a)))
            }),
            series("integrated over heights", Mark::Points, &|a| {
                let rate = lambda(model, d, wi) + lambda(model, d, towards(a));
                escapes(&Gaussian, GAUSSIAN, rate.max(0.0))
            }),
            series("independent: G1 G1", Mark::Dashes, &|a| {
                ndf.masking(wi) * ndf.masking(towards(a))
            }),
        ],
    };
    Ok(Statement {
        number: 2,
        title: "Two rays from the same random height escape together",
        equation: "E[no hit in ω_i and ω_o] = 1 / (1 + Λ_i + Λ_o)",
        checks: vec![Check::deviations(
            "the closed form against the escape through Gaussian heights, integrated",
            QUADRATURE,
            cases,
        )],
        figures: vec![figure.to_svg()?],
    })
}

/// Where light comes from and goes to.
type Ends = (Vector3<f64>, Vector3<f64>);

/// Distributions with pairs of views.
fn pairs(effort: Effort) -> Vec<(Distribution, Ends)> {
    let views = effort.views();
    cross(&effort.distributions(), &cross(&views, &views))
}

/// Statement 3: the first order of a walk, over its phase function.
pub fn after_one_bounce<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let samples = effort.pick(4_000, 20_000);
    let measure = |d, wi: Vector3<f64>, wo: Vector3<f64>, index| {
        let surface = Microsurface {
            ndf: model.ndf(d),
            facets: model.diffuse(),
        };
        let mut rng = stream(3, index);
        let mut escaped = Mean::default();
        for _ in 0..samples {
            let mut orders = PerOrder::default();
            model.eval(&surface, Estimator::Walk, wi, wo, &mut rng, &mut orders);
            escaped.add(orders.0.first().map_or(0.0, |v| v.0[0]));
        }
        // Diffuse facets connect to every direction; their phase function by
        // quadrature, on normals that no sampler made.
        let ndf = model.ndf(d);
        let facets = model.diffuse();
        let at = At {
            side: Side::Above,
            w: wi,
            sigma: ndf.projected_area(wi),
        };
        let phase = Slopes::seen(d, wi).integrate(NODES, |m| {
            facets.phase(&ndf, at, wo, false, m).density * ndf.visible_density(wi, m)
        });
        (escaped, phase)
    };
    let expected = |d, wi, wo| {
        let (a, b) = (lambda(model, d, wi), lambda(model, d, wo));
        (1.0 + a) / (1.0 + a + b)
    };
    let pairs = pairs(effort);
    let cases = pairs
        .par_iter()
        .enumerate()
        .filter_map(|(i, &(d, (wi, wo)))| {
            let (escaped, phase) = measure(d, wi, wo, i);
            let name = format!("{}, cosθ {:.2} to {:.2}", d.name(), wi.z, wo.z);
            // Where hardly a facet faces both, a mean is a few samples.
            (phase > 5e-3).then(|| Case::new(name, escaped.score(phase * expected(d, wi, wo))))
        });
    let cases = cases.collect();
    let d = shown_distributions()[1];
    let wi = Vector3::spherical(0.5, 0.0);
    let angles = || (0..17).map(|i| 2.5 + 5.0 * f64::from(i));
    let towards = |degrees: f64| Vector3::spherical(degrees.to_radians().cos(), 2.0);
    let figure = Chart {
        title: format!("Escape after one bounce, {}, θ_i = 60°", d.name()),
        x: Axis::linear("angle θ_o (°)").between(0.0, 90.0),
        y: Axis::linear("chance to leave"),
        series: vec![
            Series::new(
                "(1 + Λ_i)/(1 + Λ_i + Λ_o)",
                Mark::Line,
                angles().map(|a| (a, expected(d, wi, towards(a)))),
            ),
            Series::new(
                "walks",
                Mark::Points,
                angles().enumerate().map(|(i, a)| {
                    let (escaped, phase) = measure(d, wi, towards(a), 1 << 20 | i);
                    (a, escaped.mean / phase, escaped.error() / phase)
                }),
            ),
        ],
    };
    Ok(Statement {
        number: 3,
        title: "After one bounce, the depth of the facet is that of the entry",
        equation: "E[no hit in ω_o | first facet from ω_i] = (1 + Λ_i) / (1 + Λ_i + Λ_o)",
        checks: vec![Check::scores(
            "order 1 of walks among diffuse facets against phase function times chance",
            cases,
        )],
        figures: vec![figure.to_svg()?],
    })
}

/// Statement 9.
pub fn weak_white_furnace<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let all = effort.views_of_all();
    let furnace = |d: Distribution, w: Vector3<f64>| {
        let ndf = model.ndf(d);
        let sum = Slopes::seen(d, w).integrate(NODES, |m| m.dot(w).max(0.0) * ndf.density(m));
        ndf.masking(w) * sum / w.z
    };
    let cases = all.par_iter().map(|&(d, w)| {
        let name = format!("{}, cosθ {:.2}", d.name(), w.z);
        Case::new(name, furnace(d, w) - 1.0)
    });
    let areas = effort.distributions();
    let areas = areas.par_iter().map(|&d| {
        let up = Vector3::new(0.0, 0.0, 1.0);
        let ndf = model.ndf(d);
        let area = Slopes::seen(d, up).integrate(NODES, |m| m.z * ndf.density(m));
        Case::new(d.name(), area - 1.0)
    });
    let (cases, areas) = (cases.collect(), areas.collect());
    let figure = Chart {
        title: "Weak white furnace: deviation from 1".into(),
        x: Axis::linear("angle θ (°)").between(0.0, 90.0),
        y: Axis::log("|∫ − 1|").between(1e-17, 1e-5),
        series: shown_distributions()
            .into_iter()
            .map(|d| {
                let points = (1..18).map(|i| {
                    let a = 5.0 * f64::from(i);
                    let w = Vector3::spherical(a.to_radians().cos(), 0.3);
                    (a, (furnace(d, w) - 1.0).abs().max(1e-16))
                });
                Series::new(d.name(), Mark::Both, points)
            })
            .collect(),
    };
    Ok(Statement {
        number: 9,
        title: "Weak white furnace: masked once, mirrors reflect all that they get",
        equation: "∫ G1(ω) ⟨m·ω⟩ D(m) / ω_z dm = 1",
        checks: vec![
            Check::deviations("the integral over visible normals", QUADRATURE, cases),
            Check::deviations("normalisation, ∫ m_z D(m) dm = 1", QUADRATURE, areas),
        ],
        figures: vec![figure.to_svg()?],
    })
}

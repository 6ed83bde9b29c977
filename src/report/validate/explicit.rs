//! Statements 10 and 11: the model against an explicit surface. The two depart
//! where correlation matters; they must not depart more than is known.

use super::ValidateError;
use crate::report::heightfield::{
    Config, Departure, HeightCase, LobeCase, PSI_BINS, outgoing_lobes, visible_heights,
};
use smithwalk_validation::plot::{Axis, Chart, Mark, PlotError, Series};
use smithwalk_validation::statistics::{FALSE_ALARM, sidak};
use smithwalk_validation::{Case, Check, Effort, Statement};

/// The distances of all cases, over what each may be.
fn check(subject: &str, departures: &[(String, Departure)]) -> Check {
    let each = sidak(departures.len());
    let cases = departures.iter().map(|(name, d)| {
        let name = format!("{name}: {:.4} ± {:.4}", d.value, d.error);
        // Where every ray must hit, neither the distance nor its bound is above 0.
        let excess = if d.value == 0.0 {
            0.0
        } else {
            d.value / d.bound(each)
        };
        Case::new(name, excess)
    });
    Check {
        statistic: "distance over bound",
        false_alarm: FALSE_ALARM,
        ..Check::deviations(subject, 1.0, cases.collect())
    }
}

fn config(effort: Effort) -> Config {
    effort.pick(
        Config {
            rays: 1_000,
            ..Config::quick()
        },
        Config::standard(),
    )
}

/// Statement 10.
pub fn heights(effort: Effort) -> Result<Statement, ValidateError> {
    let cases = visible_heights(&config(effort))?;
    let of = |quantity: fn(&HeightCase) -> Departure| {
        let named = |c: &HeightCase| {
            let name = format!("{}, α {:?}, d_z {:.2}", c.name, c.alpha, c.travel_z);
            (name, quantity(c))
        };
        cases.iter().map(named).collect::<Vec<_>>()
    };
    let figures: Result<_, _> = cases.iter().map(height_figure).collect();
    Ok(Statement {
        number: 10,
        title: "Visible heights are those of an explicit Gaussian surface, as far as known",
        equation: "C1(h) = e^{−τ}, τ the depth at which a ray collides at the rate σ(−d)/|d_z|",
        checks: vec![
            check("heights of hits (Kolmogorov–Smirnov)", &of(|c| c.heights)),
            check("share of rays that hit", &of(|c| c.reach)),
        ],
        figures: figures?,
    })
}

fn height_figure(case: &HeightCase) -> Result<String, PlotError> {
    let middle = |k: usize| 0.5 * (case.edges[k] + case.edges[k + 1]);
    let model = case.model.iter().enumerate();
    let surface = case.surface.iter().enumerate();
    Chart {
        title: format!(
            "Heights of hits, {}, α {:?}, d_z {:.2}",
            case.name, case.alpha, case.travel_z
        ),
        x: Axis::linear("height (RMS heights)"),
        y: Axis::linear("density (1/RMS height)"),
        series: vec![
            Series::new("model", Mark::Line, model.map(|(k, &v)| (middle(k), v))),
            Series::new(
                "explicit surface, ±1 SE",
                Mark::Points,
                surface.map(|(k, e)| (middle(k), e.value, e.error)),
            ),
        ],
    }
    .to_svg()
}

/// Statement 11.
pub fn lobes(effort: Effort) -> Result<Statement, ValidateError> {
    let cases = outgoing_lobes(&config(effort))?;
    let of = |quantity: fn(&LobeCase) -> Departure| {
        let named = |c: &LobeCase| (lobe_name(c), quantity(c));
        cases.iter().map(named).collect::<Vec<_>>()
    };
    let figures: Result<_, _> = cases.iter().map(lobe_figure).collect();
    Ok(Statement {
        number: 11,
        title: "Lobes by order are those of an explicit Gaussian surface, as far as known",
        equation: "share and direction of the light that met 1, 2, 3, … facets",
        checks: vec![
            check("shares of the orders (total variation)", &of(|c| c.shares)),
            check("directions of single scattering", &of(|c| c.single)),
            check("directions of multiple scattering", &of(|c| c.multiple)),
        ],
        figures: figures?,
    })
}

fn lobe_name(case: &LobeCase) -> String {
    format!(
        "{:?}, Beckmann α {:?}, cosθ {:.2}",
        case.facets, case.alpha, case.cos
    )
}

/// Orders 1 to 3, reflected and transmitted.
fn lobe_figure(case: &LobeCase) -> Result<String, PlotError> {
    let angle = |k: usize| -90.0 + 180.0 * (k as f64 + 0.5) / PSI_BINS as f64;
    let mut series = Vec::new();
    for lobe in case.lobes.iter().filter(|l| l.order <= 3) {
        let (side, first) = if lobe.transmitted {
            ("transmitted", 3)
        } else {
            ("reflected", 0)
        };
        let color = first + lobe.order - 1;
        let name = format!("{side}, order {}", lobe.order);
        let model = lobe.model.iter().enumerate();
        let surface = lobe.surface.iter().enumerate();
        let line = model.map(|(k, e)| (angle(k), e.value));
        let dots = surface.map(|(k, e)| (angle(k), e.value, e.error));
        series.push(Series::new(name, Mark::Line, line).colored(color));
        series.push(Series::new("", Mark::Points, dots).colored(color));
    }
    Chart {
        title: format!("{}: model (lines), surface (dots)", lobe_name(case)),
        x: Axis::linear("ψ, angle from ±z in the plane of incidence (°)"),
        y: Axis::linear("share of light (1/rad)"),
        series,
    }
    .to_svg()
}

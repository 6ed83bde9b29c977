//! Error curves as a chart.

use super::{Curve, Point};
use crate::report::plot::{Axis, Chart, Mark, Series};

/// How far the axis goes on after the last point, as a share of the way there,
/// to make room for the legend.
const ROOM: f64 = 0.45;

/// The palette's grey.
const GREY: usize = 6;

/// What errors are drawn against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abscissa {
    /// Samples per pixel.
    Samples,
    /// Wall-clock time, seconds.
    Wall,
    /// CPU time of all threads, seconds.
    Cpu,
}

impl Abscissa {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Samples, Self::Wall, Self::Cpu];

    /// Its value at a point.
    #[must_use]
    pub fn of(self, point: &Point) -> f64 {
        match self {
            Self::Samples => f64::from(point.spp),
            Self::Wall => point.wall_s,
            Self::Cpu => point.cpu_s,
        }
    }

    /// A word for file names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "spp",
            Self::Wall => "wall",
            Self::Cpu => "cpu",
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::Samples => "samples per pixel",
            Self::Wall => "wall-clock time (s)",
            Self::Cpu => "CPU time (s)",
        }
    }
}

/// Double-logarithmic curves; a dashed line in a curve's colour is an error
/// that stays: its bias. The reference's own noise is dashed as well.
#[must_use]
pub fn chart(title: &str, curves: &[Curve], abscissa: Abscissa) -> Chart {
    let mut series = Vec::new();
    let at = |p: &Point| abscissa.of(p);
    let ends = curves
        .iter()
        .flat_map(|curve| &curve.points)
        .map(at)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), x| {
            (low.min(x), high.max(x))
        });
    let level = |name: String, y: f64| Series::new(name, Mark::Dashes, [(ends.0, y), (ends.1, y)]);
    for (color, curve) in curves.iter().enumerate() {
        let points = curve
            .points
            .iter()
            .map(|p| (at(p), p.rel_mse, p.rel_mse_se.unwrap_or(0.0)));
        series.push(Series::new(curve.name.clone(), Mark::Both, points).colored(color));
        if let Some(bias) = curve.bias.filter(|&bias| bias > 0.0) {
            series.push(level(format!("bias of {}", curve.name), bias).colored(color));
        }
    }
    // Every biased estimator has a reference of its own, of about equal noise.
    let floor = curves
        .iter()
        .filter_map(|curve| curve.floor)
        .fold(0.0, f64::max);
    if floor > 0.0 {
        series.push(level("noise of the reference".to_owned(), floor).colored(GREY));
    }
    let mut x = Axis::log(abscissa.label());
    if ends.0 <= ends.1 {
        let (low, high) = (ends.0 / 1.2, ends.1 * 1.2);
        x = x.between(low, high * (high / low).powf(ROOM));
    }
    Chart {
        title: title.to_owned(),
        x,
        y: Axis::log("relative mean squared error"),
        series,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::converge::Run;

    #[test]
    fn curves_biases_and_the_floor_are_drawn() {
        let run = |name: &str, spp| Run {
            name: name.to_owned(),
            spp,
            seed: None,
            wall_s: f64::from(spp),
            cpu_s: 2.0 * f64::from(spp),
            rel_mse: 0.1 / f64::from(spp),
        };
        let mut curves = Curve::from_runs(&[run("two", 1), run("two", 4), run("one", 2)]);
        curves[0].floor = Some(1e-3);
        curves[1].bias = Some(2e-2);
        for abscissa in Abscissa::ALL {
            let svg = chart("A scene", &curves, abscissa).to_svg().unwrap();
            for text in ["two", "one", "bias of one", "noise of the reference"] {
                assert!(svg.contains(text), "{text} is missing");
            }
            assert!(svg.contains(abscissa.label()));
        }
    }
}

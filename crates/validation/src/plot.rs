//! Charts as SVG: lines, and points with error bars, on linear or logarithmic
//! axes.

use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::element::DashedPathElement;
use plotters::prelude::*;

/// Width and height of a chart without its legend, in pixels of the SVG's view
/// box.
const SIZE: (u32, u32) = (720, 420);

/// Colours that keep apart for colour-blind readers (Okabe and Ito 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];

/// The drawing of a chart failed.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the chart “{title}”: {reason}")]
pub struct PlotError {
    title: String,
    reason: String,
}

/// How values map to the length of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; values ≤ 0 are left out.
    Log,
}

/// One axis of a chart.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// What it shows, with the unit in brackets: `time (s)`.
    pub label: String,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// The values at its ends; `None` fits the data.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis that fits the data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            ..Self::default()
        }
    }

    /// A logarithmic axis that fits the data.
    pub fn log(label: impl Into<String>) -> Self {
        Self {
            scale: Scale::Log,
            ..Self::linear(label)
        }
    }

    /// The same with fixed ends.
    pub fn between(mut self, from: f64, to: f64) -> Self {
        self.range = Some((from, to));
        self
    }

    fn shows(&self, value: f64) -> bool {
        value.is_finite() && (self.scale == Scale::Linear || value > 0.0)
    }

    /// The ends, around all of `values` with some air.
    fn ends(&self, values: impl Iterator<Item = f64>) -> (f64, f64) {
        if let Some(range) = self.range {
            return range;
        }
        let (low, high) = values
            .filter(|&v| self.shows(v))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        match self.scale {
            _ if low > high => (0.1, 1.0),
            Scale::Log => (low / 1.3, high * 1.3),
            Scale::Linear => {
                let air = if high > low {
                    0.04 * (high - low)
                } else {
                    0.5 * high.abs().max(1e-3)
                };
                // An axis of positive values that starts near 0 starts there.
                let from = if low >= 0.0 && low < 0.3 * high {
                    0.0
                } else {
                    low - air
                };
                (from, high + air)
            }
        }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// A line through the points.
    #[default]
    Line,
    /// A dashed line: predictions and bounds.
    Dashes,
    /// Dots, with error bars where an error is given.
    Points,
    /// Both a line and dots.
    Both,
}

/// A point of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// In the unit of the x axis.
    pub x: f64,
    /// In the unit of the y axis.
    pub y: f64,
    /// Half the length of its error bar; 0 for none.
    pub error: f64,
}

impl From<(f64, f64)> for Point {
    fn from((x, y): (f64, f64)) -> Self {
        Self { x, y, error: 0.0 }
    }
}

impl From<(f64, f64, f64)> for Point {
    fn from((x, y, error): (f64, f64, f64)) -> Self {
        Self { x, y, error }
    }
}

/// Points of one kind, with a name in the legend.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Its name in the legend; empty for none.
    pub name: String,
    /// Points in the order in which a line runs through them.
    pub points: Vec<Point>,
    /// How they are drawn.
    pub mark: Mark,
    /// Which of the palette's colours it has; `None` for the next one.
    pub color: Option<usize>,
}

impl Series {
    /// A series of `points`.
    pub fn new<P: Into<Point>>(
        name: impl Into<String>,
        mark: Mark,
        points: impl IntoIterator<Item = P>,
    ) -> Self {
        Self {
            name: name.into(),
            points: points.into_iter().map(Into::into).collect(),
            mark,
            color: None,
        }
    }

    /// The colour of the series that is number `index` of its chart.
    fn color(&self, index: usize) -> RGBColor {
        COLORS[self.color.unwrap_or(index) % COLORS.len()]
    }

    /// The same in the palette's colour `index`.
    pub fn colored(mut self, index: usize) -> Self {
        self.color = Some(index);
        self
    }
}

/// A chart.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, the first at the bottom.
    pub series: Vec<Series>,
}

impl Chart {
    /// The chart as an SVG document.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let points = || self.series.iter().flat_map(|s| &s.points);
        let (x0, x1) = self.x.ends(points().map(|p| p.x));
        let (y0, y1) = self
            .y
            .ends(points().flat_map(|p| [p.y - p.error, p.y + p.error]));
        let log = |from: f64, to: f64| (from..to).log_scale();
        match (self.x.scale, self.y.scale) {
            (Scale::Linear, Scale::Linear) => self.draw(x0..x1, y0..y1),
            (Scale::Linear, Scale::Log) => self.draw(x0..x1, log(y0, y1)),
            (Scale::Log, Scale::Linear) => self.draw(log(x0, x1), y0..y1),
            (Scale::Log, Scale::Log) => self.draw(log(x0, x1), log(y0, y1)),
        }
        .map_err(|reason| PlotError {
            title: self.title.clone(),
            reason: reason.to_string(),
        })
    }

    /// Room for the names of the series, in pixels: a letter of the legend's
    /// font is about 7 wide.
    fn legend_width(&self) -> u32 {
        let names = self.series.iter().map(|s| s.name.chars().count());
        match names.max() {
            None | Some(0) => 0,
            Some(longest) => 40 + 7 * longest as u32,
        }
    }

    fn draw<X, Y>(&self, x: X, y: Y) -> Result<String, Box<dyn std::error::Error>>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut svg = String::new();
        {
            let size = (SIZE.0 + self.legend_width(), SIZE.1);
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            area.fill(&WHITE)?;
            let mut chart = ChartBuilder::on(&area)
                .caption(&self.title, ("sans-serif", 18))
                .margin(12)
                .margin_right(16 + self.legend_width())
                .x_label_area_size(46)
                .y_label_area_size(70)
                .build_cartesian_2d(x, y)?;
            chart
                .configure_mesh()
                .x_desc(&self.x.label)
                .y_desc(&self.y.label)
                .x_label_formatter(&|v| tick(*v))
                .y_label_formatter(&|v| tick(*v))
                .label_style(("sans-serif", 13))
                .axis_desc_style(("sans-serif", 15))
                .light_line_style(TRANSPARENT)
                .bold_line_style(BLACK.mix(0.12))
                .draw()?;
            for (index, series) in self.series.iter().enumerate() {
                let color = series.color(index);
                let style = color.stroke_width(2);
                let shown = || {
                    let points = series.points.iter();
                    points.filter(|p| self.x.shows(p.x) && self.y.shows(p.y))
                };
                let line = || shown().map(|p| (p.x, p.y));
                let mark = series.mark;
                if mark == Mark::Dashes {
                    chart.draw_series(DashedLineSeries::new(line(), 6, 4, style))?;
                }
                if matches!(mark, Mark::Line | Mark::Both) {
                    chart.draw_series(LineSeries::new(line(), style))?;
                }
                if matches!(mark, Mark::Points | Mark::Both) {
                    chart.draw_series(shown().filter(|p| p.error > 0.0).map(|p| {
                        // On a logarithmic axis a bar that passes 0 has no end.
                        let low = p.y - p.error;
                        let low = if self.y.shows(low) { low } else { p.y };
                        ErrorBar::new_vertical(p.x, low, p.y, p.y + p.error, color.filled(), 6)
                    }))?;
                    chart.draw_series(line().map(|p| Circle::new(p, 3, color.filled())))?;
                }
            }
            // The legend stands beside the chart, where it hides nothing.
            let named = self.series.iter().enumerate();
            let named = named.filter(|(_, s)| !s.name.is_empty());
            for (row, (index, series)) in named.enumerate() {
                let color = series.color(index);
                let style = color.stroke_width(2);
                let (x, y) = (SIZE.0 as i32, 54 + 20 * row as i32);
                let ends = [(x, y), (x + 24, y)];
                match series.mark {
                    Mark::Dashes => {
                        area.draw(&DashedPathElement::new(ends, 6, 4, style))?;
                    }
                    Mark::Line | Mark::Both => area.draw(&PathElement::new(ends, style))?,
                    Mark::Points => {}
                }
                if matches!(series.mark, Mark::Points | Mark::Both) {
                    area.draw(&Circle::new((x + 12, y), 3, color.filled()))?;
                }
                let font = ("sans-serif", 13);
                area.draw(&Text::new(series.name.clone(), (x + 30, y - 6), font))?;
            }
            area.present()?;
        }
        Ok(svg)
    }
}

/// A number as short as it can be read.
fn tick(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.0e}");
    }
    // Six digits hide the rounding of ticks that are sums of steps.
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.1 + 0.2, "0.3"),
            (-2.0, "-2"),
            (1e-4, "1e-4"),
            (120000.0, "1e5"),
        ] {
            assert_eq!(tick(value), text);
        }
    }

    #[test]
    fn a_chart_names_its_axes_and_series() {
        for (x, y) in [
            (Axis::linear("angle (°)"), Axis::linear("albedo")),
            (Axis::log("time (s)"), Axis::log("error")),
            (Axis::log("time (s)"), Axis::linear("albedo")),
            (Axis::linear("angle (°)"), Axis::log("error")),
        ] {
            let labels = [x.label.clone(), y.label.clone()];
            let chart = Chart {
                title: "What is <shown>".into(),
                x,
                y,
                series: vec![
                    Series::new("measured", Mark::Points, [(1.0, 2.0, 0.1), (2.0, 0.0, 0.3)]),
                    Series::new("predicted", Mark::Dashes, [(1.0, 2.0), (2.0, 3.0)]),
                    Series::new("fit", Mark::Both, [(1.0, f64::NAN), (2.0, 3.0)]),
                ],
            };
            let svg = chart.to_svg().unwrap();
            for text in [&labels[0], &labels[1], "measured", "predicted", "fit"] {
                assert!(svg.contains(text), "{text} is missing");
            }
            assert!(svg.contains("&lt;shown&gt;") && !svg.contains("NaN"));
        }
    }

    #[test]
    fn an_empty_chart_is_drawn() {
        assert!(Chart::default().to_svg().unwrap().contains("<svg"));
    }
}

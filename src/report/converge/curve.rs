//! From single runs to curves, slopes and times.

use serde::Serialize;

use super::{Run, Tails};

/// The mean over all runs with one number of samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Samples per pixel.
    pub spp: u32,
    /// How many runs.
    pub runs: usize,
    /// Wall-clock time, seconds.
    pub wall_s: f64,
    /// CPU time, seconds.
    pub cpu_s: f64,
    /// Relative mean squared error, the reference's own noise subtracted.
    pub rel_mse: f64,
    /// Standard error of that, from the spread of the runs; null for one.
    pub rel_mse_se: Option<f64>,
}

/// ln y = intercept + slope · ln x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// −1 where the error falls like one over the samples.
    pub slope: f64,
    /// ln y at x = 1.
    pub intercept: f64,
}

impl Fit {
    /// Least squares through the logarithms; `None` for fewer than two
    /// different x.
    pub fn through(points: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let logs: Vec<_> = points.into_iter().map(|(x, y)| (x.ln(), y.ln())).collect();
        let n = logs.len() as f64;
        let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
        let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
        let spread: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        let slope = logs
            .iter()
            .map(|p| (p.0 - mean_x) * (p.1 - mean_y))
            .sum::<f64>()
            / spread;
        (spread > 0.0).then_some(Self {
            slope,
            intercept: mean_y - slope * mean_x,
        })
    }

    /// The x at which it reaches `y`.
    #[must_use]
    pub fn solve(&self, y: f64) -> f64 {
        ((y.ln() - self.intercept) / self.slope).exp()
    }
}

/// What it takes to get down to an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reach {
    /// Seconds, or samples per pixel.
    pub at: f64,
    /// Whether that lies outside of what was measured.
    pub extrapolated: bool,
}

/// Slopes above this are no convergence worth going on with.
const FLAT: f64 = -0.5;

/// The error of one renderer or estimator, by samples and time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Its name.
    pub name: String,
    /// By growing numbers of samples.
    pub points: Vec<Point>,
    /// Relative mean squared error that its reference's noise adds to what
    /// was measured, and that is subtracted from it; null if unknown.
    pub floor: Option<f64>,
    /// For estimators of something else than the model: the relative mean
    /// squared error that no number of samples takes away.
    pub bias: Option<f64>,
    /// Of single samples.
    pub tails: Option<Tails>,
}

impl Curve {
    /// The runs of each name, in the order of their first appearance.
    #[must_use]
    pub fn from_runs(runs: &[Run]) -> Vec<Self> {
        let mut curves: Vec<(Self, Vec<&Run>)> = Vec::new();
        for run in runs {
            match curves.iter_mut().find(|(curve, _)| curve.name == run.name) {
                Some((_, of_name)) => of_name.push(run),
                None => {
                    let curve = Self {
                        name: run.name.clone(),
                        points: Vec::new(),
                        floor: None,
                        bias: None,
                        tails: None,
                    };
                    curves.push((curve, vec![run]));
                }
            }
        }
        curves
            .into_iter()
            .map(|(mut curve, mut runs)| {
                runs.sort_by_key(|run| run.spp);
                curve.points = runs.chunk_by(|a, b| a.spp == b.spp).map(mean).collect();
                curve
            })
            .collect()
    }

    /// The points that stand out of the reference's noise.
    fn usable(&self) -> impl Iterator<Item = &Point> {
        let floor = self.floor.unwrap_or(0.0);
        self.points
            .iter()
            .filter(move |p| p.rel_mse > floor.max(0.0))
    }

    /// A line through the points above the floor, against what `x` picks.
    pub fn fit(&self, x: impl Fn(&Point) -> f64) -> Option<Fit> {
        Fit::through(self.usable().map(|p| (x(p), p.rel_mse)))
    }

    /// Where the relative mean squared error has come down to `target`:
    /// between two points, else by the fitted line. `None` where the curve does
    /// not get there.
    pub fn reach(&self, target: f64, x: impl Fn(&Point) -> f64) -> Option<Reach> {
        let points: Vec<&Point> = self.usable().collect();
        let crossing = points
            .windows(2)
            .find(|pair| pair[0].rel_mse >= target && pair[1].rel_mse <= target);
        if let Some(pair) = crossing {
            let line = Fit::through(pair.iter().map(|p| (x(p), p.rel_mse)))?;
            let at = if line.slope == 0.0 {
                x(pair[0])
            } else {
                line.solve(target)
            };
            return Some(Reach {
                at,
                extrapolated: false,
            });
        }
        let fit = self.fit(x).filter(|fit| fit.slope < FLAT)?;
        Some(Reach {
            at: fit.solve(target),
            extrapolated: true,
        })
    }

    /// Relative mean squared error × CPU seconds at the last point, seconds:
    /// what an estimator costs, however long it runs. Less is better.
    pub fn cost(&self) -> Option<f64> {
        self.points.last().map(|p| p.rel_mse * p.cpu_s)
    }
}

fn mean(runs: &[&Run]) -> Point {
    let n = runs.len() as f64;
    let average = |pick: fn(&Run) -> f64| runs.iter().map(|run| pick(run)).sum::<f64>() / n;
    let rel_mse = average(|run| run.rel_mse);
    let squares: f64 = runs.iter().map(|r| (r.rel_mse - rel_mse).powi(2)).sum();
    Point {
        spp: runs[0].spp,
        runs: runs.len(),
        wall_s: average(|run| run.wall_s),
        cpu_s: average(|run| run.cpu_s),
        rel_mse,
        rel_mse_se: (runs.len() > 1).then(|| (squares / (n - 1.0) / n).sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(name: &str, spp: u32, seed: u64, rel_mse: f64) -> Run {
        Run {
            name: name.to_owned(),
            spp,
            seed: Some(seed),
            wall_s: 0.5 * f64::from(spp),
            cpu_s: f64::from(spp),
            rel_mse,
        }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9 * b.abs()
    }

    /// Errors 0.1 · spp^−1.2.
    fn falling() -> Curve {
        let runs: Vec<Run> = [1, 2, 4, 8]
            .map(|spp| run("a", spp, 1, 0.1 * f64::from(spp).powf(-1.2)))
            .into();
        Curve::from_runs(&runs).remove(0)
    }

    #[test]
    fn slopes_and_times_of_a_power_law() {
        let curve = falling();
        let fit = curve.fit(|p| f64::from(p.spp)).unwrap();
        assert!(close(fit.slope, -1.2) && close(fit.intercept.exp(), 0.1));
        let inside = curve.reach(0.1 * 3_f64.powf(-1.2), |p| p.wall_s).unwrap();
        assert!(close(inside.at, 1.5) && !inside.extrapolated, "{inside:?}");
        let outside = curve.reach(0.1 * 100_f64.powf(-1.2), |p| p.cpu_s).unwrap();
        assert!(close(outside.at, 100.0) && outside.extrapolated);
        assert!(close(curve.cost().unwrap(), 0.8 * 8_f64.powf(-1.2)));
    }

    #[test]
    fn points_below_the_floor_do_not_count() {
        let mut curve = falling();
        curve.points[3].rel_mse = 1e-9;
        assert!(curve.fit(|p| p.cpu_s).unwrap().slope < -2.0);
        curve.floor = Some(1e-3);
        assert!(close(curve.fit(|p| p.cpu_s).unwrap().slope, -1.2));
    }

    #[test]
    fn a_flat_curve_gets_nowhere() {
        let mut curve = falling();
        curve.points.iter_mut().for_each(|p| p.rel_mse = 0.02);
        assert_eq!(curve.reach(0.01, |p| p.wall_s), None);
        assert!(Fit::through([(1.0, 2.0), (1.0, 3.0)]).is_none());
        assert!(Fit::through([]).is_none());
    }

    #[test]
    fn runs_are_averaged_by_name_and_samples() {
        let runs = [
            run("b", 2, 1, 0.3),
            run("a", 1, 1, 0.5),
            run("b", 1, 1, 0.4),
            run("b", 2, 2, 0.1),
        ];
        let curves = Curve::from_runs(&runs);
        let names: Vec<_> = curves.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["b", "a"]);
        let [one, two] = curves[0].points[..] else {
            panic!("{curves:?}")
        };
        assert_eq!((one.spp, one.runs, one.rel_mse_se), (1, 1, None));
        assert_eq!((two.spp, two.runs), (2, 2));
        assert!(close(two.rel_mse, 0.2) && close(two.rel_mse_se.unwrap(), 0.1));
    }
}

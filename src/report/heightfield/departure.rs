//! How far measured distributions are from predicted ones, and how well that
//! is known.

use std::f64::consts::FRAC_2_PI;

use statrs::distribution::{ContinuousCDF, StudentsT};

/// A mean over independent batches, with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub value: f64,
    /// Its standard error, from the spread of the batches.
    pub error: f64,
}

impl Estimate {
    /// From one value for each batch, of which there must be two.
    pub(super) fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let (count, sum) = values
            .clone()
            .fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
        let value = sum / count;
        let squares: f64 = values.map(|v| (v - value).powi(2)).sum();
        Self {
            value,
            error: (squares / (count - 1.0) / count).sqrt(),
        }
    }
}

/// The distance between two distributions of which the difference, bin by
/// bin, is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Distance {
    /// ½ Σ |d|: the share that would have to move to another bin.
    TotalVariation,
    /// Kolmogorov and Smirnov's: the largest difference of the distribution
    /// functions.
    Kolmogorov,
}

impl Distance {
    fn of(self, difference: &[f64]) -> f64 {
        match self {
            Self::TotalVariation => 0.5 * difference.iter().map(|d| d.abs()).sum::<f64>(),
            Self::Kolmogorov => running(difference).fold(0.0, |most, sum| sum.abs().max(most)),
        }
    }

    /// What noise alone makes of the distance between equal distributions.
    fn noise(self, batches: &[Vec<f64>]) -> f64 {
        let bins = batches[0].len();
        match self {
            // E|z| = √(2/π) for every bin.
            Self::TotalVariation => (0..bins)
                .map(|bin| {
                    0.5 * FRAC_2_PI.sqrt() * Estimate::of(batches.iter().map(|b| b[bin])).error
                })
                .sum(),
            // The mean of the supremum of a Brownian bridge is √(π/2) ln 2,
            // and its largest standard deviation ½.
            Self::Kolmogorov => {
                let sums: Vec<Vec<f64>> = batches.iter().map(|b| running(b).collect()).collect();
                let error = (0..bins)
                    .map(|bin| Estimate::of(sums.iter().map(|s| s[bin])).error)
                    .fold(0.0, f64::max);
                2.0 * error * FRAC_2_PI.sqrt().recip() * std::f64::consts::LN_2
            }
        }
    }
}

fn running(values: &[f64]) -> impl Iterator<Item = f64> + '_ {
    values.iter().scan(0.0, |sum, d| {
        *sum += d;
        Some(*sum)
    })
}

/// The distance of the explicit surface from the model in one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure {
    /// The distance, dimensionless: 0 where the two agree, at most 1.
    pub value: f64,
    /// Its standard error: the jackknife over batches, each of which is one
    /// realisation of the surface and one share of the model's walks.
    pub error: f64,
    /// The distance that noise alone gives. `value` − `noise` is an estimate
    /// of the departure from below.
    pub noise: f64,
    /// The departure that was found with long runs: see
    /// `docs/explicit-surface.md`.
    pub tabulated: f64,
    /// Number of batches.
    pub batches: usize,
}

impl Departure {
    /// `differences[b]` is surface minus model, bin by bin, of batch b ≥ 2.
    pub(super) fn new(differences: &[Vec<f64>], distance: Distance, tabulated: f64) -> Self {
        let count = differences.len() as f64;
        let mut sum = vec![0.0; differences[0].len()];
        for batch in differences {
            for (sum, d) in sum.iter_mut().zip(batch) {
                *sum += d;
            }
        }
        let mean: Vec<f64> = sum.iter().map(|s| s / count).collect();
        let without: Vec<f64> = differences
            .iter()
            .map(|batch| {
                let rest: Vec<f64> = sum
                    .iter()
                    .zip(batch)
                    .map(|(s, d)| (s - d) / (count - 1.0))
                    .collect();
                distance.of(&rest)
            })
            .collect();
        Self {
            value: distance.of(&mean),
            error: (count - 1.0) * Estimate::of(without.iter().copied()).error,
            noise: distance.noise(differences),
            tabulated,
            batches: differences.len(),
        }
    }

    /// The largest value that a departure of `tabulated` explains: a run
    /// passes it with a chance of at most `false_alarm`.
    #[must_use]
    pub fn bound(&self, false_alarm: f64) -> f64 {
        let freedom = self.batches as f64 - 1.0;
        let quantile = StudentsT::new(0.0, 1.0, freedom)
            .map_or(f64::NAN, |t| t.inverse_cdf(1.0 - false_alarm));
        self.tabulated + self.noise + quantile * self.error
    }

    /// Whether the departure is no larger than the tabulated one, as far as
    /// the run can tell. False when anything is not a number.
    #[must_use]
    pub fn holds(&self, false_alarm: f64) -> bool {
        self.value <= self.bound(false_alarm)
    }
}

#[cfg(test)]
mod tests {
    use super::super::field::stream;
    use super::*;
    use smithwalk_model::Draw;

    /// Batches of `bins` differences: `offset` plus uniform noise.
    fn batches(count: usize, offset: &[f64], noise: f64, seed: u64) -> Vec<Vec<f64>> {
        let mut rng = stream(seed, 0);
        (0..count)
            .map(|_| {
                offset
                    .iter()
                    .map(|o| {
                        let u: f64 = rng.draw();
                        o + noise * (2.0 * u - 1.0)
                    })
                    .collect()
            })
            .collect()
    }

    #[test]
    fn distances_of_known_differences() {
        let d = [0.1, -0.05, 0.1, -0.15];
        assert!((Distance::TotalVariation.of(&d) - 0.2).abs() < 1e-15);
        assert!((Distance::Kolmogorov.of(&d) - 0.15).abs() < 1e-15);
    }

    #[test]
    fn noise_alone_is_called_noise() {
        let zero = [0.0; 40];
        let mut excess = 0.0;
        for seed in 0..50 {
            let d = Departure::new(
                &batches(16, &zero, 0.01, seed),
                Distance::TotalVariation,
                0.0,
            );
            assert!(d.holds(1e-4), "{d:?}");
            excess += (d.value / d.noise - 1.0) / 50.0;
        }
        // One ratio has a standard deviation of √(π/2 − 1)/√40 = 0.12.
        assert!(excess.abs() < 5.0 * 0.12 / 50f64.sqrt(), "{excess}");
    }

    #[test]
    fn a_departure_is_found_and_its_error_is_right() {
        let mut offset = [0.02; 10];
        offset[5..].fill(-0.02);
        let values: Vec<Departure> = (0..50)
            .map(|seed| {
                let batches = batches(16, &offset, 0.01, seed);
                Departure::new(&batches, Distance::Kolmogorov, 0.05)
            })
            .collect();
        assert!(values.iter().all(|d| !d.holds(1e-4)));
        let mean = Estimate::of(values.iter().map(|d| d.value));
        let claimed = values.iter().map(|d| d.error).sum::<f64>() / 50.0;
        let seen = mean.error * 50f64.sqrt();
        // Both have a relative error of 1/√100 and less.
        assert!((claimed / seen - 1.0).abs() < 0.5, "{claimed} {seen}");
    }
}

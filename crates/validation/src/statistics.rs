//! Means, scores, χ², and quadrature.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// The chance that a check of a correct model fails.
pub const FALSE_ALARM: f64 = 1e-4;

/// The chance that each of `count` independent comparisons may have of failing,
/// so that all of them together have [`FALSE_ALARM`] (Šidák 1967).
pub fn sidak(count: usize) -> f64 {
    -((-FALSE_ALARM).ln_1p() / count.max(1) as f64).exp_m1()
}

/// The largest |z| that `count` independent normal scores may reach.
pub fn worst_score(count: usize) -> f64 {
    -Normal::standard().inverse_cdf(0.5 * sidak(count))
}

/// The same for scores with Student's distribution of `freedom` degrees.
pub fn worst_student(count: usize, freedom: f64) -> f64 {
    let t = StudentsT::new(0.0, 1.0, freedom).expect("a positive number of degrees");
    -t.inverse_cdf(0.5 * sidak(count))
}

/// A mean and its standard error, by Welford's recurrence.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    count: f64,
    /// The mean of what was added.
    pub mean: f64,
    squares: f64,
}

impl Mean {
    /// Adds a value.
    pub fn add(&mut self, x: f64) {
        self.count += 1.0;
        let d = x - self.mean;
        self.mean += d / self.count;
        self.squares += d * (x - self.mean);
    }

    /// The standard error; never below what rounding does to a constant.
    pub fn error(&self) -> f64 {
        let variance = self.squares / (self.count - 1.0).max(1.0);
        (variance / self.count)
            .sqrt()
            .max(1e-12 * self.mean.abs())
            .max(f64::MIN_POSITIVE)
    }

    /// Standard scores between this and an exact value.
    pub fn score(&self, exact: f64) -> f64 {
        (self.mean - exact) / self.error()
    }

    /// Standard scores between two estimates.
    pub fn score_against(&self, other: &Self) -> f64 {
        (self.mean - other.mean) / self.error().hypot(other.error())
    }

    /// The mean of the values times `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            count: self.count,
            mean: self.mean * factor,
            squares: self.squares * factor * factor,
        }
    }
}

/// The fewest counts that a cell of a χ² test expects; smaller ones are
/// pooled, so that counts are near enough to normal.
const LEAST_EXPECTED: f64 = 10.0;

/// p-value of Pearson's χ² of `seen` against `expected` counts, with pooled
/// small cells. Cells that expect nothing at all count as pooled ones.
pub fn chi_square(seen: &[f64], expected: &[f64]) -> f64 {
    let (mut sum, mut cells, mut pool) = (0.0, 0.0, (0.0, 0.0));
    for (&o, &e) in seen.iter().zip(expected) {
        if e < LEAST_EXPECTED {
            pool = (pool.0 + o, pool.1 + e);
        } else {
            sum += (o - e).powi(2) / e;
            cells += 1.0;
        }
    }
    if pool.0 > 0.0 || pool.1 > 0.0 {
        // A pool that stays small is still wrong when it has far more than
        // expected; below the least expectation the term only gets weaker.
        sum += (pool.0 - pool.1).powi(2) / pool.1.max(LEAST_EXPECTED);
        cells += 1.0;
    }
    if cells < 2.0 || !sum.is_finite() {
        return if sum.is_finite() && sum < 50.0 {
            1.0
        } else {
            0.0
        };
    }
    ChiSquared::new(cells - 1.0)
        .expect("at least one degree of freedom")
        .sf(sum)
}

/// Nodes and weights of Gauss–Legendre quadrature on [0, 1], by Newton's
/// method on the Legendre polynomial (Abramowitz and Stegun 1964, 25.4.29).
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut p, mut before) = (1.0, 0.0);
                for k in 0..n {
                    let k = k as f64;
                    (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 * (x + 1.0), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_of_the_tables() {
        // Two-sided 1e-4, and a thousand comparisons that share it.
        assert!((worst_score(1) - 3.8906).abs() < 1e-4);
        assert!((worst_score(1000) - 5.3267).abs() < 1e-3);
        assert!(worst_student(10, 31.0) > worst_score(10));
    }

    #[test]
    fn chi_square_sees_a_shift_and_no_more() {
        let expected = [100.0, 200.0, 300.0, 3.0, 4.0];
        assert!(chi_square(&[104.0, 195.0, 301.0, 2.0, 5.0], &expected) > 0.5);
        assert!(chi_square(&[160.0, 140.0, 300.0, 3.0, 4.0], &expected) < 1e-8);
        assert!(chi_square(&[100.0, 200.0, 300.0, 60.0, 4.0], &expected) < 1e-8);
    }

    #[test]
    fn quadrature_is_exact_for_polynomials() {
        let sum: f64 = gauss(6).iter().map(|(x, w)| w * x.powi(11)).sum();
        assert!((sum - 1.0 / 12.0).abs() < 1e-14);
    }
}

//! Somebody's table of what rough surfaces do with light, judged row by row.

mod model;
mod table;

pub use table::{Claim, Facet, Normals, Quantity, TableProblem, read};

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use smithwalk_validation::points::REPLICATES;

/// A row, the model's value, and what to think of it.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The row.
    pub claim: Claim,
    /// The model's value.
    pub model: f64,
    /// The row's value less the model's.
    pub error: f64,
    /// The standard error of `error`: that of both sides, and what the row's value
    /// was rounded by.
    pub stderr: f64,
    /// `error` in standard errors, with Student's distribution of `freedom` degrees
    /// where nothing is wrong.
    pub score: f64,
    /// See `score` (Welch 1947).
    pub freedom: f64,
    /// The chance of a score as large where nothing is wrong.
    pub p: f64,
    /// Whether it is larger than chance and the tolerance explain.
    pub differs: bool,
}

/// The verdicts of a table.
#[derive(Clone, Debug)]
pub struct Verdicts {
    /// In the order of the table.
    pub rows: Vec<Verdict>,
    /// The chance that a table that is right fails: half of it shared by the rows
    /// (Šidák 1967), half for χ².
    pub false_alarm: f64,
    /// What rows may be off by, whatever the noise.
    pub tolerance: f64,
    /// Σ score², each made normal by its chance.
    pub chi_square: f64,
    /// The chance of as large a χ² where nothing is wrong.
    pub p: f64,
}

impl Verdicts {
    /// Judges a table: `samples` walks or evaluations of the model for each row.
    #[must_use]
    pub fn of(claims: Vec<Claim>, samples: u32, false_alarm: f64, tolerance: f64) -> Self {
        let each = -((0.5 * (-false_alarm).ln_1p()) / claims.len().max(1) as f64).exp_m1();
        let rows: Vec<Verdict> = claims
            .into_par_iter()
            .enumerate()
            .map(|(index, claim)| judged(claim, index, samples, each, tolerance))
            .collect();
        let normal = statrs::distribution::Normal::standard();
        // Chances below the smallest number stand for a score of 38.
        let squares = |v: &Verdict| normal.inverse_cdf((0.5 * v.p).max(1e-300)).powi(2);
        let chi_square: f64 = rows.iter().map(squares).sum();
        let p = ChiSquared::new(rows.len().max(1) as f64)
            .map_or(1.0, |distribution| distribution.sf(chi_square));
        Self {
            rows,
            false_alarm,
            tolerance,
            chi_square,
            p,
        }
    }

    /// How many rows differ.
    #[must_use]
    pub fn differing(&self) -> usize {
        self.rows.iter().filter(|row| row.differs).count()
    }

    /// Whether all rows together are off by more than noise, though none may be alone.
    #[must_use]
    pub fn differ_together(&self) -> bool {
        self.tolerance == 0.0 && self.p < -(0.5 * (-self.false_alarm).ln_1p()).exp_m1()
    }

    /// Whether the table is right as far as it can be told.
    #[must_use]
    pub fn conforms(&self) -> bool {
        self.differing() == 0 && !self.differ_together()
    }

    /// The row with the largest error.
    #[must_use]
    pub fn worst(&self) -> Option<&Verdict> {
        let largest = |a: &&Verdict, b: &&Verdict| a.error.abs().total_cmp(&b.error.abs());
        self.rows.iter().max_by(largest)
    }

    /// Root mean square of the errors.
    #[must_use]
    pub fn rms(&self) -> f64 {
        let squares: f64 = self.rows.iter().map(|row| row.error * row.error).sum();
        (squares / self.rows.len().max(1) as f64).sqrt()
    }
}

fn judged(claim: Claim, index: usize, samples: u32, each: f64, tolerance: f64) -> Verdict {
    let found = model::measure(&claim, index, samples);
    let error = claim.value - found.mean;
    let theirs = claim.stderr;
    let variances = [theirs, found.error(), claim.rounding].map(|e| e * e);
    let variance: f64 = variances.iter().sum();
    let stderr = variance.sqrt();
    let score = error / stderr;
    let freedoms = [claim.freedom, f64::from(REPLICATES - 1), f64::INFINITY];
    let weights = variances.iter().zip(freedoms).map(|(v, n)| v * v / n);
    let freedom = (variance * variance / weights.sum::<f64>()).min(1e6);
    let student = StudentsT::new(0.0, 1.0, freedom.max(1.0)).expect("a degree or more");
    let chance = |excess: f64| 2.0 * student.cdf(-excess / stderr);
    Verdict {
        model: found.mean,
        error,
        stderr,
        score,
        freedom,
        p: chance(error.abs()),
        differs: chance((error.abs() - tolerance).max(0.0)) < each,
        claim,
    }
}

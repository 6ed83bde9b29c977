//! Whether many differences from Cycles are noise.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::cycles::measured::{Glass, Mean, Metal, SETS};

impl Metal {
    /// What the row is, for messages.
    pub fn name(&self) -> String {
        let Self {
            distribution,
            roughness,
            anisotropy,
            rotation,
            cos,
            ..
        } = self;
        format!("{distribution} r {roughness} a {anisotropy} turned {rotation} cosθ {cos}")
    }
}

impl Glass {
    /// What the row is, for messages.
    pub fn name(&self) -> String {
        let Self {
            distribution,
            roughness,
            side,
            cos,
            ..
        } = self;
        format!("{distribution} r {roughness} {side} cosθ {cos}")
    }
}

impl Mean {
    /// Standard scores from 0.
    pub fn score(self) -> f64 {
        self.value.abs() / self.error
    }
}

/// The chance that one test's comparisons pass their bound though nothing is
/// wrong.
const FALSE_ALARM: f64 = 1e-4;

/// The score that `count` comparisons may reach (Šidák). Errors come from the
/// scatter of 16 values on either side, so scores have Student's distribution
/// of 15 to 30 degrees; the bound is that of 15, and nowhere too tight.
pub fn worst_score(count: usize) -> f64 {
    let each = -((-FALSE_ALARM).ln_1p() / count as f64).exp_m1();
    let student = StudentsT::new(0.0, 1.0, f64::from(SETS - 1)).expect("degrees of freedom");
    -student.inverse_cdf(0.5 * each)
}

/// The comparison of many differences with 0.
pub struct Summary {
    pub count: usize,
    /// The largest difference.
    pub worst: f64,
    /// The row it is in.
    worst_row: String,
    /// The largest score.
    pub score: f64,
    /// The mean of the squared scores: where nothing but noise is between the
    /// two 1.07 to 1.15 (Student), with a standard deviation of at most
    /// 1.84/√count. Tests ask for less than 1.5 of 330 and 660 rows, and 1.8
    /// of 60: 3.4 and 2.7 deviations, for fixed seeds and fixed tables.
    pub chi_square: f64,
    /// The largest standard error.
    error: f64,
}

impl Summary {
    pub fn of(differences: &[(String, Mean)]) -> Self {
        let most = |f: fn(&Mean) -> f64| differences.iter().map(|(_, d)| f(d)).fold(0.0, f64::max);
        let worst = most(|d| d.value.abs());
        let row = differences.iter().find(|(_, d)| d.value.abs() == worst);
        let squares: f64 = differences.iter().map(|(_, d)| d.score().powi(2)).sum();
        Self {
            count: differences.len(),
            worst,
            worst_row: row.map(|(name, _)| name.clone()).unwrap_or_default(),
            score: most(|d| d.score()),
            chi_square: squares / differences.len() as f64,
            error: most(|d| d.error),
        }
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} differences, largest {:.5} ({}), score {:.2}, χ²/n {:.2}, standard errors up to {:.1e}",
            self.count, self.worst, self.worst_row, self.score, self.chi_square, self.error
        )
    }
}

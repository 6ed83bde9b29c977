//! What a check finds, and what it says.

use super::statistics::{FALSE_ALARM, sidak, worst_score, worst_student};
use serde::Serialize;

/// A case of a check: what it was, and its statistic.
#[derive(Clone, Debug)]
pub struct Case {
    /// The configuration.
    pub name: String,
    /// The deviation, score or p-value.
    pub value: f64,
}

impl Case {
    /// A case of a check.
    pub fn new(name: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            value,
        }
    }
}

/// One quantity that is compared over a grid of cases.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is compared with what.
    pub subject: String,
    /// What is reported of it: a deviation, a score, or a p-value.
    pub statistic: &'static str,
    /// The limit that no case may pass.
    pub bound: f64,
    /// The chance that a correct model passes it somewhere; 0 for
    /// deterministic comparisons.
    pub false_alarm: f64,
    /// How many cases were compared.
    pub cases: usize,
    /// The statistic that is nearest to the bound, or farthest past it.
    pub worst: f64,
    /// The case it belongs to.
    pub worst_case: String,
    /// Whether no case is past the bound. No cases at all are no pass.
    pub passed: bool,
}

impl Check {
    /// Deterministic: no |value| is above `bound`.
    pub fn deviations(subject: impl Into<String>, bound: f64, cases: Vec<Case>) -> Self {
        Self::of(subject, "relative deviation", bound, 0.0, cases)
    }

    /// Normal scores of independent cases.
    pub fn scores(subject: impl Into<String>, cases: Vec<Case>) -> Self {
        let bound = worst_score(cases.len());
        Self::of(subject, "|z|", bound, FALSE_ALARM, cases)
    }

    /// Scores with Student's distribution of `freedom` degrees.
    pub fn student_scores(subject: impl Into<String>, freedom: f64, cases: Vec<Case>) -> Self {
        let bound = worst_student(cases.len(), freedom);
        Self::of(subject, "|t|", bound, FALSE_ALARM, cases)
    }

    /// p-values of χ² tests of independent cases: none is below the bound.
    pub fn p_values(subject: impl Into<String>, cases: Vec<Case>) -> Self {
        let bound = sidak(cases.len());
        // The smallest is the worst, and so is one that is no number.
        let worst = cases.iter().min_by(|a, b| {
            let key = |c: &Case| if c.value.is_nan() { -1.0 } else { c.value };
            key(a).total_cmp(&key(b))
        });
        Self {
            subject: subject.into(),
            statistic: "p of χ²",
            bound,
            false_alarm: FALSE_ALARM,
            cases: cases.len(),
            worst: worst.map_or(f64::NAN, |c| c.value),
            worst_case: worst.map_or(String::new(), |c| c.name.clone()),
            passed: worst.is_some_and(|c| c.value >= bound),
        }
    }

    fn of(
        subject: impl Into<String>,
        statistic: &'static str,
        bound: f64,
        false_alarm: f64,
        cases: Vec<Case>,
    ) -> Self {
        let worst = cases.iter().max_by(|a, b| {
            let key = |c: &Case| {
                if c.value.is_nan() {
                    f64::INFINITY
                } else {
                    c.value.abs()
                }
            };
            key(a).total_cmp(&key(b))
        });
        Self {
            subject: subject.into(),
            statistic,
            bound,
            false_alarm,
            cases: cases.len(),
            worst: worst.map_or(f64::NAN, |c| c.value.abs()),
            worst_case: worst.map_or(String::new(), |c| c.name.clone()),
            passed: worst.is_some_and(|c| c.value.abs() <= bound),
        }
    }
}

/// One of the statements that the model must satisfy.
#[derive(Clone, Debug, Serialize)]
pub struct Statement {
    /// Its number.
    pub number: u32,
    /// What holds, in words.
    pub title: &'static str,
    /// The same as a formula.
    pub equation: &'static str,
    /// The comparisons that test it.
    pub checks: Vec<Check>,
    /// Figures, as SVG documents.
    #[serde(skip)]
    pub figures: Vec<String>,
}

impl Statement {
    /// Whether all its checks have passed.
    pub fn passed(&self) -> bool {
        !self.checks.is_empty() && self.checks.iter().all(|c| c.passed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_fails() {
        let cases = || vec![Case::new("fine", 0.5), Case::new("broken", f64::NAN)];
        for check in [
            Check::deviations("", 1.0, cases()),
            Check::scores("", cases()),
            Check::p_values("", cases()),
        ] {
            assert!(!check.passed && check.worst_case == "broken");
        }
        assert!(!Check::scores("", Vec::new()).passed);
    }

    #[test]
    fn the_worst_case_decides() {
        let cases = |v| vec![Case::new("a", 0.1), Case::new("b", v)];
        assert!(Check::scores("", cases(-3.0)).passed);
        assert!(!Check::scores("", cases(-6.0)).passed);
        assert!(Check::p_values("", cases(1e-3)).passed);
        assert!(!Check::p_values("", cases(1e-6)).passed);
    }
}

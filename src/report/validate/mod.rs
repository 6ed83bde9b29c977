//! The validation of the microsurface model: statements that any Smith model
//! must satisfy, each tested over a grid of configurations, with its statistic,
//! its bound and the chance of a false alarm.
//!
//! All but 10 and 11, which need an explicit surface, are [`smithwalk_validation`].
//!
//! ```no_run
//! use smithwalk::report::validate::{Effort, validate};
//!
//! let report = validate(Effort::Quick, &mut |_| ())?;
//! assert!(report.passed());
//! std::fs::write("validate.html", report.to_html())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod explicit;
mod page;

pub use smithwalk_validation::{
    Case, Check, Effort, FALSE_ALARM, OrderRow, PrecisionRow, Smithwalk, Statement,
};

use super::heightfield::HeightFieldError;
use serde::Serialize;
use smithwalk_validation::plot::PlotError;
use smithwalk_validation::{STATEMENTS, orders, precision, statement};

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// A figure could not be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// The explicit surface could not be traced.
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
}

/// All that a validation found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The statements.
    pub statements: Vec<Statement>,
    /// f32 against f64.
    pub precision: Check,
    /// The same, quantity by quantity.
    pub precision_table: Vec<PrecisionRow>,
    /// The share of each scattering order.
    pub orders: Vec<OrderRow>,
    /// Lobes by order, as SVG documents.
    #[serde(skip)]
    pub lobes: Vec<String>,
    /// How long it all took, in seconds.
    pub seconds: f64,
}

impl Report {
    /// Whether every statement holds, and f32 is as good as demanded.
    pub fn passed(&self) -> bool {
        self.statements.iter().all(Statement::passed) && self.precision.passed
    }

    /// The report as one page of HTML, with its figures in it.
    pub fn to_html(&self) -> String {
        page::html(self)
    }

    /// The report as a table of text.
    pub fn to_text(&self) -> String {
        page::text(self)
    }
}

/// Tests everything; `progress` hears of each statement as it is done.
pub fn validate(
    effort: Effort,
    progress: &mut dyn FnMut(&Statement),
) -> Result<Report, ValidateError> {
    let start = std::time::Instant::now();
    let mut statements = Vec::new();
    for number in 1..=STATEMENTS {
        let found = match number {
            10 => explicit::heights(effort)?,
            11 => explicit::lobes(effort)?,
            _ => match statement(Smithwalk, effort, number) {
                Some(found) => found?,
                None => continue,
            },
        };
        progress(&found);
        statements.push(found);
    }
    let precision_table = precision::table(effort);
    Ok(Report {
        statements,
        precision: precision::check(&precision_table),
        precision_table,
        orders: orders::table(Smithwalk, effort),
        lobes: orders::lobes(Smithwalk, effort)?,
        seconds: start.elapsed().as_secs_f64(),
    })
}

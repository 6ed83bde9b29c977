//! The validation of the microsurface model: statements that any Smith model
//! must satisfy, each tested over a grid of configurations, with its statistic,
//! its bound and the chance of a false alarm.
//!
//! Deterministic statements are compared with quadrature over the normals
//! themselves, statistical ones by standard scores or χ² with a bound that
//! holds for all cases of a check together (Šidák). Seeds are fixed, so a
//! verdict is reproducible, and does not depend on the number of threads.
//!
//! The model under test is a [`Model`]: [`Smithwalk`], or a faulty one, to see
//! that the fault is found.
//!
//! ```no_run
//! use smithwalk::report::validate::{Effort, validate};
//!
//! let report = validate(Effort::Quick, &mut |_| ())?;
//! assert!(report.passed());
//! std::fs::write("validate.html", report.to_html())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod check;
mod closed;
mod escape;
mod explicit;
mod grid;
mod model;
mod orders;
mod page;
mod phases;
mod precision;
mod slopes;
mod statistics;
mod transport;

pub use check::{Case, Check, Statement};
pub use grid::Effort;
pub use model::{Distribution, Model, Rng, Smithwalk, stream, uniform};
pub use orders::OrderRow;
pub use precision::PrecisionRow;
pub use statistics::FALSE_ALARM;

use super::heightfield::HeightFieldError;
use super::plot::PlotError;
use serde::Serialize;

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

/// Tests one statement about `model`. `None` for 10 and 11, which [`validate`]
/// tests on an explicit surface, and for numbers that are none.
pub fn statement<M: Model>(
    model: M,
    effort: Effort,
    number: u32,
) -> Option<Result<Statement, PlotError>> {
    Some(match number {
        1 => escape::one_direction(model, effort),
        2 => escape::two_directions(model, effort),
        3 => escape::after_one_bounce(model, effort),
        4 => phases::normalised(model, effort),
        5 => phases::reciprocal(model, effort),
        6 => transport::white_furnace(model, effort),
        7 => transport::reciprocal(model, effort),
        8 => transport::single_scattering(model, effort),
        9 => escape::weak_white_furnace(model, effort),
        12 => closed::closed_form(model, effort),
        _ => return None,
    })
}

/// Tests everything; `progress` hears of each statement as it is done.
pub fn validate(
    effort: Effort,
    progress: &mut dyn FnMut(&Statement),
) -> Result<Report, ValidateError> {
    let start = std::time::Instant::now();
    let mut statements = Vec::new();
    for number in 1..=12 {
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

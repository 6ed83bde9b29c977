//! The statements that a Smith microsurface model must satisfy, each tested over a grid
//! of configurations, with its statistic, its bound and the chance of a false alarm.
//!
//! Deterministic statements are compared with quadrature over the normals
//! themselves, statistical ones by standard scores or χ² with a bound that
//! holds for all cases of a check together (Šidák). Seeds are fixed, so a
//! verdict is reproducible, and does not depend on the number of threads.
//!
//! The model under test is a [`Model`]: [`Smithwalk`], or a faulty one, to see
//! that the fault is found.
//!
//! ```
//! use smithwalk_validation::{Effort, Smithwalk, statement};
//!
//! let reciprocity = statement(Smithwalk, Effort::Quick, 5).expect("a statement")?;
//! assert!(reciprocity.passed());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod check;
mod closed;
mod escape;
mod grid;
mod model;
pub mod orders;
mod phases;
pub mod plot;
pub mod points;
pub mod precision;
mod second_order;
mod slopes;
pub mod statistics;
pub mod tables;
mod transport;

pub use check::{Case, Check, Statement};
pub use grid::Effort;
pub use model::{Distribution, Model, Rng, Smithwalk, stream, uniform};
pub use orders::OrderRow;
pub use precision::PrecisionRow;
pub use second_order::{pooled_lanes, second_order};
pub use statistics::FALSE_ALARM;

use plot::PlotError;

/// The number of the last statement.
pub const STATEMENTS: u32 = 13;

/// Tests one statement about `model`. `None` for 10 and 11, which are
/// about an explicit surface, and for numbers that are none.
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
        13 => second_order::against_quadrature(model, effort),
        _ => return None,
    })
}

//! Reports: what was measured, as tables, figures and pages.

pub mod plot;
pub mod validate;

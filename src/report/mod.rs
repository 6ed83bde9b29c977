//! Reports: what was measured, as tables, figures and pages.

pub mod converge;
pub mod heightfield;
pub mod plot;
pub mod validate;

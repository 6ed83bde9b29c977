//! Reports: what was measured, as tables, figures and pages.

pub mod conform;
pub mod converge;
pub mod heightfield;
pub mod validate;

pub use smithwalk_validation::plot;

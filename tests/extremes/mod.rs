//! The model at the edges of its domain, in both precisions and through the
//! closures of the renderer: everything finite and non-negative, energy kept,
//! walks that end, no jump where a formula changes; and faults, planted to see
//! that all this would be noticed.

mod calls;
mod closures;
mod continuity;
mod domain;
mod faults;
mod findings;
mod lanes;
mod means;
mod precision;

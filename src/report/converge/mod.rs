//! Error against samples, wall time and CPU time.
//!
//! Errors are relative mean squared errors as in [`crate::metrics`]: ε = 0.01,
//! the worst 0.1 % of the pixels left out. What the noise of the reference adds
//! is subtracted, and shown as a floor: points below it mean little.

mod chart;
mod curve;
mod measure;
mod peers;

pub use chart::{Abscissa, chart};
pub use curve::{Curve, Fit, Point, Reach};
pub use measure::{Plan, Reference, ReferenceError, Tails, View, measure};
pub use peers::{PeerError, read_peers};

use serde::{Deserialize, Serialize};

/// The error of one image after so many samples: a row of the CSV file.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Run {
    /// Renderer or estimator.
    pub name: String,
    /// Samples per pixel.
    pub spp: u32,
    /// Seed of the random numbers, where it is known.
    pub seed: Option<u64>,
    /// Wall-clock time of rendering, seconds.
    pub wall_s: f64,
    /// CPU time of all threads, seconds.
    pub cpu_s: f64,
    /// Relative mean squared error, without unit, the reference's own noise
    /// subtracted; that may leave less than nothing.
    pub rel_mse: f64,
}

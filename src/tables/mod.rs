//! Tables of a material's BSDF for other programs: over angles as npz and EXR, and
//! in the formats of measured materials, RGL's tensors and MERL's.
//!
//! All are of isotropic materials. Values are estimates, each with random numbers
//! of its own: the same for any number of threads.

mod angles;
mod estimate;
mod merl;
mod npz;
mod rgl;
mod warp;

pub use angles::{AngleTable, Angles};
pub use estimate::{Estimate, Moments, Source};
pub use merl::merl;
pub use rgl::{Rgl, rgl};

/// A material that a table of this kind does not exist for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TableError {
    /// A direction more than tables have.
    #[error(
        "tables are over three angles: expected a material that looks the same whichever way it is turned, found one with a tangent"
    )]
    Anisotropic,
    /// All of the light goes into single directions.
    #[error("all of this material's light goes into single directions: no table holds that")]
    Smooth,
    /// RGL and MERL have the upper hemisphere alone.
    #[error(
        "measured materials (.bsdf, .binary) reflect alone, and light goes through this one; .npz and .exr hold both"
    )]
    Transmits,
}

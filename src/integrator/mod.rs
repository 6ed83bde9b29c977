//! From a scene to a film: which paths are traced, by which kernel, until when.

mod kernel;
mod pass;
mod path;
mod render;
mod roulette;
mod split;

pub use kernel::{KERNELS, kernel_for};
pub use path::{FirstHit, PathResult, PathTracer};
pub use render::{Checkpoint, Control, Progress, RenderError, RenderReport, Stop, render};
pub use roulette::Survival;
pub use split::{Split, Spread};

//! From a scene to a film: which paths are traced, by which kernel, until when.

mod kernel;
mod path;
mod render;
mod sum;

pub use kernel::{KERNELS, kernel_for};
pub use path::{FirstHit, PathResult, PathTracer, Split};
pub use render::{Control, Progress, RenderError, RenderReport, Stop, begun, render};

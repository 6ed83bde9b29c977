//! Intel Embree 4 behind a safe interface, and Open Image Denoise: the only unsafe code
//! of the crate.
//!
//! A [`Device`] opens the library, [`Accelerator`] is a committed two-level
//! scene of triangle meshes and instances that answers [`Accelerator::intersect`]
//! and [`Accelerator::occluded`] from any number of threads.
//!
//! The bindings carry the headers of Embree 4.2. Since 4.3 the library's hit
//! record has one more field than theirs, which Embree writes; every hit that
//! is passed to it here is padded for that (see `ray.rs`).
#![allow(unsafe_code)]

mod accelerator;
mod device;
mod geometry;
mod oidn;
mod ray;
#[cfg(feature = "record-rays")]
mod record;

pub use accelerator::Accelerator;
pub use device::{Device, EmbreeError, instructions};
pub use geometry::{Geometry, SharedMesh, Structure, Vertices};
pub use oidn::{DenoiseError, Denoiser, Guides};
pub use ray::{Hit, Ray};
#[cfg(feature = "record-rays")]
pub use record::{Query, recorded};

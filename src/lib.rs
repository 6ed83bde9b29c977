//! Traces Blender scenes on Intel Embree and shades rough surfaces with the
//! multiple-scattering Smith microfacet BSDFs of Heitz, Hanika, d'Eon and
//! Dachsbacher (2016).
//!
//! # Data flow
//! ```text
//! scene.yaml + .obj → Description → resolve → Scene (+ Features) → Path<F> → Film → EXR/PNG + report
//! ```
//! Names, defaults and units end at `resolve`: what is rendered has indices
//! and radiometric quantities alone.
//!
//! # Axes and units
//! As in Blender: right-handed, z up, metres; degrees in files and radians in
//! code; colours are scene-linear Rec. 709.

pub mod bsdf;
pub mod camera;
pub mod color;
pub mod description;
pub mod embree;
pub mod features;
mod file;
pub mod film;
pub mod image;
pub mod integrator;
pub mod light;
pub mod memory;
pub mod mesh;
pub mod metrics;
pub mod numbered;
pub mod rays;
pub mod report;
pub mod sampler;
pub mod scene;
pub mod tables;
pub mod text;
pub mod texture;

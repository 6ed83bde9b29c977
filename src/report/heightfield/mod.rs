//! The model against an explicit surface (the validation of Heitz et al.
//! 2016, § 7, redone): a Gaussian random height field with Beckmann slopes,
//! meshed and ray-traced.
//!
//! The model takes heights and normals of neighbouring points to be
//! independent; on a real surface they are correlated. So the two agree only
//! as far as correlation does not matter, and this module measures how far
//! that is: [`visible_heights`] compares where rays hit, [`outgoing_lobes`]
//! where light goes, by scattering order. Each comparison has a [`Departure`]
//! with its standard error, and the departure that long runs found, which it
//! must not exceed. What was found, and that it is not the mesh's resolution
//! or the patch's size: `docs/explicit-surface.md`.
//!
//! Lengths are in units of the RMS height, directions in the local frame with
//! z up, and facets lose no energy, so that shares add up to 1.

mod departure;
mod field;
mod heights;
mod lobes;
mod trace;

use std::sync::Arc;

pub use departure::{Departure, Estimate};
use field::{Grid, Patch};
pub use heights::{HeightCase, Start, visible_heights};
pub use lobes::{Lobe, LobeCase, Material, ORDERS, PSI_BINS, outgoing_lobes};

use crate::embree::{Device, EmbreeError};

/// How much of the surface is looked at, and how closely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Side of the periodic patch, in correlation lengths (> 0).
    pub patch: f64,
    /// Cells of the mesh per correlation length (> 0).
    pub cells: f64,
    /// Independent realisations of the surface (≥ 2), from whose spread the
    /// standard errors come.
    pub realisations: usize,
    /// Rays per case and realisation (> 0).
    pub rays: usize,
    /// Walks of the model for every ray on the surface (> 0).
    pub walks_per_ray: usize,
    /// Seed of everything; results do not depend on the number of threads.
    pub seed: u64,
}

impl Config {
    /// For figures.
    #[must_use]
    pub fn standard() -> Self {
        Self {
            patch: 32.0,
            cells: 12.0,
            realisations: 16,
            rays: 20_000,
            walks_per_ray: 2,
            seed: 1,
        }
    }

    /// For tests.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            patch: 16.0,
            cells: 8.0,
            realisations: 12,
            rays: 3_000,
            ..Self::standard()
        }
    }

    fn grid(&self) -> Grid {
        Grid {
            side: self.patch,
            cells: (self.patch * self.cells).round() as usize,
        }
    }

    fn check(&self) -> Result<(), HeightFieldError> {
        let cells = self.patch * self.cells;
        // Vertex indices have 32 bits; far fewer fill the memory.
        let fits = self.patch > 0.0 && (2.0..=16_384.0).contains(&cells);
        if fits && self.realisations >= 2 && self.rays > 0 && self.walks_per_ray > 0 {
            Ok(())
        } else {
            Err(HeightFieldError::Config(*self))
        }
    }

    /// Calls `work` with every realisation of the surface, for each of the
    /// roughnesses `alphas` by turns. The same field is stretched for all.
    fn over_patches(
        &self,
        alphas: &[[f64; 2]],
        mut work: impl FnMut(usize, [f64; 2], &Patch),
    ) -> Result<(), HeightFieldError> {
        let device = Arc::new(Device::new(0)?);
        let grid = self.grid();
        for realisation in 0..self.realisations {
            let mut rng = field::stream(self.seed, realisation as u64);
            let heights = field::synthesize(grid, &mut rng);
            for &alpha in alphas {
                work(
                    realisation,
                    alpha,
                    &Patch::new(&device, grid, &heights, alpha)?,
                );
            }
        }
        Ok(())
    }
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum HeightFieldError {
    /// Embree is missing or out of memory.
    #[error(transparent)]
    Embree(#[from] EmbreeError),
    /// The configuration makes no surface.
    #[error(
        "a height field needs 2 to 16384 cells along its side, 2 realisations, and a ray and a walk for each: {0:?}"
    )]
    Config(Config),
}

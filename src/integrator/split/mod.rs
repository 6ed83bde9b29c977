//! Adaptive path splitting (Arvo and Kirk 1990, "Particle Transport and Image
//! Synthesis"; Vorba and Křivánek 2016, "Adjoint-Driven Russian Roulette and Splitting
//! in Light Transport Simulation"; Rath et al. 2022, "EARS: Efficiency-Aware Russian
//! Roulette and Splitting"): how many camera rays, light samples and branches each
//! sample of a pixel has.
//!
//! A few pilot paths all over the image ([`Pilot`]) decide, before any sample is taken
//! ([`Plan::new`]). They have random numbers of their own and are no part of the image.
//! So the plan is a function of scene, settings and seed alone, the same in every part
//! of a render, in a crop and after an interruption; and since samples do not depend on
//! what it was decided by, it adds no bias.

mod allocate;
mod draws;
mod pilot;
mod schedule;

pub use draws::Split;
pub use pilot::Spread;

pub(super) use draws::Draws;
pub(super) use pilot::{CELL, Cells, Pilot};
pub(super) use schedule::pass_length;

use crate::image::Window;
use crate::scene::RenderSettings;

/// The draws of every pixel of a window.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Plan {
    /// The cells that have draws of their own; none when all paths are plain.
    cells: Option<(Cells, Vec<Draws>)>,
}

impl Plan {
    /// Plans the samples of a window; `pilots` traces the pilot paths of these cells.
    pub(super) fn new(settings: &RenderSettings, pilots: impl Fn(&Cells) -> Vec<Pilot>) -> Self {
        if settings.branches == Some(1) {
            return Self::default();
        }
        let image = Cells::of(Window::full(settings.resolution));
        let near = Cells::of(settings.window).grown(allocate::REACH, &image);
        let found = pilots(&near);
        let blocks = allocate::blocks(&image, |block| match near.part(block) {
            Some(indices) => indices.map(|index| found[index]).collect(),
            None => pilots(block),
        });
        let scale = allocate::scale(&blocks, settings.branches);
        let draws = allocate::draws(&near, &found, scale);
        Self {
            cells: Some((near, draws)),
        }
    }

    /// The draws of a sample of `pixel` (column, row of the full image), which must be
    /// in the window.
    #[inline]
    #[must_use]
    pub fn at(&self, pixel: [u32; 2]) -> Draws {
        match &self.cells {
            Some((cells, draws)) => draws[cells.index(pixel.map(|p| p / CELL))],
            None => Draws::ONE,
        }
    }
}

//! Russian roulette (Arvo and Kirk 1990, "Particle Transport and Image Synthesis"): how
//! likely a path is to go on from where it was scattered.
//!
//! A path goes on by what it may yet add to its pixel over what the pixel shows (Vorba and
//! Křivánek 2016, "Adjoint-Driven Russian Roulette and Splitting in Light Transport
//! Simulation"; Rath et al. 2022, "EARS"). What light a path still finds is known as a mean
//! over the scene alone, for each way of scattering; how hard to play is chosen for the
//! least variance × rays. Both are told by a few training paths before any sample is
//! taken, which have random numbers of their own and are no part of the image.

mod fit;

use crate::image::Window;
use crate::metrics::REL_EPSILON;
use crate::rays::RayKind;

pub(super) use fit::fit;

/// The chances of a pixel's paths to go on.
#[derive(Clone, Copy, Debug)]
pub struct Survival {
    /// The bounce from which on they play.
    from: u32,
    /// What the largest channel of their throughput is multiplied by, where they are
    /// reflected by a wide lobe, a narrow one, or transmitted.
    factors: [f32; 3],
}

/// The least probability that a path goes on with: bounds the factor on what survives.
const LEAST: f32 = 0.05;

impl Survival {
    /// By throughput alone, from this bounce on.
    #[must_use]
    pub const fn from(bounce: u32) -> Self {
        Self {
            from: bounce,
            factors: [1.0; 3],
        }
    }

    /// The chance of a path to go on, `bounce` scatterings after the camera, the last of
    /// this kind.
    #[inline(always)]
    pub fn chance(&self, bounce: u32, kind: RayKind, throughput: f32) -> f32 {
        if bounce < self.from {
            return 1.0;
        }
        let chance = self.factors[index(kind)] * throughput;
        // Infinity times 0 is not a number.
        if chance.is_nan() {
            LEAST
        } else {
            chance.clamp(LEAST, 1.0)
        }
    }
}

/// Ways of scattering that are told apart.
#[inline(always)]
fn index(kind: RayKind) -> usize {
    match kind {
        RayKind::Glossy => 1,
        RayKind::Transmission => 2,
        RayKind::Camera | RayKind::Diffuse | RayKind::Shadow => 0,
    }
}

/// A scattering of a path that trains.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Of what kind.
    pub kind: RayKind,
    /// The largest channel of the throughput behind it.
    pub throughput: f32,
    /// The luminance that the path had found up to there, W·m⁻²·sr⁻¹.
    pub before: f32,
    /// Rays traced up to there.
    pub rays_before: u32,
}

/// How the paths of every pixel play.
#[derive(Clone, Debug)]
pub(super) enum Roulette {
    /// All alike.
    Even(Survival),
    /// By what their pixels show.
    ByWorth {
        /// In pixels that show a radiance of 1.
        factors: [f32; 3],
        grid: Grid,
    },
}

impl Roulette {
    /// The chances of the paths of `pixel` (column, row of the full image).
    #[inline]
    pub fn at(&self, pixel: [u32; 2]) -> Survival {
        match self {
            Self::Even(survival) => *survival,
            Self::ByWorth { factors, grid } => {
                let scale = grid.inverse[grid.cell(pixel)];
                Survival {
                    from: 0,
                    factors: factors.map(|factor| factor * scale),
                }
            }
        }
    }
}

/// A coarse image.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    resolution: [u32; 2],
    side: [u32; 2],
    /// One over luminance, row by row.
    inverse: Vec<f32>,
}

/// Training paths along a side of the image at the most.
const MOST: u32 = 64;

/// How far luminances are averaged, in cells of the grid.
const RADIUS: u32 = 1;

impl Grid {
    /// Over an image of so many pixels, which nothing is known of yet.
    pub fn new(resolution: [u32; 2]) -> Self {
        Self {
            resolution,
            side: resolution.map(|pixels| pixels.div_ceil(2).min(MOST)),
            inverse: Vec::new(),
        }
    }

    /// Columns and rows of all cells.
    pub fn cells(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [width, height] = self.side;
        Window::full([width, height]).pixels()
    }

    /// The pixel that is this far (0 to 1) into a cell.
    pub fn pixel(&self, cell: [u32; 2], within: [f32; 2]) -> [u32; 2] {
        [0, 1].map(|axis| {
            let place = (cell[axis] as f32 + within[axis]) / self.side[axis] as f32;
            let pixels = self.resolution[axis];
            ((place * pixels as f32) as u32).min(pixels - 1)
        })
    }

    /// Takes up the luminances of all cells.
    pub fn show(&mut self, luminances: &[f32]) {
        let [width, height] = self.side;
        let inverse = self.cells().map(|[x, y]| {
            let near = |at: u32, side: u32| at.saturating_sub(RADIUS)..(at + RADIUS + 1).min(side);
            let (mut sum, mut count) = (0.0, 0);
            for row in near(y, height) {
                for column in near(x, width) {
                    sum += f64::from(luminances[(row * width + column) as usize]);
                    count += 1;
                }
            }
            (1.0 / (sum / f64::from(count) + REL_EPSILON)) as f32
        });
        self.inverse = inverse.collect();
    }

    fn cell(&self, pixel: [u32; 2]) -> usize {
        let [x, y] = [0, 1].map(|axis| {
            let place = u64::from(pixel[axis]) * u64::from(self.side[axis]);
            (place / u64::from(self.resolution[axis])) as usize
        });
        y * self.side[0] as usize + x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chances are probabilities, whatever the factors: light may be at the end of what
    /// single precision holds.
    #[test]
    fn chances_are_probabilities() {
        for factor in [0.0, 1e-38, 1.0, f32::MAX, f32::INFINITY] {
            let survival = Survival {
                from: 0,
                factors: [factor; 3],
            };
            for throughput in [0.0, 1e-38, 1.0, f32::MAX, f32::INFINITY] {
                let chance = survival.chance(3, RayKind::Glossy, throughput);
                assert!(
                    (LEAST..=1.0).contains(&chance),
                    "{factor} {throughput}: {chance}"
                );
            }
        }
    }

    #[test]
    fn every_pixel_is_in_the_cell_that_goes_through_it() {
        for resolution in [[1, 1], [3, 200], [256, 255], [5000, 17]] {
            let grid = Grid::new(resolution);
            for (index, cell) in grid.cells().enumerate() {
                for within in [[0.0; 2], [0.5; 2], [0.999; 2]] {
                    let pixel = grid.pixel(cell, within);
                    assert!(pixel[0] < resolution[0] && pixel[1] < resolution[1]);
                    let found = grid.cell(pixel);
                    let side = grid.side[0] as usize;
                    // A pixel across two cells belongs to one of them.
                    assert!(
                        (found % side).abs_diff(index % side) <= 1
                            && (found / side).abs_diff(index / side) <= 1,
                        "{resolution:?} {cell:?} {pixel:?}"
                    );
                }
            }
        }
    }
}

//! Several draws of one part of a path, averaged.

use std::ops::Range;

use super::path::PathResult;
use super::split::Spread;
use crate::bsdf::ByOrder;
use crate::color::Rgb;
use crate::sampler::Sampler;

/// The mean of what `trace` finds for these indices of `sampler`, and how that
/// differs; rays add up.
pub(super) fn mean(
    indices: Range<u32>,
    measured: bool,
    sampler: &mut Sampler,
    mut trace: impl FnMut(u32, &mut Sampler, &mut PathResult),
) -> (PathResult, Spread) {
    let mut sum = Sum::new(indices.len(), measured);
    for index in indices {
        sampler.set_index(index);
        let before = std::mem::take(&mut sum.result.radiance);
        trace(index, sampler, &mut sum.result);
        let found = std::mem::replace(&mut sum.result.radiance, before);
        sum.add(found);
    }
    sum.mean()
}

/// Draws of a part of a path, added up.
pub(super) struct Sum {
    /// The sum, and all rays.
    pub result: PathResult,
    count: usize,
    /// Sums of squares per channel, if wanted.
    squares: Option<[f64; 3]>,
}

impl Sum {
    pub fn new(count: usize, measured: bool) -> Self {
        Self {
            result: PathResult::default(),
            count,
            squares: measured.then_some([0.0; 3]),
        }
    }

    /// Adds what a draw found; its rays have been counted.
    #[inline]
    pub fn add(&mut self, found: ByOrder) {
        self.result.radiance += found;
        if let Some(squares) = &mut self.squares {
            for (sum, found) in squares.iter_mut().zip(found.total().to_array()) {
                *sum += f64::from(found).powi(2);
            }
        }
    }

    /// The mean of all draws, with the sum of their rays, and how they differ.
    pub fn mean(mut self) -> (PathResult, Spread) {
        let spread = self.squares.map_or_else(Spread::default, |squares| {
            let sum = self.result.radiance.total().to_array();
            Spread::of(self.count, sum, squares, self.result.rays)
        });
        self.result.radiance = self.result.radiance * Rgb::splat(1.0 / self.count as f32);
        (self.result, spread)
    }
}

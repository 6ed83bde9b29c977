//! The mean of several samples of one part of a path.

use super::result::Found;
use crate::color::Rgb;
use crate::integrator::split::Spread;

/// Samples of a part of a path, added up.
pub(super) struct Mean {
    count: usize,
    sum: Found,
    /// Sums of squares per channel, where the spread is wanted.
    squares: Option<[f64; 3]>,
}

impl Mean {
    /// Of so many samples. Those that find no light need not be added.
    pub fn new(count: usize, measured: bool) -> Self {
        Self {
            count,
            sum: Found::default(),
            squares: measured.then_some([0.0; 3]),
        }
    }

    /// Adds what a sample found.
    #[inline]
    pub fn add(&mut self, found: Found) {
        self.sum.radiance += found.radiance;
        self.sum.let_through += found.let_through;
        self.sum.rays += found.rays;
        if let Some(squares) = &mut self.squares {
            for (sum, found) in squares.iter_mut().zip(found.radiance.total().to_array()) {
                *sum += f64::from(found).powi(2);
            }
        }
    }

    /// Adds rays of samples whose light is added by itself, or that find none.
    pub fn add_rays(&mut self, rays: u32) {
        self.sum.rays += rays;
    }

    /// The mean radiance with all rays, and how the samples differ.
    pub fn finish(self) -> (Found, Spread) {
        let Found {
            radiance,
            let_through,
            rays,
        } = self.sum;
        let spread = self.squares.map_or_else(Spread::default, |squares| {
            Spread::of(self.count, radiance.total().to_array(), squares, rays)
        });
        let share = 1.0 / self.count as f32;
        let found = Found {
            radiance: radiance * Rgb::splat(share),
            let_through: let_through * share,
            rays,
        };
        (found, spread)
    }
}

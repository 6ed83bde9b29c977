//! Pilot paths: how light samples, branches and camera rays differ, and what each
//! costs.

use crate::image::Window;

/// Side of the square of pixels that one pilot stands for.
pub(in super::super) const CELL: u32 = 2;

/// How the draws of one part of a path differ, and what one costs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Variance of one draw, radiance squared, per channel.
    pub variance: [f64; 3],
    /// Rays that it traces.
    pub rays: f64,
}

impl Spread {
    /// Of `count` draws with these sums of their values and of the squares of those,
    /// which traced so many rays between them. One draw alone has no spread.
    #[must_use]
    pub fn of(count: usize, sum: [f32; 3], squares: [f64; 3], rays: u32) -> Self {
        if count < 2 {
            return Self::default();
        }
        let n = count as f64;
        Self {
            variance: [0, 1, 2].map(|channel| {
                let sum = f64::from(sum[channel]);
                (squares[channel] - sum * sum / n).max(0.0) / (n - 1.0)
            }),
            rays: f64::from(rays) / n,
        }
    }
}

/// What two camera paths through one pixel of a cell tell. They begin at opposite
/// offsets and have all other random numbers in common, so that they differ by what
/// the pixel shows at the two and hardly by noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in super::super) struct Pilot {
    /// Of each path, the light samples and the branches.
    pub paths: [[Spread; 2]; 2],
    /// Of each path, radiance, W·m⁻²·sr⁻¹.
    pub radiance: [[f32; 3]; 2],
    /// Rays of both.
    pub rays: u32,
}

impl Pilot {
    /// Mean radiance of both paths; black where one is impossible, which samples will
    /// be counted for.
    pub fn mean(&self) -> [f64; 3] {
        self.each_channel(|[a, b]| 0.5 * (a + b))
    }

    /// Variance of one camera ray.
    pub fn camera_variance(&self) -> [f64; 3] {
        self.each_channel(|[a, b]| 0.5 * (a - b) * (a - b))
    }

    /// Variance of one draw of `part` (0: light samples, 1: branches), and its rays.
    pub fn spread(&self, part: usize) -> Spread {
        let [a, b] = self.paths.map(|path| path[part]);
        let half = |a: f64, b: f64| {
            let mean = 0.5 * (a + b);
            if mean.is_finite() { mean } else { 0.0 }
        };
        Spread {
            variance: [0, 1, 2].map(|c| half(a.variance[c], b.variance[c])),
            rays: half(a.rays, b.rays),
        }
    }

    fn each_channel(&self, value: impl Fn([f64; 2]) -> f64) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let value = value(self.radiance.map(|path| f64::from(path[channel])));
            if value.is_finite() { value } else { 0.0 }
        })
    }
}

/// A rectangle of cells; columns and rows count from the top left of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct Cells {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Cells {
    /// Those that have a pixel of `window`.
    pub fn of(window: Window) -> Self {
        let (x, y) = (window.x / CELL, window.y / CELL);
        Self {
            x,
            y,
            width: (window.x + window.width).div_ceil(CELL) - x,
            height: (window.y + window.height).div_ceil(CELL) - y,
        }
    }

    /// With `margin` cells more on each side, as far as `image` has them.
    pub fn grown(&self, margin: u32, image: &Self) -> Self {
        let (x, y) = (self.x.saturating_sub(margin), self.y.saturating_sub(margin));
        Self {
            x,
            y,
            width: (self.x + self.width + margin).min(image.width) - x,
            height: (self.y + self.height + margin).min(image.height) - y,
        }
    }

    pub fn count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The cell that comes at `index`, row by row.
    pub fn cell(&self, index: usize) -> [u32; 2] {
        let width = self.width as usize;
        [
            self.x + (index % width) as u32,
            self.y + (index / width) as u32,
        ]
    }

    /// Where `cell` comes, row by row.
    pub fn index(&self, cell: [u32; 2]) -> usize {
        debug_assert!(self.x <= cell[0] && cell[0] - self.x < self.width);
        (cell[1] - self.y) as usize * self.width as usize + (cell[0] - self.x) as usize
    }

    /// The indices of the cells of `part`, if all of them are here.
    pub fn part(&self, part: &Self) -> Option<impl Iterator<Item = usize> + use<>> {
        let within = self.x <= part.x
            && self.y <= part.y
            && part.x + part.width <= self.x + self.width
            && part.y + part.height <= self.y + self.height;
        let (whole, part) = (*self, *part);
        within.then(|| (0..part.count()).map(move |index| whole.index(part.cell(index))))
    }
}

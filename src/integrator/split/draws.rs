//! Numbers of draws.

use std::ops::Range;

/// Of what a sample of a pixel is the mean: paths from the camera, each of which
/// splits at the first surface that scatters it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct Draws {
    /// Paths that start at the camera, each somewhere else in the pixel.
    pub camera_rays: u32,
    /// Light samples where one of them is scattered first.
    pub light_samples: u32,
    /// Branches: BSDF samples by which one of them goes on from there.
    pub branches: u32,
}

impl Draws {
    /// No more than this many of each.
    pub const MOST: u32 = 64;

    /// A plain path.
    pub const ONE: Self = Self {
        camera_rays: 1,
        light_samples: 1,
        branches: 1,
    };

    /// A path that splits just often enough to tell how much that matters.
    pub const PILOT: Self = Self {
        camera_rays: 1,
        light_samples: 2,
        branches: 2,
    };

    /// How camera path number `path` of a pixel splits. The draws of a pixel are
    /// numbered on through its paths, so that they are points of one sequence.
    pub fn split(self, path: u32) -> Split {
        let numbers = |count: u32| path * count..(path + 1) * count;
        Split {
            light_samples: numbers(self.light_samples),
            branches: numbers(self.branches),
        }
    }
}

/// Into what a camera path splits at the first surface that scatters it: each
/// draws the numbers of an index of its own from the pixel's
/// [`crate::sampler::Sampler`].
#[derive(Clone, Debug)]
pub struct Split {
    /// Ways in which it goes on.
    pub branches: Range<u32>,
    /// Samples of the light that arrives there directly.
    pub light_samples: Range<u32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Consecutive paths take consecutive numbers, whatever part they belong to.
    #[test]
    fn draws_are_numbered_without_gaps() {
        let draws = Draws {
            camera_rays: 2,
            light_samples: 3,
            branches: 5,
        };
        for path in 0..10 {
            let (split, next) = (draws.split(path), draws.split(path + 1));
            assert_eq!(split.light_samples.len(), 3);
            assert_eq!(split.light_samples.end, next.light_samples.start);
            assert_eq!(split.branches.end, next.branches.start);
        }
        assert_eq!(draws.split(0).branches, 0..5);
    }
}

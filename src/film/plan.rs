//! Of how many parts the samples of a pixel consist, by how much that helps.

use super::{Film, FilmTile};
use crate::image::Window;
use crate::metrics::REL_EPSILON;

/// Rays that a sample traces on average when nobody says into how many branches
/// paths split: so many that the camera ray they share costs next to nothing. More
/// would leave the noise that comes with the camera ray as it is.
const RAYS_PER_SAMPLE: f64 = 32.0;

/// How the numbers of draws go with what one is worth: stratified, n of them have a
/// variance of V n^(−3/2) where the integrand jumps along a line in two dimensions,
/// at a cost of c n, and the best n is in proportion to (V/c)^(2/5).
const EXPONENT: f64 = 0.4;

/// Camera rays that are as good as a branch: most of what changes within a pixel
/// changes smoothly.
const CAMERA_SHARE: f64 = 0.25;

/// From so many on, camera rays are worth starting the pixel anew.
const WORTH_MORE_CAMERA_RAYS: u32 = 3;

/// Light samples that are as good as a branch: most lights look smooth from most
/// places, so that stratified samples of them vary less than their variance says.
const LIGHT_SHARE: f64 = 0.4;

/// Radius in pixels of the square over which pilots are averaged: a few samples
/// of one pixel say little about its own.
const RADIUS: usize = 6;

/// The same for how a pixel's camera rays differ: outlines are narrow.
const OUTLINE_RADIUS: usize = 1;

/// Steps of the search for the scale of all numbers of draws, which converges
/// in a few but for those that are clamped.
const STEPS: u32 = 12;

/// Of what a sample of a pixel is the mean: paths from the camera, each of which
/// splits at the first surface that scatters it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Draws {
    /// Paths that start at the camera, each somewhere else in the pixel.
    pub camera_rays: u32,
    /// Samples of the light that arrives directly where one of them is scattered.
    pub light_samples: u32,
    /// Ways in which one of them goes on from there.
    pub branches: u32,
}

impl Draws {
    /// No more than this many of each.
    pub const MOST: u32 = 64;

    /// Nothing has been decided.
    pub const UNPLANNED: Self = Self {
        camera_rays: 0,
        light_samples: 0,
        branches: 0,
    };

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
}

/// How the draws of one part of a path differ, and what one costs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Variance of one draw, radiance squared, per channel.
    variance: [f64; 3],
    /// The same of the mean of all of them, if they are independent.
    of_mean: [f64; 3],
    /// Rays that it traces.
    rays: f64,
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
        let variance = [0, 1, 2].map(|channel| {
            let sum = f64::from(sum[channel]);
            (squares[channel] - sum * sum / n).max(0.0) / (n - 1.0)
        });
        Self {
            variance,
            of_mean: variance.map(|variance| variance / n),
            rays: f64::from(rays) / n,
        }
    }
}

impl std::ops::AddAssign for Spread {
    fn add_assign(&mut self, other: Self) {
        for channel in 0..3 {
            self.variance[channel] += other.variance[channel];
            self.of_mean[channel] += other.of_mean[channel];
        }
        self.rays += other.rays;
    }
}

/// What the first samples of a pixel tell about the others: sums over them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pilot {
    pub light_samples: Spread,
    pub branches: Spread,
}

/// What the pilots round a pixel say about one part of its paths.
#[derive(Clone, Copy)]
struct Part {
    /// What one draw costs, in rays.
    rays: f64,
    /// Numbers of draws are in proportion to this.
    worth: f64,
}

impl Part {
    /// Of draws with this relative variance, that trace so many rays each.
    fn new(share: f64, variance: f64, rays: f64) -> Self {
        let worth = if rays > 0.0 {
            share * (variance.max(0.0) / rays).powf(EXPONENT)
        } else {
            0.0
        };
        Self { rays, worth }
    }

    fn draws(self, scale: f64) -> f64 {
        (scale * self.worth).clamp(1.0, Draws::MOST.into()).round()
    }
}

impl Film {
    /// Decides how the camera paths of each pixel split from now on: into a number of
    /// light samples and of branches that goes with V/c, V being the variance of one
    /// over the square of the pixel's mean, with an ε as in [`crate::metrics`], and c
    /// the rays it traces. Equal errors per ray make the most of them (Neyman 1934,
    /// optimal allocation). All numbers are scaled so that a path has `branches` on
    /// average over the pixels where they differ at all, or else so that it traces a
    /// fixed number of rays; returns the scale.
    ///
    /// However they are chosen, each sample's expectation is the pixel's value, so
    /// the image has no bias; what a pixel gets is decided by its neighbours'
    /// samples alone, as its own are points of one sequence and not independent.
    pub fn plan(&mut self, branches: Option<u32>) -> f64 {
        let light = self.part(LIGHT_SHARE, |pilot| pilot.light_samples);
        let paths = self.part(1.0, |pilot| pilot.branches);
        let scale = match branches {
            Some(mean) => scale(&paths, f64::from(mean), |index, scale| {
                paths[index].draws(scale)
            }),
            None => scale(&paths, RAYS_PER_SAMPLE, |index, scale| {
                let rays = |part: Part| part.rays * part.draws(scale);
                1.0 + rays(light[index]) + rays(paths[index])
            }),
        };
        let window = self.window;
        for tile in &mut self.tiles {
            for pixel in tile.window().pixels() {
                let index = window.index(pixel);
                let draws = Draws {
                    camera_rays: 1,
                    light_samples: light[index].draws(scale) as u32,
                    branches: paths[index].draws(scale) as u32,
                };
                tile.set_draws(pixel, draws);
            }
        }
        scale
    }

    /// Decides how many camera paths a sample of each pixel consists of from now on,
    /// in the same way and with the scale that [`Self::plan`] has found. They share
    /// the draws that were planned for one. It takes samples that split as planned
    /// to tell an outline from noise.
    pub fn plan_camera_rays(&mut self, scale: f64) {
        let camera = self.camera_rays();
        let window = self.window;
        for tile in &mut self.tiles {
            tile.pilots = Vec::new();
            for pixel in tile.window().pixels() {
                let camera_rays = match camera[window.index(pixel)].draws(scale) as u32 {
                    ..WORTH_MORE_CAMERA_RAYS => 1,
                    enough => enough,
                };
                let draws = tile.draws(pixel);
                let of_each = |draws: u32| ((draws + camera_rays / 2) / camera_rays).max(1);
                let draws = Draws {
                    camera_rays,
                    light_samples: of_each(draws.light_samples),
                    branches: of_each(draws.branches),
                };
                tile.set_draws(pixel, draws);
            }
        }
    }

    /// For each pixel of the window, the part of its samples that `spread` is of;
    /// `share` is what its draws are worth beside those of others.
    fn part(&self, share: f64, spread: impl Fn(&Pilot) -> Spread) -> Vec<Part> {
        let rays = self.pilots(RADIUS, |tile, pixel, pilot| {
            spread(pilot).rays / f64::from(tile.samples(pixel))
        });
        let noise = self.pilots(RADIUS, |tile, pixel, pilot| {
            relative(tile, pixel, spread(pilot).variance) / f64::from(tile.samples(pixel))
        });
        let parts = noise.into_iter().zip(rays);
        parts.map(|(v, rays)| Part::new(share, v, rays)).collect()
    }

    /// The same for camera rays: theirs is how samples differ beyond what the other
    /// parts explain.
    fn camera_rays(&self) -> Vec<Part> {
        let noise = self.pilots(OUTLINE_RADIUS, |tile, pixel, pilot| {
            let samples = f64::from(tile.samples(pixel));
            let of_mean = tile.variance(pixel);
            let (light, paths) = (pilot.light_samples.of_mean, pilot.branches.of_mean);
            let beyond = [0, 1, 2].map(|channel| {
                let explained = light[channel] + paths[channel];
                samples * of_mean[channel] - explained / samples
            });
            relative(tile, pixel, beyond)
        });
        let parts = noise.into_iter();
        parts.map(|v| Part::new(CAMERA_SHARE, v, 1.0)).collect()
    }

    /// For each pixel of the window, the mean of `value` over the pilots round it.
    fn pilots(
        &self,
        radius: usize,
        value: impl Fn(&FilmTile, [u32; 2], &Pilot) -> f64,
    ) -> Vec<f64> {
        let mut values = vec![0.0; self.window.area()];
        for tile in &self.tiles {
            for (pixel, pilot) in tile.window().pixels().zip(&tile.pilots) {
                values[self.window.index(pixel)] = value(tile, pixel, pilot);
            }
        }
        neighbours(self.window, &values, radius)
    }
}

/// These variances over the square of the pixel's mean, summed over the channels.
fn relative(tile: &FilmTile, pixel: [u32; 2], variance: [f64; 3]) -> f64 {
    let terms = tile.color(pixel).into_iter().zip(variance);
    terms.map(|(mean, v)| v / (mean * mean + REL_EPSILON)).sum()
}

/// The scale of numbers of draws with which `spent` (given a pixel's index and the
/// scale) is `target` on average over the pixels whose `paths` are worth anything.
fn scale(paths: &[Part], target: f64, spent: impl Fn(usize, f64) -> f64) -> f64 {
    let worth = |&index: &usize| paths[index].worth > 0.0;
    let noisy: Vec<usize> = (0..paths.len()).filter(worth).collect();
    let highest = paths.iter().map(|part| part.worth).fold(0.0, f64::max);
    let mut scale = 1.0 / highest;
    for _ in 0..STEPS {
        let sum: f64 = noisy.iter().map(|&index| spent(index, scale)).sum();
        if sum > 0.0 {
            scale *= target * noisy.len() as f64 / sum;
        }
    }
    // Without noise anywhere there is nothing to scale.
    if scale.is_finite() { scale } else { 0.0 }
}

/// For each pixel of `window`, the mean of `values` over those at most `radius` away
/// in both directions, itself left out; 0 where there are none.
fn neighbours(window: Window, values: &[f64], radius: usize) -> Vec<f64> {
    let (width, height) = (window.width as usize, window.height as usize);
    let near = |at: usize, size: usize| at.saturating_sub(radius)..(at + radius + 1).min(size);
    let mut rows = Vec::with_capacity(values.len());
    for row in values.chunks_exact(width) {
        rows.extend((0..width).map(|x| row[near(x, width)].iter().sum::<f64>()));
    }
    let mut means = Vec::with_capacity(values.len());
    for y in 0..height {
        for x in 0..width {
            let square: f64 = near(y, height).map(|y| rows[y * width + x]).sum();
            let count = near(x, width).len() * near(y, height).len() - 1;
            let others = (square - values[y * width + x]).max(0.0);
            means.push(others / count.max(1) as f64);
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{AovSet, Sample};

    const BLACK_AND_WHITE: [f32; 2] = [0.0, 2.0];

    /// A film of four samples per pixel whose branches give 0 or 2 in its right half
    /// and cost `rays`, and always 1 in its left; light samples are all the same.
    fn half_noisy(rays: u32) -> Film {
        let mut film = Film::new([48, 48], Window::full([48, 48]), AovSet::NONE);
        for tile in film.tiles_mut() {
            for pixel in tile.window().pixels() {
                let values = if pixel[0] < 24 {
                    [1.0; 2]
                } else {
                    BLACK_AND_WHITE
                };
                let squares = [values.iter().map(|&v| f64::from(v).powi(2)).sum(); 3];
                for _ in 0..4 {
                    let color = [1.0; 3];
                    let sample = Sample {
                        color,
                        ..Sample::default()
                    };
                    assert!(tile.add(pixel, &[sample]));
                    let light = Spread::of(2, [2.0; 3], [2.0; 3], 2);
                    tile.add_pilot(pixel, light, Spread::of(2, [2.0; 3], squares, 2 * rays));
                }
            }
        }
        film
    }

    fn draws(film: &mut Film, pixel: [u32; 2]) -> Draws {
        let mut tiles = film.tiles_mut().iter();
        let tile = tiles.find(|tile| tile.window().pixels().any(|p| p == pixel));
        tile.unwrap().draws(pixel)
    }

    #[test]
    fn noisy_pixels_get_more_branches() {
        let mut film = half_noisy(1);
        film.plan(None);
        assert_eq!(draws(&mut film, [2, 8]), Draws::ONE);
        let noisy = draws(&mut film, [40, 8]);
        // The pixels near the border get fewer, and so these get more than the average.
        let rays = RAYS_PER_SAMPLE;
        let range = rays..1.2 * rays;
        assert!(range.contains(&noisy.branches.into()), "{noisy:?}");
        assert_eq!(noisy.light_samples, 1);
        let edge = draws(&mut film, [23, 8]).branches;
        assert!(edge > 1 && edge < noisy.branches, "{edge}");
    }

    #[test]
    fn a_sample_traces_as_many_rays_whatever_a_branch_takes() {
        for rays in [1, 3, 6] {
            let mut film = half_noisy(rays);
            film.plan(None);
            let pixels = Window::full([48, 48]).pixels();
            let taken = pixels
                .map(|p| draws(&mut film, p).branches)
                .filter(|&b| b > 1);
            let (count, sum) = taken.fold((0, 0), |(n, sum), b| (n + 1, sum + 2 + b * rays));
            let mean = f64::from(sum) / f64::from(count);
            assert!((mean / RAYS_PER_SAMPLE - 1.0).abs() < 0.1, "{rays}: {mean}");
        }
    }

    /// Samples are 0.5 and 1.5 by turns but in the left third; branches tell why in
    /// the right one.
    #[test]
    fn outlines_get_more_camera_rays_and_noise_does_not() {
        let mut film = Film::new([48, 48], Window::full([48, 48]), AovSet::NONE);
        for tile in film.tiles_mut() {
            for pixel in tile.window().pixels() {
                let third = pixel[0] / 16;
                let squares = if third == 2 { [4.0; 3] } else { [2.0; 3] };
                for value in [0.5, 1.5, 0.5, 1.5, 0.5] {
                    let color = [if third == 0 { 1.0 } else { value }; 3];
                    let sample = Sample {
                        color,
                        ..Sample::default()
                    };
                    assert!(tile.add(pixel, &[sample]));
                    let light = Spread::of(2, [2.0; 3], [2.0; 3], 2);
                    tile.add_pilot(pixel, light, Spread::of(2, [2.0; 3], squares, 2));
                }
            }
        }
        let scale = film.plan(None);
        let planned = [8, 30, 40].map(|x| draws(&mut film, [x, 24]));
        film.plan_camera_rays(scale);
        let [flat, outline, noise] = [8, 30, 40].map(|x| draws(&mut film, [x, 24]));
        assert_eq!([flat, noise], [planned[0], planned[2]]);
        assert!(outline.camera_rays >= WORTH_MORE_CAMERA_RAYS, "{outline:?}");
        let branches = outline.camera_rays * outline.branches;
        assert!(
            branches.abs_diff(planned[1].branches) <= outline.camera_rays / 2,
            "{outline:?} {:?}",
            planned[1]
        );
    }

    #[test]
    fn an_average_can_be_asked_for() {
        for mean in [1, 6] {
            let mut film = half_noisy(5);
            film.plan(Some(mean));
            let noisy = Window {
                x: 18,
                y: 0,
                width: 30,
                height: 48,
            };
            let sum: u32 = noisy.pixels().map(|p| draws(&mut film, p).branches).sum();
            let found = f64::from(sum) / noisy.area() as f64;
            assert!(
                (found / f64::from(mean) - 1.0).abs() < 0.05,
                "{mean}: {found}"
            );
        }
    }

    #[test]
    fn a_flat_image_needs_no_branches() {
        let mut film = Film::new([1, 1], Window::full([1, 1]), AovSet::NONE);
        film.plan(None);
        assert_eq!(draws(&mut film, [0, 0]), Draws::ONE);
    }

    /// One draw says nothing, and radiances may be near the end of what f32 holds.
    #[test]
    fn spreads_are_finite() {
        assert_eq!(Spread::of(1, [3.0; 3], [9.0; 3], 5), Spread::default());
        let huge = Spread::of(2, [1e30; 3], [1e60; 3], 5);
        assert!(
            huge.variance.iter().all(|v| (0.49e60..0.51e60).contains(v)),
            "{huge:?}"
        );
    }
}

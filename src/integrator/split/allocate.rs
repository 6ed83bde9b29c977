//! From pilots to numbers of draws.

use super::draws::Draws;
use super::pilot::{Cells, Pilot, Spread};
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

/// From so many on, camera rays are worth their cost.
const WORTH_MORE_CAMERA_RAYS: u32 = 3;

/// Light samples that are as good as a branch: most lights look smooth from most
/// places, so that stratified samples of them vary less than their variance says.
const LIGHT_SHARE: f64 = 0.4;

/// Radius in cells of the square over which pilots are averaged: one pilot says little.
const RADIUS: u32 = 3;

/// The same for how a pixel's camera rays differ: outlines are narrow. And for the mean
/// radiance that variances are relative to.
const NARROW_RADIUS: u32 = 1;

/// How far from a cell its draws depend on pilots, in cells.
pub(super) const REACH: u32 = RADIUS + NARROW_RADIUS;

/// Side of the blocks of cells that the scale of all numbers comes from.
const BLOCK: u32 = 8;

/// About the largest number of such blocks, spread evenly over the image: enough for
/// its mean, and few beside those of a large image that a crop leaves out.
const BLOCKS: f64 = 1024.0;

/// Steps of the search for the scale of all numbers of draws, which converges
/// in a few but for those that are clamped.
const STEPS: u32 = 12;

/// What pilots say about one part of paths.
#[derive(Clone, Copy, Debug)]
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

/// What the pilots of a block say about its paths.
pub(super) struct Block {
    light: Part,
    branches: Part,
}

/// Some of the image's blocks, or all of them in a small image: the same whatever
/// window is rendered. `pilots` has those of these cells.
pub(super) fn blocks(image: &Cells, pilots: impl Fn(&Cells) -> Vec<Pilot>) -> Vec<Block> {
    let (columns, rows) = (image.width.div_ceil(BLOCK), image.height.div_ceil(BLOCK));
    let all = f64::from(columns) * f64::from(rows);
    let stride = (all / BLOCKS).sqrt().ceil().max(1.0) as usize;
    let mut blocks = Vec::new();
    for row in (0..rows).step_by(stride) {
        for column in (0..columns).step_by(stride) {
            let cells = Cells {
                x: column * BLOCK,
                y: row * BLOCK,
                width: BLOCK.min(image.width - column * BLOCK),
                height: BLOCK.min(image.height - row * BLOCK),
            };
            let pilots = pilots(&cells);
            let part = |part, share| {
                let spreads = pilots.iter().map(|pilot| pilot.spread(part));
                let rays = mean(spreads.map(|spread| spread.rays));
                let noise = mean(noise(&cells, &pilots, part).into_iter());
                Part::new(share, noise, rays)
            };
            blocks.push(Block {
                light: part(LIGHT, LIGHT_SHARE),
                branches: part(BRANCHES, 1.0),
            });
        }
    }
    blocks
}

/// The parts of [`Pilot::spread`].
const LIGHT: usize = 0;
const BRANCHES: usize = 1;

/// The scale of numbers of draws with which paths have `branches` on average over the
/// blocks where those differ at all, or else with which samples trace a fixed number of
/// rays there.
pub(super) fn scale(blocks: &[Block], branches: Option<u32>) -> f64 {
    let noisy: Vec<_> = blocks.iter().filter(|b| b.branches.worth > 0.0).collect();
    let highest = noisy.iter().map(|b| b.branches.worth).fold(0.0, f64::max);
    let target = branches.map_or(RAYS_PER_SAMPLE, f64::from);
    let spent = |block: &Block, scale: f64| match branches {
        Some(_) => block.branches.draws(scale),
        None => {
            let rays = |part: Part| part.rays * part.draws(scale);
            1.0 + rays(block.light) + rays(block.branches)
        }
    };
    let mut scale = 1.0 / highest;
    for _ in 0..STEPS {
        let sum: f64 = noisy.iter().map(|block| spent(block, scale)).sum();
        if sum > 0.0 {
            scale *= target * noisy.len() as f64 / sum;
        }
    }
    // Without noise anywhere there is nothing to scale.
    if scale.is_finite() { scale } else { 0.0 }
}

/// The draws of each cell. Numbers of light samples and of branches go with (V/c)^0.4,
/// V being the relative variance of one and c the rays it traces; equal errors per ray
/// make the most of them (Neyman 1934, optimal allocation). Camera rays come from how
/// paths differ across a pixel, and share the draws that were planned for one.
///
/// However they are chosen, each sample's expectation is the pixel's value.
pub(super) fn draws(cells: &Cells, pilots: &[Pilot], scale: f64) -> Vec<Draws> {
    let part = |part: usize, share: f64| {
        let rays: Vec<f64> = pilots.iter().map(|pilot| pilot.spread(part).rays).collect();
        let rays = neighbours(cells, &rays, RADIUS);
        let noise = neighbours(cells, &noise(cells, pilots, part), RADIUS);
        let parts = noise.into_iter().zip(rays);
        parts.map(move |(v, rays)| Part::new(share, v, rays))
    };
    let variances: Vec<_> = pilots.iter().map(Pilot::camera_variance).collect();
    let camera = relative(cells, pilots, &variances);
    let camera = neighbours(cells, &camera, NARROW_RADIUS);
    let camera = camera.into_iter().map(|v| Part::new(CAMERA_SHARE, v, 1.0));
    part(LIGHT, LIGHT_SHARE)
        .zip(part(BRANCHES, 1.0))
        .zip(camera)
        .map(|((light, branches), camera)| {
            let camera_rays = match camera.draws(scale) as u32 {
                ..WORTH_MORE_CAMERA_RAYS => 1,
                enough => enough,
            };
            let of_each = |part: Part| {
                let draws = part.draws(scale) as u32;
                ((draws + camera_rays / 2) / camera_rays).max(1)
            };
            Draws {
                camera_rays,
                light_samples: of_each(light),
                branches: of_each(branches),
            }
        })
        .collect()
}

/// Relative variance of one draw of a part, per cell.
fn noise(cells: &Cells, pilots: &[Pilot], part: usize) -> Vec<f64> {
    let variance = |pilot: &Pilot| {
        let Spread { variance, .. } = pilot.spread(part);
        variance
    };
    let variances: Vec<_> = pilots.iter().map(variance).collect();
    relative(cells, pilots, &variances)
}

/// These variances over the square of the mean radiance round each cell, with an ε as
/// in [`crate::metrics`], summed over the channels.
fn relative(cells: &Cells, pilots: &[Pilot], variances: &[[f64; 3]]) -> Vec<f64> {
    let mut sums = vec![0.0; pilots.len()];
    for channel in 0..3 {
        let means: Vec<f64> = pilots.iter().map(|pilot| pilot.mean()[channel]).collect();
        let means = neighbours(cells, &means, NARROW_RADIUS);
        for ((sum, variance), mean) in sums.iter_mut().zip(variances).zip(means) {
            *sum += variance[channel] / (mean * mean + REL_EPSILON);
        }
    }
    sums
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// For each cell, the mean of `values` over those at most `radius` away in both
/// directions.
fn neighbours(cells: &Cells, values: &[f64], radius: u32) -> Vec<f64> {
    let (width, height) = (cells.width as usize, cells.height as usize);
    let radius = radius as usize;
    let near = |at: usize, size: usize| at.saturating_sub(radius)..(at + radius + 1).min(size);
    let mut rows = Vec::with_capacity(values.len());
    for row in values.chunks_exact(width) {
        rows.extend((0..width).map(|x| row[near(x, width)].iter().sum::<f64>()));
    }
    let mut means = Vec::with_capacity(values.len());
    for y in 0..height {
        for x in 0..width {
            let square: f64 = near(y, height).map(|y| rows[y * width + x]).sum();
            let count = near(x, width).len() * near(y, height).len();
            means.push(square / count as f64);
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Window;

    const SIDE: u32 = 96;

    fn image() -> Cells {
        Cells::of(Window::full([SIDE, SIDE]))
    }

    /// A pilot whose branches have this variance and cost `rays`, and whose camera
    /// paths differ by `step`; light samples are all the same.
    fn pilot(variance: f64, rays: f64, step: f32) -> Pilot {
        let light = Spread {
            variance: [0.0; 3],
            rays: 1.0,
        };
        let branches = Spread {
            variance: [variance; 3],
            rays,
        };
        Pilot {
            paths: [[light, branches]; 2],
            radiance: [[1.0 - step / 2.0; 3], [1.0 + step / 2.0; 3]],
            rays: 0,
        }
    }

    /// The image's draws where `at` says what the pilot of each cell finds.
    fn planned(
        branches: Option<u32>,
        at: impl Fn([u32; 2]) -> Pilot,
    ) -> impl Fn([u32; 2]) -> Draws {
        let image = image();
        let pilots = |cells: &Cells| (0..cells.count()).map(|i| at(cells.cell(i))).collect();
        let scale = scale(&blocks(&image, pilots), branches);
        let draws = draws(&image, &pilots(&image), scale);
        move |cell| draws[image.index(cell)]
    }

    /// Noise in the right half of the image alone.
    fn half_noisy(rays: f64) -> impl Fn([u32; 2]) -> Pilot {
        move |[x, _]| pilot(if x < 24 { 0.0 } else { 2.0 }, rays, 0.0)
    }

    #[test]
    fn noisy_pixels_get_more_branches() {
        let draws = planned(None, half_noisy(1.0));
        assert_eq!(draws([2, 8]), Draws::ONE);
        let noisy = draws([40, 8]);
        let range = 0.9 * RAYS_PER_SAMPLE..1.1 * RAYS_PER_SAMPLE;
        assert!(range.contains(&noisy.branches.into()), "{noisy:?}");
        assert_eq!(noisy.light_samples, 1);
        let edge = draws([23, 8]).branches;
        assert!(edge > 1 && edge < noisy.branches, "{edge}");
    }

    #[test]
    fn a_sample_traces_as_many_rays_whatever_a_branch_takes() {
        for rays in [1.0, 3.0, 6.0] {
            let noisy = planned(None, half_noisy(rays))([40, 8]);
            let traced = 2.0 + f64::from(noisy.branches) * rays;
            assert!(
                (traced / RAYS_PER_SAMPLE - 1.0).abs() < 0.1,
                "{rays}: {noisy:?}"
            );
        }
    }

    #[test]
    fn outlines_get_more_camera_rays_which_share_the_branches() {
        let draws = planned(None, |[x, _]| {
            pilot(2.0, 1.0, if x == 24 { 1.0 } else { 0.0 })
        });
        let [flat, outline] = [8, 24].map(|x| draws([x, 24]));
        assert_eq!(flat.camera_rays, 1);
        assert!(outline.camera_rays >= WORTH_MORE_CAMERA_RAYS, "{outline:?}");
        let branches = outline.camera_rays * outline.branches;
        assert!(branches.abs_diff(flat.branches) <= outline.camera_rays / 2);
    }

    #[test]
    fn an_average_can_be_asked_for() {
        for mean in [1, 6] {
            let noisy = planned(Some(mean), half_noisy(5.0))([40, 8]);
            assert!(noisy.branches.abs_diff(mean) <= 1, "{mean}: {noisy:?}");
        }
    }

    #[test]
    fn a_flat_image_needs_no_branches() {
        assert_eq!(planned(None, |_| pilot(0.0, 1.0, 0.0))([9, 9]), Draws::ONE);
        assert_eq!(planned(None, |_| Pilot::default())([9, 9]), Draws::ONE);
    }

    /// Radiances may be near the end of what single precision holds, or past it.
    #[test]
    fn plans_are_finite() {
        assert_eq!(Spread::of(1, [3.0; 3], [9.0; 3], 5), Spread::default());
        let huge = Spread::of(2, [1e30; 3], [1e60; 3], 5);
        assert!(huge.variance.iter().all(|v| (0.49e60..0.51e60).contains(v)));
        let broken = Pilot {
            radiance: [[f32::NAN; 3], [f32::INFINITY; 3]],
            ..pilot(f64::INFINITY, 1.0, 0.0)
        };
        assert_eq!(planned(None, |_| broken)([9, 9]), Draws::ONE);
    }
}

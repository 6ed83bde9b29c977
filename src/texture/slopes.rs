//! Slopes of a normal map, averaged: Dupuy, Heitz, Iehl, Poulin, Neyret, Ostromoukhov
//! 2013, "Linear efficient antialiased displacement and reflectance mapping".

use super::lookup::{Extension, UvTransform};
use super::{Texture, below};
use rayon::prelude::*;

/// First and second moments of slopes: E\[x\], E\[y\], E\[x²\], E\[xy\], E\[y²\].
type Moments = [f32; 5];

/// The mean of slopes under a footprint, and their covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slopes {
    /// Of the normal, over its part along n: along u and along v.
    pub mean: [f32; 2],
    /// Of the first, of both, of the second.
    pub covariance: [f32; 3],
}

/// Slopes stay below this: a normal that lies in the surface has none.
const STEEPEST: f32 = 20.0;

/// Moments of slopes over ever larger squares of pixels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SlopeMaps {
    /// At pixel centres.
    points: Level<[f32; 2]>,
    /// Averages of the slopes, interpolated, over squares of 1, 2, 4 … pixels.
    levels: Vec<Level<Moments>>,
    extension: Extension,
}

/// Row by row from the bottom.
#[derive(Clone, Debug, PartialEq)]
struct Level<T> {
    width: usize,
    height: usize,
    values: Vec<T>,
}

impl<const N: usize> Level<[f32; N]> {
    fn at(&self, x: i64, y: i64, extension: Extension) -> [f32; N] {
        let x = extension.pixel(x, self.width);
        match (x, extension.pixel(y, self.height)) {
            (Some(x), Some(y)) => self.values[y * self.width + x],
            _ => [0.0; N],
        }
    }

    fn bilinear(&self, place: [f64; 2], extension: Extension) -> [f32; N] {
        let (x, right) = below(extension.pixels(place[0], self.width));
        let (y, up) = below(extension.pixels(place[1], self.height));
        let row = |y| {
            let [left, next] = [x, x + 1].map(|x| self.at(x, y, extension));
            mix(left, next, right)
        };
        mix(row(y), row(y + 1), up)
    }
}

fn mix<const N: usize>(a: [f32; N], b: [f32; N], share: f32) -> [f32; N] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

impl SlopeMaps {
    /// Of a texture of normals that is one image.
    pub fn of(texture: &Texture) -> Self {
        let [width, height] = texture.size();
        let image = texture.images.first();
        let slope = |pixel: usize| {
            let mut value = image.texel(pixel % width, pixel / width, false);
            texture.finish(&mut value);
            let [x, y, z] = [0, 1, 2].map(|i| value[i] * 2.0 - 1.0);
            let z = z.max(x.hypot(y) / STEEPEST).max(f32::MIN_POSITIVE);
            [x / z, y / z]
        };
        let points = Level {
            width,
            height,
            values: (0..width * height).into_par_iter().map(slope).collect(),
        };
        let extension = texture.lookup.extension;
        let first = averaged(&points, extension);
        let mut levels = vec![first];
        while let Some(last) = levels.last().filter(|last| last.width * last.height > 1) {
            levels.push(halved(last));
        }
        Self {
            points,
            levels,
            extension,
        }
    }

    /// In bytes.
    pub fn memory(&self) -> usize {
        let levels = self.levels.iter().map(|level| size_of_val(&*level.values));
        size_of_val(&*self.points.values) + levels.sum::<usize>()
    }

    /// Under a square footprint of so many pixels' side round a place of the image.
    pub fn at(&self, place: [f64; 2], side: f32) -> Slopes {
        let level = |index: usize| {
            let index = index.min(self.levels.len() - 1);
            self.levels[index].bilinear(place, self.extension)
        };
        let moments = if side < 1.0 {
            // Over small squares variances grow by their area.
            let [x, y] = self.points.bilinear(place, self.extension);
            mix([x, y, x * x, x * y, y * y], level(0), side * side)
        } else {
            let detail = side.log2().min(64.0);
            let finer = detail.floor();
            mix(
                level(finer as usize),
                level(finer as usize + 1),
                detail - finer,
            )
        };
        let [x, y, xx, xy, yy] = moments;
        Slopes {
            mean: [x, y],
            covariance: [(xx - x * x).max(0.0), xy - x * y, (yy - y * y).max(0.0)],
        }
    }
}

/// Averages over each pixel of what is interpolated between the centres of pixels, and
/// of its squares: along one side, with the pixels before, at and after,
/// ∫f = (1/8, 3/4, 1/8)·f and ∫fg = f·W·g.
fn averaged(points: &Level<[f32; 2]>, extension: Extension) -> Level<Moments> {
    const MEAN: [f32; 3] = [0.125, 0.75, 0.125];
    const W: [[f32; 3]; 3] = [
        [1.0 / 24.0, 1.0 / 12.0, 0.0],
        [1.0 / 12.0, 7.0 / 12.0, 1.0 / 12.0],
        [0.0, 1.0 / 12.0, 1.0 / 24.0],
    ];
    let pixel = |index: usize| {
        let (x, y) = ((index % points.width) as i64, (index / points.width) as i64);
        let near: [[[f32; 2]; 3]; 3] = std::array::from_fn(|j| {
            std::array::from_fn(|i| points.at(x + i as i64 - 1, y + j as i64 - 1, extension))
        });
        let mut sum = [0.0; 5];
        for j in 0..3 {
            for i in 0..3 {
                let [p, q] = near[j][i];
                let mean = MEAN[i] * MEAN[j];
                sum[0] += mean * p;
                sum[1] += mean * q;
                for l in 0..3 {
                    for k in 0..3 {
                        let weight = W[i][k] * W[j][l];
                        let [r, s] = near[l][k];
                        sum[2] += weight * p * r;
                        sum[3] += weight * p * s;
                        sum[4] += weight * q * s;
                    }
                }
            }
        }
        sum
    };
    let count = points.width * points.height;
    Level {
        width: points.width,
        height: points.height,
        values: (0..count).into_par_iter().map(pixel).collect(),
    }
}

/// Half as many pixels along each side, rounded down, each the mean of what it covers.
fn halved(level: &Level<Moments>) -> Level<Moments> {
    let (width, height) = ((level.width / 2).max(1), (level.height / 2).max(1));
    let covered = |index: usize, count: usize, before: usize| {
        let side = before as f32 / count as f32;
        let (low, high) = (index as f32 * side, (index + 1) as f32 * side);
        let last = (high.ceil() as usize).min(before);
        (low as usize..last).map(move |i| {
            let overlap = high.min(i as f32 + 1.0) - low.max(i as f32);
            (i, overlap / side)
        })
    };
    let mut values = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0; 5];
            for (j, up) in covered(y, height, level.height) {
                for (i, across) in covered(x, width, level.width) {
                    let value = level.values[j * level.width + i];
                    for (sum, value) in sum.iter_mut().zip(value) {
                        *sum += value * (up * across);
                    }
                }
            }
            values.push(sum);
        }
    }
    Level {
        width,
        height,
        values,
    }
}

impl UvTransform {
    /// By how much areas grow.
    pub(super) fn area(&self) -> f64 {
        let [[a, b, _], [c, d, _]] = self.0;
        (a * d - b * c).abs()
    }
}

//! Whether noise alone explains the difference of two images.

use statrs::distribution::{ContinuousCDF, Normal};

use crate::image::Window;

/// The chance that a test fails although both images have the same expectation.
pub const FALSE_ALARM_RATE: f64 = 0.01;

/// Side of the blocks in pixels that are tested as wholes.
const BLOCK: u32 = 8;

/// How far around a pixel [`guard_variance`] looks, in pixels.
const NEIGHBOURHOOD: u32 = 2;

/// How exact the values of two images are at best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Sums in f32 or better.
    #[default]
    Full,
    /// One of them was stored in half floats.
    Half,
}

impl Precision {
    /// The largest error relative to the value.
    fn rounding(self) -> f64 {
        match self {
            // Rounding to f32 and differing orders of summation: a few units in
            // the last place.
            Self::Full => 1.0 / f64::from(1 << 20),
            // Half a unit in the last of 11 places.
            Self::Half => 1.0 / f64::from(1 << 11),
        }
    }
}

/// Per-pixel z-tests, and what only shows in many pixels together.
///
/// z = (a − b) / √(Var\[a\] + Var\[b\]) in each pixel and channel is standard
/// normal if both have the same expectation, if enough samples went into each,
/// and if the variances are right; those of stratified samples are overrated,
/// which makes the tests lenient. Skewed noise of few samples can still pass a
/// bound by chance more often than said: repeat with more samples or other seeds. The bounds are Šidák's: all of n independent
/// |z| stay below with probability 1 − [`FALSE_ALARM_RATE`].
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ZTest {
    /// The z of each channel's mean over all pixels, signed. (Channels are not
    /// independent: a path lights up all three.)
    pub z_mean: [f64; 3],
    /// The largest |z| of a pixel's channel.
    pub z_max: f64,
    /// What it should stay below.
    pub z_bound: f64,
    /// Pixels with a channel past the bound.
    pub z_failed_pixels: usize,
    /// Mean of z², about 1 if the variances are right and nothing else differs.
    pub z_chi2: f64,
    /// How far that is from 1 in standard errors, which are estimated from the
    /// pixels themselves, since channels depend on each other and noise has
    /// heavier tails than the normal distribution. Negative when the variances
    /// are overrated.
    pub z_chi2_score: f64,
    /// The largest |z| of a channel's mean over a block of 8 × 8 pixels, which
    /// finds faint bias that neighbours share.
    pub z_block_max: f64,
    /// What it should stay below.
    pub z_block_bound: f64,
    /// Blocks with a channel past the bound.
    pub z_failed_blocks: usize,
}

impl ZTest {
    /// Whether no bound was passed; wrong once in 50 times at most where all
    /// differences are noise (pixels and blocks each 1 %).
    pub fn passed(&self) -> bool {
        self.z_failed_pixels == 0 && self.z_failed_blocks == 0
    }
}

/// Tests `a` against `b`, both covering `window`. `variance` is the sum of the
/// variances of their pixels' means, in squared radiance. Pixels with a value
/// that is not finite are left out.
pub fn z_test(
    window: Window,
    a: &[[f32; 3]],
    b: &[[f32; 3]],
    variance: &[[f64; 3]],
    precision: Precision,
) -> ZTest {
    let columns = window.width.div_ceil(BLOCK) as usize;
    let rows = window.height.div_ceil(BLOCK) as usize;
    let mut blocks = vec![[Sum::default(); 3]; columns * rows];
    let mut whole = [Sum::default(); 3];
    let mut largest = Vec::with_capacity(a.len());
    let mut squares = Vec::with_capacity(a.len());
    for (index, ((a, b), variance)) in a.iter().zip(b).zip(variance).enumerate() {
        let finite = |c: usize| a[c].is_finite() && b[c].is_finite() && variance[c].is_finite();
        if !(0..3).all(finite) {
            continue;
        }
        let (x, y) = (index as u32 % window.width, index as u32 / window.width);
        let block = &mut blocks[(y / BLOCK) as usize * columns + (x / BLOCK) as usize];
        for channel in 0..3 {
            let term = Sum::new(a[channel], b[channel], variance[channel], precision);
            block[channel].add(term);
            whole[channel].add(term);
        }
        let z = pixel_z(*a, *b, *variance, precision);
        squares.push(z.iter().map(|z| z * z).sum::<f64>() / 3.0);
        largest.push(z.iter().map(|z| z.abs()).fold(0.0, f64::max));
    }
    let block_z = blocks.iter().map(|block| {
        let z = block.iter().map(|channel| channel.z().abs());
        z.fold(0.0, f64::max)
    });
    let block_z: Vec<f64> = block_z.collect();
    let z_bound = sidak_bound(3.0 * largest.len() as f64);
    let z_block_bound = sidak_bound(3.0 * block_z.len() as f64);
    let n = squares.len() as f64;
    let z_chi2 = squares.iter().sum::<f64>() / n;
    let deviations = squares.iter().map(|square| (square - z_chi2).powi(2));
    let standard_error = (deviations.sum::<f64>() / (n * (n - 1.0))).sqrt();
    let max = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let past = |values: &[f64], bound| values.iter().filter(|&&z| z > bound).count();
    ZTest {
        z_mean: whole.map(|channel| channel.z()),
        z_max: max(&largest),
        z_bound,
        z_failed_pixels: past(&largest, z_bound),
        z_chi2,
        z_chi2_score: (z_chi2 - 1.0) / standard_error,
        z_block_max: max(&block_z),
        z_block_bound,
        z_failed_blocks: past(&block_z, z_block_bound),
    }
}

/// Raises each pixel's estimated variance to the mean over the 5 × 5 pixels
/// around it, if that is larger. A pixel where an event that is rare but counts
/// has not come up yet knows nothing of its variance; its neighbours do. Noise
/// is overrated by that in places, never underrated.
pub(super) fn guard_variance(window: Window, variance: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let around = |x: u32, size: u32| {
        let end = (x + NEIGHBOURHOOD + 1).min(size);
        x.saturating_sub(NEIGHBOURHOOD)..end
    };
    let guarded = |(index, own): (usize, &[f32; 3])| {
        let (x, y) = (index as u32 % window.width, index as u32 / window.width);
        let mut sum = [0.0; 3];
        let mut count = 0.0;
        for row in around(y, window.height) {
            let start = (row * window.width) as usize;
            for column in around(x, window.width) {
                let value = variance[start + column as usize];
                sum = [0, 1, 2].map(|c| sum[c] + f64::from(value[c]));
                count += 1.0;
            }
        }
        [0, 1, 2].map(|c| f64::from(own[c]).max(sum[c] / count))
    };
    variance.iter().enumerate().map(guarded).collect()
}

/// Sums of differences and of what is known of their size.
#[derive(Clone, Copy, Default)]
struct Sum {
    difference: f64,
    variance: f64,
    /// Largest rounding error. It adds up linearly, since rounding may go the
    /// same way in neighbours.
    rounding: f64,
}

impl Sum {
    fn new(a: f32, b: f32, variance: f64, precision: Precision) -> Self {
        let (a, b) = (f64::from(a), f64::from(b));
        Self {
            difference: a - b,
            variance,
            rounding: precision.rounding() * a.abs().max(b.abs()),
        }
    }

    fn add(&mut self, other: Self) {
        self.difference += other.difference;
        self.variance += other.variance;
        self.rounding += other.rounding;
    }

    fn z(&self) -> f64 {
        if self.difference == 0.0 {
            return 0.0;
        }
        self.difference / (self.variance + self.rounding * self.rounding).sqrt()
    }
}

/// z of each channel of a pixel.
pub(super) fn pixel_z(
    a: [f32; 3],
    b: [f32; 3],
    variance: [f64; 3],
    precision: Precision,
) -> [f64; 3] {
    [0, 1, 2].map(|c| Sum::new(a[c], b[c], variance[c], precision).z())
}

/// The bound that all of `n` independent standard normal |z| stay below with
/// probability 1 − [`FALSE_ALARM_RATE`] (Šidák 1967).
fn sidak_bound(n: f64) -> f64 {
    let each = -((-FALSE_ALARM_RATE).ln_1p() / n.max(1.0)).exp_m1();
    let normal = Normal::standard();
    -normal.inverse_cdf(0.5 * each)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Dimension, Sampler};

    const SIDE: u32 = 64;
    const WINDOW: Window = Window::full([SIDE, SIDE]);
    const SIGMA: f64 = 0.1;

    /// A picture of normal noise about 1, by Box and Muller's method.
    fn noise(seed: u64) -> Vec<[f32; 3]> {
        let pixel = |pixel| {
            let u = Sampler::new(seed, pixel, 0).get_4d(Dimension::bsdf(0));
            let normal = |radius: f32, angle: f32| {
                let radius = (-2.0 * f64::from(1.0 - radius).ln()).sqrt();
                radius * (std::f64::consts::TAU * f64::from(angle)).cos()
            };
            let z = [normal(u[0], u[1]), normal(u[2], u[3]), normal(u[1], u[2])];
            z.map(|z| (1.0 + SIGMA * z) as f32)
        };
        WINDOW.pixels().map(pixel).collect()
    }

    fn test(a: &[[f32; 3]], b: &[[f32; 3]]) -> ZTest {
        let variance = vec![[2.0 * SIGMA * SIGMA; 3]; a.len()];
        z_test(WINDOW, a, b, &variance, Precision::Full)
    }

    /// Quantiles of the normal distribution from tables: 2.5758 for 1 % on two
    /// sides; for 100 tests 1 − 0.99^0.01 = 1.00498e-4 each: 3.8893.
    #[test]
    fn bounds_are_known_quantiles() {
        assert!((sidak_bound(1.0) - 2.575_83).abs() < 1e-4);
        assert!((sidak_bound(100.0) - 3.889_3).abs() < 2e-3);
        assert!(sidak_bound(1e6) > 5.7 && sidak_bound(1e6) < 5.8);
    }

    /// Of 200 pairs without a difference, four are expected to fail a bound at
    /// most, with a standard deviation of 2; more than 14 have a chance below
    /// 1e-4, and none at all would mean that the bounds are too wide.
    #[test]
    fn false_alarms_come_at_their_rate() {
        let results: Vec<ZTest> = (0..200)
            .map(|pair| test(&noise(2 * pair), &noise(2 * pair + 1)))
            .collect();
        let alarms = results.iter().filter(|z| !z.passed()).count();
        assert!((1..=14).contains(&alarms), "{alarms}");
        let score = |z: &ZTest| z.z_chi2_score;
        let mean = results.iter().map(score).sum::<f64>() / results.len() as f64;
        // The mean of 200 scores has σ = 0.07.
        assert!(mean.abs() < 0.35, "{mean}");
    }

    /// A bias of 0.7 σ that a corner shares: a z of 0.5 in each pixel is too
    /// faint to see, one of 4 in each of its 16 blocks is not.
    #[test]
    fn faint_shared_bias_shows_in_blocks() {
        let (mut a, b) = (noise(1), noise(2));
        assert!(test(&a, &b).passed());
        for (index, color) in a.iter_mut().enumerate() {
            if index as u32 % SIDE < 32 && (index as u32 / SIDE) < 32 {
                *color = color.map(|c| c + 0.7 * SIGMA as f32);
            }
        }
        let result = test(&a, &b);
        assert_eq!(result.z_failed_pixels, 0, "{result:?}");
        assert!(result.z_failed_blocks > 0, "{result:?}");
        assert!(result.z_mean.iter().all(|&z| z > 5.0), "{result:?}");
    }

    #[test]
    fn one_wrong_pixel_is_found() {
        let (mut a, b) = (noise(3), noise(4));
        a[1234][1] += 1.0;
        let result = test(&a, &b);
        assert_eq!(result.z_failed_pixels, 1);
        assert!(result.z_max > 5.0);
    }

    /// Rare events: one pixel in 20 has had one and knows its variance.
    #[test]
    fn neighbours_vouch_for_the_variance() {
        let window = Window::full([20, 20]);
        let mut variance = vec![[0.0_f32; 3]; 400];
        for (index, value) in variance.iter_mut().enumerate().step_by(20) {
            value[0] = 1.0 + index as f32;
        }
        let guarded = guard_variance(window, &variance);
        // In the first row, 1 + 21 + 41 over 3 × 3, 3 × 4 and 3 × 5 pixels; in
        // the last one, the own value is the largest.
        assert_eq!(guarded[0][0], 63.0 / 9.0);
        assert_eq!(guarded[1][0], 63.0 / 12.0);
        assert_eq!(guarded[2][0], 63.0 / 15.0);
        assert_eq!(guarded[3], [0.0; 3]);
        assert_eq!(guarded[380][0], 381.0);
    }

    #[test]
    fn exact_images_may_differ_by_rounding_alone() {
        let exact = vec![[0.0; 3]; WINDOW.area()];
        let a = vec![[0.3_f32; 3]; WINDOW.area()];
        let next = f32::from_bits(0.3_f32.to_bits() + 1);
        let mut b = vec![[next; 3]; WINDOW.area()];
        assert!(z_test(WINDOW, &a, &b, &exact, Precision::Full).passed());
        b[0] = [0.300_01; 3];
        let result = z_test(WINDOW, &a, &b, &exact, Precision::Full);
        assert_eq!(result.z_failed_pixels, 1);
        // What is not finite is left out: `compare` counts it.
        b[0] = [f32::NAN; 3];
        assert!(z_test(WINDOW, &a, &b, &exact, Precision::Full).passed());
    }
}

//! Pixel filters.

use std::f64::consts::TAU;

/// Coefficients of the four-term Blackman-Harris window (Harris 1978, "On the
/// Use of Windows for Harmonic Analysis with the Discrete Fourier Transform",
/// Proc. IEEE 66(1), table I), minimum three-sample-lobe version.
const BLACKMAN_HARRIS: [f64; 4] = [0.35875, 0.48829, 0.14128, 0.01168];

/// Intervals of the table of the inverse distribution function.
const INTERVALS: usize = 256;

/// How a pixel weighs what is around its centre.
///
/// Sampled in proportion to its value, so that every sample has the same weight
/// and belongs to one pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelFilter {
    /// Left half of the inverse of the distribution function, in pixels; none
    /// for the box. Evenly spaced in √(2u), which makes the intervals short
    /// where the window vanishes and the inverse is steep.
    inverse: Option<Vec<f32>>,
}

impl PixelFilter {
    /// The average over the pixel's own square.
    pub const fn box_filter() -> Self {
        Self { inverse: None }
    }

    /// A separable Blackman-Harris window of full width `width` in pixels; twice
    /// what Blender calls its width.
    pub fn blackman_harris(width: f32) -> Self {
        let inverse = (0..=INTERVALS).map(|i| {
            let root = i as f64 / INTERVALS as f64;
            let target = 0.5 * root * root;
            // The distribution function rises monotonically: bisect, until the
            // interval is below the resolution of f32.
            let (mut low, mut high) = (0.0, 0.5);
            for _ in 0..32 {
                let middle = 0.5 * (low + high);
                if distribution(middle) < target {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            (0.5 * (low + high) - 0.5) as f32 * width
        });
        Self {
            inverse: Some(inverse.collect()),
        }
    }

    /// Offset from the pixel's centre in pixels, for `u` uniform in [0, 1)².
    #[inline]
    pub fn offset(&self, u: [f32; 2]) -> [f32; 2] {
        match &self.inverse {
            None => u.map(|u| u - 0.5),
            Some(inverse) => u.map(|u| {
                let position = (2.0 * u.min(1.0 - u)).sqrt() * INTERVALS as f32;
                let index = (position as usize).min(INTERVALS - 1);
                let [outer, inner] = [inverse[index], inverse[index + 1]];
                let left = outer + (inner - outer) * (position - index as f32);
                if u < 0.5 { left } else { -left }
            }),
        }
    }
}

/// Integral of the window over [0, t], scaled to 1 for t = 1.
fn distribution(t: f64) -> f64 {
    let [a0, a1, a2, a3] = BLACKMAN_HARRIS;
    let term = |a: f64, k: f64| a * (k * TAU * t).sin() / (k * TAU);
    t + (-term(a1, 1.0) + term(a2, 2.0) - term(a3, 3.0)) / a0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_covers_the_pixel() {
        let filter = PixelFilter::box_filter();
        assert_eq!(filter.offset([0.0, 0.75]), [-0.5, 0.25]);
    }

    /// Moments over a regular grid, against sums over the window itself.
    #[test]
    fn blackman_harris_offsets_have_the_moments_of_the_window() {
        const N: usize = 100_000;
        let width = 1.5;
        let filter = PixelFilter::blackman_harris(width);
        let centred = |i: usize| (i as f64 + 0.5) / N as f64;
        let window = |t: f64| {
            let [a0, a1, a2, a3] = BLACKMAN_HARRIS;
            let cosine = |k: f64| (k * TAU * t).cos();
            a0 - a1 * cosine(1.0) + a2 * cosine(2.0) - a3 * cosine(3.0)
        };
        let moment = |power: i32| {
            let (mut weighted, mut total) = (0.0, 0.0);
            for t in (0..N).map(centred) {
                let x = (t - 0.5) * f64::from(width);
                weighted += window(t) * x.powi(power);
                total += window(t);
            }
            weighted / total
        };
        let offsets = || (0..N).map(|i| f64::from(filter.offset([centred(i) as f32, 0.5])[0]));
        for power in [1, 2, 4] {
            let sampled = offsets().map(|x| x.powi(power)).sum::<f64>() / N as f64;
            let exact = moment(power);
            assert!((sampled - exact).abs() < 1e-5, "{power}: {sampled} {exact}");
        }
        let half = f64::from(width) / 2.0;
        assert!(offsets().all(|x| x.abs() <= half));
        let increasing = offsets().zip(offsets().skip(1)).all(|(a, b)| a <= b);
        assert!(increasing, "stratification survives");
        assert!(filter.offset([0.5, 0.5])[1].abs() < 1e-6);
    }
}

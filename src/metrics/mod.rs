//! How far two images are apart, and whether noise explains it.
//!
//! Images are slices of scene-linear colours of equal length, the tested one
//! first and the reference second. Errors are averaged over pixels and colour
//! channels alike. [`Pair`] has all of them at once, for images
//! from files.

mod compare;
mod flip;
mod map;
mod outliers;
mod ztest;

pub use compare::{CompareError, Comparison, Pair};
pub use flip::flip;
pub use map::{DifferenceMap, relative_difference_map, z_map};
pub use outliers::{OUTLIER, Outliers, outliers};
pub use ztest::{FALSE_ALARM_RATE, Precision, ZTest, z_test};

/// The ε of relative errors, in squared radiance: errors of pixels darker than
/// √ε = 0.1 count less than their relative size.
pub const REL_EPSILON: f64 = 0.01;

/// The share of the worst pixels that robust figures leave out.
pub const TRIM: f64 = 1e-3;

/// Mean of each channel, in radiance.
pub fn mean(image: &[[f32; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for color in image {
        for (sum, &value) in sum.iter_mut().zip(color) {
            *sum += f64::from(value);
        }
    }
    sum.map(|sum| sum / image.len() as f64)
}

/// Mean squared error, in squared radiance.
pub fn mse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    average(a, b, |a, b| (a - b) * (a - b))
}

/// Relative mean squared error (a − b)² / (b² + ε), without unit; its root is
/// the relative RMSE.
pub fn rel_mse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    average(a, b, relative_square)
}

/// [`rel_mse`] without the worst [`TRIM`] of the pixels, for images with
/// fireflies.
pub fn rel_mse_trimmed(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let mut errors = per_pixel(a, b, relative_square).collect::<Vec<_>>();
    trimmed_mean(&mut errors)
}

/// By how much the image is too bright as a whole: (Σa − Σb) / Σb over pixels
/// and channels, signed, without unit.
pub fn rel_bias(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    average(a, b, |a, b| a - b) / average(a, b, |_, b| b)
}

/// [`rel_bias`] over all but those [`TRIM`] of the pixels that differ most, for
/// images with fireflies. Fireflies carry energy: an image that has them loses
/// it here, which the plain bias does not.
pub fn rel_bias_trimmed(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let mut pixels: Vec<(f64, f64)> = per_pixel(a, b, |a, b| a - b)
        .zip(per_pixel(a, b, |_, b| b))
        .collect();
    let kept = kept(pixels.len());
    if kept < pixels.len() {
        pixels.select_nth_unstable_by(kept, |a, b| a.0.abs().total_cmp(&b.0.abs()));
    }
    let (difference, reference) = pixels[..kept]
        .iter()
        .fold((0.0, 0.0), |sum, pixel| (sum.0 + pixel.0, sum.1 + pixel.1));
    difference / reference
}

/// The relMSE that an image's own noise is expected to cause against a
/// noiseless reference: mean of variance / (b² + ε), `variance` being that of
/// each pixel's mean. What a noisy reference adds to a measured relMSE.
pub fn noise_floor(image: &[[f32; 3]], variance: &[[f32; 3]]) -> f64 {
    average(variance, image, |v, b| v / (b * b + REL_EPSILON))
}

/// Mean of all but the largest [`TRIM`] of the values, which it reorders; NaN
/// when there are none. Of fewer than 1/[`TRIM`] values, all count.
pub fn trimmed_mean(values: &mut [f64]) -> f64 {
    let kept = kept(values.len());
    if kept < values.len() {
        values.select_nth_unstable_by(kept, f64::total_cmp);
    }
    values[..kept].iter().sum::<f64>() / kept as f64
}

/// How many of `count` values robust figures take in.
fn kept(count: usize) -> usize {
    count - (count as f64 * TRIM) as usize
}

fn relative_square(a: f64, b: f64) -> f64 {
    (a - b) * (a - b) / (b * b + REL_EPSILON)
}

/// Mean of `term` over pixels and channels.
fn average(a: &[[f32; 3]], b: &[[f32; 3]], term: impl Fn(f64, f64) -> f64) -> f64 {
    per_pixel(a, b, term).sum::<f64>() / a.len() as f64
}

/// Mean of `term` over the channels, for each pixel.
fn per_pixel(
    a: &[[f32; 3]],
    b: &[[f32; 3]],
    term: impl Fn(f64, f64) -> f64,
) -> impl Iterator<Item = f64> {
    assert_eq!(a.len(), b.len(), "images of different size");
    a.iter().zip(b).map(move |(a, b)| {
        let channel = |c: usize| term(f64::from(a[c]), f64::from(b[c]));
        (channel(0) + channel(1) + channel(2)) / 3.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [[f32; 3]; 2] = [[1.0, 2.0, 3.0], [0.0, 0.5, 0.25]];
    const B: [[f32; 3]; 2] = [[1.5, 2.0, 2.0], [0.0, 0.25, 0.75]];

    fn close(value: f64, expected: f64) {
        let error = (value - expected).abs();
        assert!(error <= 1e-12 * expected.abs(), "{value}, not {expected}");
    }

    #[test]
    fn errors_of_two_pixels_by_hand() {
        assert_eq!(mean(&A), [0.5, 1.25, 1.625]);
        // Squared differences: 0.25, 0, 1; 0, 0.0625, 0.25.
        close(mse(&A, &B), 1.5625 / 6.0);
        // Over b² + 0.01: 2.26, 4.01, 4.01; 0.01, 0.0725, 0.5725.
        let terms = 0.25 / 2.26 + 1.0 / 4.01 + 0.0625 / 0.0725 + 0.25 / 0.5725;
        close(rel_mse(&A, &B), terms / 6.0);
        // Σa = 6.75, Σb = 6.5.
        close(rel_bias(&A, &B), 0.25 / 6.5);
        close(noise_floor(&B, &A), {
            let first = 1.0 / 2.26 + 2.0 / 4.01 + 3.0 / 4.01;
            (first + 0.5 / 0.0725 + 0.25 / 0.5725) / 6.0
        });
    }

    /// 2000 pixels, of which the two worst are left out.
    #[test]
    fn trimming_leaves_out_the_worst_pixels() {
        let b = vec![[1.0; 3]; 2000];
        let mut a = vec![[1.1; 3]; 2000];
        let clean = [rel_mse(&a, &b), rel_bias(&a, &b)];
        a[7] = [1000.0, 1.0, 1.0];
        a[1999] = [0.0, 50.0, 0.0];
        assert!(rel_mse(&a, &b) > 100.0);
        close(rel_mse_trimmed(&a, &b), clean[0]);
        close(rel_bias_trimmed(&a, &b), clean[1]);
        a[8] = [3.1, 1.1, 1.1];
        assert!(rel_mse_trimmed(&a, &b) > clean[0] * 1.01, "no third one");
        assert!(rel_bias_trimmed(&a, &b) > clean[1] * 1.001);
    }

    #[test]
    fn few_pixels_are_not_trimmed() {
        close(rel_mse_trimmed(&A, &B), rel_mse(&A, &B));
        close(rel_bias_trimmed(&A, &B), rel_bias(&A, &B));
        assert!(trimmed_mean(&mut []).is_nan());
    }
}

//! How far single pixels stick out of an image's noise.

use super::REL_EPSILON;

/// From how many robust standard deviations on a difference is an outlier. Normal noise
/// has none: once in 10²³ values.
pub const OUTLIER: f64 = 10.0;

/// The standard deviation of the normal distribution over the median of what its absolute
/// values are.
const SD_PER_MEDIAN: f64 = 1.482_602_218_505_602;

/// Differences that an image's noise in general does not explain.
///
/// They are (a − b) / √(b² + ε) of each pixel and channel, and their spread is told by
/// the median, which fireflies do not move. As it is one spread for the whole image, a
/// place where the image is noisier than elsewhere counts as well as a firefly does.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Outliers {
    /// Robust standard deviation of the differences, 1.4826 times the median of their
    /// absolute values, without unit. Values that are equal are left out: they have no
    /// noise.
    pub robust_sd: f64,
    /// The largest difference in units of `robust_sd`.
    pub largest_deviation: f64,
    /// Values, three to a pixel, beyond [`OUTLIER`] of them.
    pub outliers: usize,
}

/// Looks for outliers in `a` against the reference `b`.
pub fn outliers(a: &[[f32; 3]], b: &[[f32; 3]]) -> Outliers {
    assert_eq!(a.len(), b.len(), "images of different size");
    let values = a.as_flattened().iter().zip(b.as_flattened());
    let relative = values.map(|(&a, &b)| {
        let (a, b) = (f64::from(a), f64::from(b));
        (a - b).abs() / (b * b + REL_EPSILON).sqrt()
    });
    let mut differences: Vec<f64> = relative.filter(|&d| d > 0.0).collect();
    if differences.is_empty() {
        return Outliers::default();
    }
    let middle = differences.len() / 2;
    let (_, &mut median, _) = differences.select_nth_unstable_by(middle, f64::total_cmp);
    let robust_sd = SD_PER_MEDIAN * median;
    let largest = differences.iter().copied().fold(0.0, f64::max);
    Outliers {
        robust_sd,
        largest_deviation: largest / robust_sd,
        outliers: differences
            .iter()
            .filter(|&&d| d > OUTLIER * robust_sd)
            .count(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 999 values off by 1 to 999 thousandths in some order, and one of a thousand equal.
    fn images() -> [Vec<[f32; 3]>; 2] {
        let b = vec![[0.0; 3]; 1000];
        let a = (0..1000_i16)
            .map(|i| [f32::from(i * 7 % 1000) * 1e-4; 3])
            .collect();
        [a, b]
    }

    /// ε turns a difference of 1e-4 from black into 1e-3; the median of 1 to 999 is 500.
    #[test]
    fn the_spread_is_told_by_the_median() {
        let [mut a, b] = images();
        let clean = outliers(&a, &b);
        assert!(
            (clean.robust_sd / 0.741_301_109 - 1.0).abs() < 1e-6,
            "{clean:?}"
        );
        assert!((clean.largest_deviation / (0.999 / 0.741_301_109) - 1.0).abs() < 1e-6);
        assert_eq!(clean.outliers, 0);
        let highest = a.iter().position(|v| v[0] > 0.0998).expect("999 of them");
        a[highest][1] = 500.0;
        a[highest][2] = 0.742;
        let found = outliers(&a, &b);
        assert_eq!((found.robust_sd, found.outliers), (clean.robust_sd, 2));
        assert!((found.largest_deviation / (5000.0 / 0.741_301_109) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn equal_images_have_none() {
        let [a, _] = images();
        assert_eq!(outliers(&a, &a), Outliers::default());
    }
}

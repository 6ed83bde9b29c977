//! Differences as pictures.

use super::REL_EPSILON;
use super::ztest::Precision;

/// Colours of a diverging scale (RdBu of ColorBrewer 2.0): too dark, equal, too
/// bright.
const SCALE: [[f64; 3]; 3] = [[33.0, 102.0, 172.0], [247.0; 3], [178.0, 24.0, 43.0]];

/// The colour of what can't be compared.
const NOT_FINITE: [u8; 3] = [0, 160, 0];

/// The share of pixels whose difference may be larger than the scale shows.
const BEYOND_SCALE: f64 = 0.005;

/// Signed differences per pixel in colours: blue where the tested image is
/// darker, white where both agree, red where it is brighter, green where a
/// value is not finite.
#[derive(Clone, Debug, PartialEq)]
pub struct DifferenceMap {
    /// Red, green and blue in sRGB, row by row.
    pub pixels: Vec<u8>,
    /// The difference that has the full colour, and all larger ones.
    pub full_scale: f64,
}

impl DifferenceMap {
    fn new(values: &[f64], full_scale: f64) -> Self {
        let color = |&value: &f64| {
            if !value.is_finite() {
                return NOT_FINITE;
            }
            let position = (value / full_scale).clamp(-1.0, 1.0);
            let end = if position < 0.0 { SCALE[0] } else { SCALE[2] };
            let mix = |c: usize| SCALE[1][c] + (end[c] - SCALE[1][c]) * position.abs();
            [0, 1, 2].map(|c| mix(c).round() as u8)
        };
        Self {
            pixels: values.iter().flat_map(color).collect(),
            full_scale,
        }
    }
}

/// Maps (a − b) / √(b² + ε), averaged over the channels. The scale reaches
/// beyond nearly all pixels' differences, to the next 1, 2 or 5 × 10ⁿ.
pub fn relative_difference_map(a: &[[f32; 3]], b: &[[f32; 3]]) -> DifferenceMap {
    let relative = |a: f64, b: f64| (a - b) / (b * b + REL_EPSILON).sqrt();
    let values: Vec<f64> = super::per_pixel(a, b, relative).collect();
    let sizes = values.iter().map(|value| value.abs());
    let mut sizes: Vec<f64> = sizes.filter(|size| size.is_finite()).collect();
    let beyond = (sizes.len() as f64 * BEYOND_SCALE) as usize;
    let shown = sizes.len().saturating_sub(beyond + 1);
    let size = match sizes.is_empty() {
        true => 0.0,
        false => *sizes.select_nth_unstable_by(shown, f64::total_cmp).1,
    };
    DifferenceMap::new(&values, round_up(size))
}

/// Maps z-scores, as [`super::z_test`] makes them, the most extreme of a
/// pixel's channels; full colour at 5.
pub fn z_map(
    a: &[[f32; 3]],
    b: &[[f32; 3]],
    variance: &[[f64; 3]],
    precision: Precision,
) -> DifferenceMap {
    let pixels = a.iter().zip(b).zip(variance);
    let values = pixels.map(|((&a, &b), &variance)| {
        let z = super::ztest::pixel_z(a, b, variance, precision);
        let most_extreme = |x: f64, y: f64| if y.abs() > x.abs() { y } else { x };
        match z.iter().all(|z| z.is_finite()) {
            true => z.into_iter().fold(0.0, most_extreme),
            false => f64::NAN,
        }
    });
    DifferenceMap::new(&values.collect::<Vec<_>>(), 5.0)
}

/// The next 1, 2 or 5 × 10ⁿ; 1e-6 for anything smaller.
fn round_up(value: f64) -> f64 {
    let value = value.max(1e-6);
    let decade = 10_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
    // The last one is larger but for rounding.
    let fitting = steps.into_iter().find(|&step| step >= value);
    fitting.unwrap_or(steps[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_show_sign_and_size() {
        let b = vec![[1.0; 3]; 5];
        let a = [1.0, 1.02, 0.98, f32::NAN, 1.01].map(|value| [value; 3]);
        let map = relative_difference_map(&a, &b);
        // 0.02 / √1.01 = 0.0199.
        assert!((map.full_scale - 0.02).abs() < 1e-12);
        let color = |pixel: usize| &map.pixels[3 * pixel..3 * pixel + 3];
        assert_eq!(color(0), [247; 3]);
        assert_eq!(color(3), [0, 160, 0]);
        let [red, _, blue] = color(1).try_into().unwrap();
        assert!(red > 150 && blue < 60, "brighter is red");
        let [red, _, blue] = color(2).try_into().unwrap();
        assert!(red < 60 && blue > 150, "darker is blue");
        assert!(color(4)[1] > color(1)[1], "less is paler");
    }

    #[test]
    fn scales_are_round() {
        for (value, expected) in [(0.013, 0.02), (0.051, 0.1), (3.0, 5.0), (0.0, 1e-6)] {
            assert!((round_up(value) / expected - 1.0).abs() < 1e-9, "{value}");
        }
    }

    #[test]
    fn the_most_extreme_channel_counts() {
        let map = z_map(
            &[[1.0, 0.5, 1.1]],
            &[[1.0; 3]],
            &[[0.01; 3]],
            Precision::Full,
        );
        assert_eq!(map.pixels, SCALE[0].map(|c| c as u8), "z = −5");
    }
}

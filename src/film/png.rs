//! Display-referred PNG.

use super::Image;

/// The image as 8-bit sRGB, row by row: scaled by 2^`exposure`, cut off at
/// white, encoded with the sRGB transfer function (IEC 61966-2-1).
pub(super) fn encode(image: &Image, exposure: f32) -> Vec<u8> {
    let scale = exposure.exp2();
    // A cast turns NaN into 0.
    let quantise = |c: f32| (srgb(c * scale) * 255.0 + 0.5) as u8;
    let pixels = image.color.iter();
    pixels.flat_map(|color| color.map(quantise)).collect()
}

/// The sRGB transfer function: linear in, encoded out, both in [0, 1].
fn srgb(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Window;

    /// Values from the definition: mid grey 0.214041 is code 127.5 / 255; 0.18
    /// is 0.461356.
    #[test]
    fn transfer_function_has_known_values() {
        assert!((srgb(0.214_041) - 0.5).abs() < 1e-5);
        assert!((srgb(0.18) - 0.461_356).abs() < 1e-5);
        assert!((srgb(0.003_130_8) - 0.040_45).abs() < 1e-5);
        assert!((srgb(1.0) - 1.0).abs() < 1e-6);
        assert_eq!(srgb(7.0), srgb(1.0));
        assert_eq!(srgb(-1.0), 0.0);
    }

    #[test]
    fn exposure_counts_in_stops() {
        let mut image = Image::black([1, 1], Window::full([1, 1]));
        image.color[0] = [0.25, 0.5, f32::NAN];
        assert_eq!(encode(&image, 1.0), [188, 255, 0]);
        assert_eq!(encode(&image, 2.0), [255, 255, 0]);
    }
}

//! From scene-linear light to what a display shows.

use super::{Image, Log2, Lut};

/// How images become 8-bit colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Display {
    /// In stops: light is scaled by 2^exposure first.
    pub exposure: f32,
    /// The view transform; without one the sRGB transfer function (IEC 61966-2-1), cut
    /// off at white.
    pub lut: Option<Lut>,
}

impl Display {
    /// Plain sRGB, at an exposure in stops.
    #[must_use]
    pub fn srgb(exposure: f32) -> Self {
        Self {
            exposure,
            lut: None,
        }
    }

    /// All of it, as films hold it: the exposure, the nodes per side of the table (0 for
    /// none), its domain and its colours, as little-endian numbers of four bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.exposure.to_le_bytes().to_vec();
        let side = self.lut.as_ref().map_or(0, Lut::side);
        bytes.extend_from_slice(&(side as u32).to_le_bytes());
        if let Some(lut) = &self.lut {
            let Log2 { offset, min, max } = lut.domain();
            let nodes = lut.nodes().as_flattened();
            for value in [offset, min, max].iter().chain(nodes) {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
        }
        bytes
    }

    /// The image's colour in 8 bits, row by row. NaN becomes black.
    #[must_use]
    pub fn encode(&self, image: &Image) -> Vec<u8> {
        let pixels = image.color.iter().flat_map(|&color| self.show(color));
        pixels.collect()
    }

    /// The same with the image's alpha as a fourth channel: the colours are divided by it,
    /// but for those that shine without covering anything.
    #[must_use]
    pub fn encode_with_alpha(&self, image: &Image, alpha: &[f32]) -> Vec<u8> {
        let pixels = image.color.iter().zip(alpha).flat_map(|(&color, &alpha)| {
            let whole = if alpha > 0.0 { 1.0 / alpha } else { 1.0 };
            let [r, g, b] = self.show(color.map(|c| c * whole));
            [r, g, b, quantise(alpha)]
        });
        pixels.collect()
    }

    fn show(&self, color: [f32; 3]) -> [u8; 3] {
        let scale = self.exposure.exp2();
        let scaled = color.map(|c| c * scale);
        let shown = match &self.lut {
            Some(lut) => lut.look_up(scaled),
            None => scaled.map(srgb),
        };
        shown.map(quantise)
    }
}

fn quantise(share: f32) -> u8 {
    // A cast cuts off, and turns NaN into 0.
    (share * 255.0 + 0.5) as u8
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
    use crate::image::Window;

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
        assert_eq!(Display::srgb(1.0).encode(&image), [188, 255, 0]);
        assert_eq!(Display::srgb(2.0).encode(&image), [255, 255, 0]);
    }

    /// Half covered by 0.25: the colour is that of the whole; what covers nothing shines.
    #[test]
    fn colours_are_divided_by_alpha() {
        let mut image = Image::black([3, 1], Window::full([3, 1]));
        image.color = vec![[0.125; 3], [0.25; 3], [0.0; 3]];
        let shown = Display::default().encode_with_alpha(&image, &[0.5, 0.0, 0.0]);
        assert_eq!(shown, [137, 137, 137, 128, 137, 137, 137, 0, 0, 0, 0, 0]);
    }
}

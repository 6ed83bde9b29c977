//! Images that are looked up by texture coordinates or by direction.

mod cache;
mod hdr;
mod load;

pub use cache::Images;
pub use load::{EnvironmentImage, load_environment};

use crate::memory::Budget;
use exr::prelude::f16;
use serde::Deserialize;
use std::collections::HashSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How stored values become linear ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColorSpace {
    /// Decoded by the sRGB transfer function; alpha is not.
    Srgb,
    /// Scene-linear Rec. 709, taken as it is.
    Linear,
    /// Numbers, taken as they are.
    #[default]
    NonColor,
}

/// What happens between pixel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// The four nearest pixels, weighted.
    #[default]
    Bilinear,
    /// The nearest pixel.
    Closest,
}

/// The part of a texture that stands for a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
    /// The Rec. 709 luminance of the linear colour.
    #[default]
    Luminance,
}

/// An image that repeats over the plane of texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Shared by all textures of the same file.
    image: Arc<Image>,
    color_space: ColorSpace,
    interpolation: Interpolation,
    scale: [f32; 2],
    offset: [f32; 2],
}

/// Pixels as they are stored, row by row from the top, channels interleaved:
/// grey, grey and alpha, RGB or RGBA.
#[derive(Clone, Debug, PartialEq)]
struct Image {
    width: usize,
    height: usize,
    channels: usize,
    texels: Texels,
}

#[derive(Clone, Debug, PartialEq)]
enum Texels {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F16(Vec<f16>),
    F32(Vec<f32>),
}

/// What was amiss with an image and how it was made good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repair {
    /// So many values were NaN, infinite or beyond ±1e15, and became 0.
    OutOfRange(usize),
    /// So many values of an environment were negative, and became 0.
    Negative(usize),
    /// What the file says of itself that is left aside.
    NotApplied(&'static str),
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::OutOfRange(n) => {
                write!(
                    f,
                    "{n} values that are NaN, infinite or beyond 1e15 set to 0"
                )
            }
            Self::Negative(n) => write!(f, "{n} negative radiances set to 0"),
            Self::NotApplied(what) => write!(f, "{what} that the image file gives is not applied"),
        }
    }
}

/// Why an image can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {message}", .path.display())]
pub struct TextureError {
    /// The file.
    pub path: PathBuf,
    /// What was expected and what was found.
    pub message: String,
}

impl Texture {
    /// Reads a PNG, JPEG, TIFF, HDR or EXR file. Texture coordinates are
    /// multiplied by `scale`, then `offset` is added.
    ///
    /// # Errors
    /// When the file can't be opened or is not a whole image.
    pub fn load(
        path: &Path,
        color_space: ColorSpace,
        interpolation: Interpolation,
        scale: [f32; 2],
        offset: [f32; 2],
    ) -> Result<(Self, Vec<Repair>), TextureError> {
        Images::new(&Budget::of_machine()).texture(path, color_space, interpolation, scale, offset)
    }

    /// In pixels, width and height.
    pub fn size(&self) -> [usize; 2] {
        [self.image.width, self.image.height]
    }

    /// In bytes, of the pixels of all, each image once.
    pub fn memory(textures: &[Self]) -> usize {
        let mut seen = HashSet::new();
        textures
            .iter()
            .filter(|texture| seen.insert(Arc::as_ptr(&texture.image)))
            .map(|texture| texture.image.memory())
            .sum()
    }

    /// Linear red, green and blue, and alpha, not multiplied into them, at
    /// texture coordinates with v upwards: (0, 0) is the lower left corner of
    /// the lower left pixel.
    ///
    /// As in Cycles (`svm_image_texture` of `kernel/svm/image.h`), sRGB values
    /// are decoded after they are interpolated.
    pub fn sample(&self, uv: [f32; 2]) -> [f32; 4] {
        let [width, height] = self.size();
        // Only the place within one repetition counts; f64 keeps it exact far out.
        let [u, v] = [0, 1].map(|axis| {
            let place =
                f64::from(uv[axis]) * f64::from(self.scale[axis]) + f64::from(self.offset[axis]);
            // Coordinates that are none would make colours that are none.
            if place.is_finite() {
                place - place.floor()
            } else {
                0.0
            }
        });
        let [x, y] = [u * width as f64, v * height as f64];
        let mut value = match self.interpolation {
            Interpolation::Closest => self.image.texel(x as usize, y as usize),
            Interpolation::Bilinear => {
                let (left, right, toward_right) = neighbours(x, width);
                let (low, high, toward_high) = neighbours(y, height);
                let low = mix(
                    self.image.texel(left, low),
                    self.image.texel(right, low),
                    toward_right,
                );
                let high = mix(
                    self.image.texel(left, high),
                    self.image.texel(right, high),
                    toward_right,
                );
                mix(low, high, toward_high)
            }
        };
        if self.color_space == ColorSpace::Srgb {
            for channel in &mut value[..3] {
                *channel = srgb_to_linear(*channel);
            }
        }
        value
    }

    /// Linear red, green and blue, averaged over all pixels.
    pub fn mean(&self) -> [f32; 3] {
        let [width, height] = self.size();
        let mut sum = [0.0f64; 3];
        for y in 0..height {
            for x in 0..width {
                let texel = self.image.texel(x, y);
                for (sum, &value) in sum.iter_mut().zip(&texel) {
                    *sum += f64::from(match self.color_space {
                        ColorSpace::Srgb => srgb_to_linear(value),
                        ColorSpace::Linear | ColorSpace::NonColor => value,
                    });
                }
            }
        }
        sum.map(|sum| (sum / (width * height).max(1) as f64) as f32)
    }

    /// One channel of [`Texture::sample`].
    pub fn channel(&self, uv: [f32; 2], channel: Channel) -> f32 {
        let [r, g, b, a] = self.sample(uv);
        match channel {
            Channel::R => r,
            Channel::G => g,
            Channel::B => b,
            Channel::A => a,
            // Rec. 709, section 3.
            Channel::Luminance => 0.2126 * r + 0.7152 * g + 0.0722 * b,
        }
    }
}

impl Image {
    /// In bytes.
    fn memory(&self) -> usize {
        match &self.texels {
            Texels::U8(texels) => size_of_val(&texels[..]),
            Texels::U16(texels) => size_of_val(&texels[..]),
            Texels::F16(texels) => size_of_val(&texels[..]),
            Texels::F32(texels) => size_of_val(&texels[..]),
        }
    }

    /// Red, green, blue and alpha as stored, `y` from the bottom. Rounding may
    /// bring a place on the far edge, which is taken for the last pixel.
    fn texel(&self, x: usize, y: usize) -> [f32; 4] {
        let row = (self.height - 1).saturating_sub(y);
        let pixel = row * self.width + x.min(self.width - 1);
        let at = |channel: usize| {
            let index = pixel * self.channels + channel;
            match &self.texels {
                Texels::U8(texels) => f32::from(texels[index]) / 255.0,
                Texels::U16(texels) => f32::from(texels[index]) / 65535.0,
                Texels::F16(texels) => texels[index].to_f32(),
                Texels::F32(texels) => texels[index],
            }
        };
        match self.channels {
            1 => [at(0), at(0), at(0), 1.0],
            2 => [at(0), at(0), at(0), at(1)],
            3 => [at(0), at(1), at(2), 1.0],
            _ => [at(0), at(1), at(2), at(3)],
        }
    }
}

/// The two pixels whose centres enclose a place along one side, and how far it
/// is from the first to the second.
fn neighbours(place: f64, count: usize) -> (usize, usize, f32) {
    // From −1/2, which is half way to the last pixel of the repetition before.
    let from_centre = place - 0.5;
    let first = from_centre.floor();
    let wrap = |index: f64| (index.max(-1.0) as isize).rem_euclid(count as isize) as usize;
    (wrap(first), wrap(first + 1.0), (from_centre - first) as f32)
}

fn mix(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    std::array::from_fn(|channel| a[channel] + (b[channel] - a[channel]) * share)
}

/// The transfer function of IEC 61966-2-1.
fn srgb_to_linear(value: f32) -> f32 {
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

//! Images that are looked up by texture coordinates or by direction.

mod cache;
mod hdr;
mod load;
mod lookup;
mod slopes;
mod tiles;

pub use cache::Images;
pub use load::{EnvironmentImage, load_environment};
pub use lookup::{Alpha, ColorSpace, Extension, Interpolation, Lookup, UvTransform};
pub use slopes::Slopes;
pub use tiles::files;

use crate::memory::Budget;
use exr::prelude::f16;
use lookup::b_spline;
use serde::Deserialize;
use slopes::SlopeMaps;
use std::collections::HashSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tiles::Tiles;

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

impl Channel {
    /// This part of red, green, blue and alpha.
    #[must_use]
    pub fn of(self, [r, g, b, a]: [f32; 4]) -> f32 {
        match self {
            Self::R => r,
            Self::G => g,
            Self::B => b,
            Self::A => a,
            // Rec. 709, section 3.
            Self::Luminance => 0.2126 * r + 0.7152 * g + 0.0722 * b,
        }
    }
}

impl ColorSpace {
    /// A stored value as a linear one.
    #[must_use]
    pub fn decode(self, value: f32) -> f32 {
        match self {
            Self::Srgb => srgb_to_linear(value),
            Self::Linear | Self::NonColor => value,
        }
    }
}

/// Images on the plane of texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    images: Tiles,
    lookup: Lookup,
    /// Of normal maps that are filtered.
    slopes: Option<Arc<SlopeMaps>>,
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
    /// Reads a PNG, JPEG, TIFF, HDR or EXR file, or several where the path has
    /// `<UDIM>` in its name: one for each square of texture coordinates, see
    /// [`files`].
    ///
    /// # Errors
    /// When a file can't be opened or is not a whole image.
    pub fn load(path: &Path, lookup: Lookup) -> Result<(Self, Vec<Repair>), TextureError> {
        Images::new(&Budget::of_machine()).texture(path, lookup)
    }

    /// Which of a mesh's texture coordinates it wants, 0 for the first.
    pub fn uv_map(&self) -> usize {
        self.lookup.uv_map
    }

    /// In pixels, width and height; of several images, of the first.
    pub fn size(&self) -> [usize; 2] {
        let image = self.images.first();
        [image.width, image.height]
    }

    /// In bytes, of the pixels of all, each image once.
    pub fn memory(textures: &[Self]) -> usize {
        let mut seen = HashSet::new();
        textures
            .iter()
            .flat_map(|texture| texture.images.all())
            .filter(|image| seen.insert(Arc::as_ptr(image)))
            .map(|image| image.memory())
            .sum::<usize>()
            + textures
                .iter()
                .filter_map(|texture| Some(texture.slopes.as_ref()?.memory()))
                .sum::<usize>()
    }

    /// Averages the slopes of a texture of normals, for [`Texture::slopes`]. That takes
    /// about 36 bytes for each pixel. Several images can't be averaged: false.
    pub fn average_slopes(&mut self) -> bool {
        let is_one = matches!(self.images, Tiles::One(_));
        if is_one {
            self.slopes = Some(Arc::new(SlopeMaps::of(self)));
        }
        is_one
    }

    /// The slopes of a texture of normals under a footprint at texture coordinates, of
    /// such an area in their units; `None` where they were not averaged.
    #[must_use]
    pub fn slopes(&self, uv: [f32; 2], area: f32) -> Option<Slopes> {
        let maps = self.slopes.as_ref()?;
        let [width, height] = self.size();
        let pixels = f64::from(area) * self.lookup.transform.area() * (width * height) as f64;
        Some(maps.at(self.lookup.transform.apply(uv), pixels.sqrt() as f32))
    }

    /// Linear red, green and blue, and alpha, at texture coordinates with v upwards:
    /// (0, 0) is the lower left corner of the lower left pixel.
    ///
    /// As in Cycles (`svm_image_texture` of `kernel/svm/image.h`), sRGB values
    /// are decoded after they are interpolated.
    pub fn sample(&self, uv: [f32; 2]) -> [f32; 4] {
        let place = self.lookup.transform.apply(uv);
        let mut value = match self.images.at(place) {
            Some((image, place)) => self.interpolate(image, place),
            None => MISSING,
        };
        self.finish(&mut value);
        value
    }

    /// Values as stored.
    fn interpolate(&self, image: &Image, place: [f64; 2]) -> [f32; 4] {
        let Lookup {
            extension, alpha, ..
        } = self.lookup;
        let [x, y] = [
            extension.pixels(place[0], image.width),
            extension.pixels(place[1], image.height),
        ];
        let texel = |x: i64, y: i64| {
            let pixel = extension.pixel(x, image.width);
            match (pixel, extension.pixel(y, image.height)) {
                (Some(x), Some(y)) => image.texel(x, y, alpha.multiplies()),
                _ => [0.0; 4],
            }
        };
        let ((left, right_by), (low, up_by)) = (below(x), below(y));
        match self.lookup.interpolation {
            Interpolation::Closest => {
                // Rounding may bring a place to the far edge of a repetition.
                let last = |count: usize| match extension {
                    Extension::Repeat => count as i64 - 1,
                    _ => i64::MAX,
                };
                texel(
                    (x.floor() as i64).min(last(image.width)),
                    (y.floor() as i64).min(last(image.height)),
                )
            }
            Interpolation::Bilinear => mix(
                mix(texel(left, low), texel(left + 1, low), right_by),
                mix(texel(left, low + 1), texel(left + 1, low + 1), right_by),
                up_by,
            ),
            Interpolation::Cubic => {
                let (across, up) = (b_spline(right_by), b_spline(up_by));
                let mut sum = [0.0; 4];
                for (y, up) in (low - 1..).zip(up) {
                    for (x, across) in (left - 1..).zip(across) {
                        for (sum, value) in sum.iter_mut().zip(texel(x, y)) {
                            *sum += value * (across * up);
                        }
                    }
                }
                sum
            }
        }
    }

    /// From values as stored, interpolated, to linear ones.
    fn finish(&self, value: &mut [f32; 4]) {
        let alpha = value[3];
        for channel in &mut value[..3] {
            // As in Cycles, what has no alpha keeps its colour.
            if self.lookup.alpha.divides() && alpha != 0.0 && alpha != 1.0 {
                *channel /= alpha;
            }
            *channel = self.lookup.color_space.decode(*channel);
        }
    }

    /// Linear red, green and blue, averaged over all pixels.
    pub fn mean(&self) -> [f32; 3] {
        let mut sum = [0.0f64; 3];
        let mut count = 0;
        for image in self.images.all() {
            for y in 0..image.height {
                for x in 0..image.width {
                    let mut texel = image.texel(x, y, self.lookup.alpha.multiplies());
                    self.finish(&mut texel);
                    for (sum, &value) in sum.iter_mut().zip(&texel) {
                        *sum += f64::from(value);
                    }
                }
            }
            count += image.width * image.height;
        }
        sum.map(|sum| (sum / count.max(1) as f64) as f32)
    }

    /// One channel of [`Texture::sample`].
    pub fn channel(&self, uv: [f32; 2], channel: Channel) -> f32 {
        channel.of(self.sample(uv))
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

    /// Red, green, blue and alpha as stored, `y` from the bottom; with `multiply` the
    /// first three times the last, in whole numbers where pixels are, as in Cycles.
    #[inline]
    fn texel(&self, x: usize, y: usize, multiply: bool) -> [f32; 4] {
        let first = ((self.height - 1 - y) * self.width + x) * self.channels;
        let pixel = first..first + self.channels;
        let whole = |value: u32, alpha: u32, most: u32| (value * alpha / most) as f32 / most as f32;
        match &self.texels {
            Texels::U8(texels) => spread(
                &texels[pixel],
                |value| f32::from(value) / 255.0,
                multiply.then_some(|value: u8, alpha: u8| whole(value.into(), alpha.into(), 255)),
            ),
            Texels::U16(texels) => spread(
                &texels[pixel],
                |value| f32::from(value) / 65535.0,
                multiply
                    .then_some(|value: u16, alpha: u16| whole(value.into(), alpha.into(), 65535)),
            ),
            Texels::F16(texels) => spread(
                &texels[pixel],
                f16::to_f32,
                multiply.then_some(|value: f16, alpha: f16| value.to_f32() * alpha.to_f32()),
            ),
            Texels::F32(texels) => spread(
                &texels[pixel],
                |value| value,
                multiply.then_some(|value: f32, alpha: f32| value * alpha),
            ),
        }
    }
}

/// Red, green, blue and alpha of a pixel of one to four channels; colours are
/// multiplied by alpha with `times` where that is given.
#[inline]
fn spread<T: Copy>(
    pixel: &[T],
    number: impl Fn(T) -> f32,
    times: Option<impl Fn(T, T) -> f32>,
) -> [f32; 4] {
    let color = |value: T, alpha: T| match &times {
        Some(times) => times(value, alpha),
        None => number(value),
    };
    match *pixel {
        [grey] => {
            let grey = number(grey);
            [grey, grey, grey, 1.0]
        }
        [grey, alpha] => {
            let grey = color(grey, alpha);
            [grey, grey, grey, number(alpha)]
        }
        [r, g, b] => [number(r), number(g), number(b), 1.0],
        [r, g, b, alpha, ..] => [
            color(r, alpha),
            color(g, alpha),
            color(b, alpha),
            number(alpha),
        ],
        [] => MISSING,
    }
}

/// What Cycles shows where an image is missing: magenta.
const MISSING: [f32; 4] = [1.0, 0.0, 1.0, 1.0];

/// The pixel whose centre is the last before a place along one side, and how far it is
/// from there to the next.
fn below(place: f64) -> (i64, f32) {
    let from_centre = place - 0.5;
    let first = from_centre.floor();
    (first as i64, (from_centre - first) as f32)
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

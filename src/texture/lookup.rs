//! How an image is looked up: where, what is beyond its edges and between its pixels,
//! and what its alpha does.

use serde::Deserialize;

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
    /// Sixteen pixels, by the uniform cubic B-spline: smooth, and smoothing.
    Cubic,
}

/// What is beyond the edges of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extension {
    /// The image again.
    #[default]
    Repeat,
    /// Black of alpha 0.
    Clip,
    /// The pixels at the edge.
    Extend,
    /// The image again, every other one mirrored.
    Mirror,
}

/// What alpha does to the stored colour, before it is decoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alpha {
    /// Nothing.
    #[default]
    AsIs,
    /// Every pixel is multiplied by its alpha, in whole numbers where pixels are.
    Multiply,
    /// The interpolated colour is divided by the interpolated alpha.
    Divide,
    /// Both: alpha is a pixel's weight among those that are interpolated.
    Weigh,
}

impl Alpha {
    pub(super) fn multiplies(self) -> bool {
        matches!(self, Self::Multiply | Self::Weigh)
    }

    pub(super) fn divides(self) -> bool {
        matches!(self, Self::Divide | Self::Weigh)
    }
}

/// From texture coordinates to places of the image, whose lower left corner is at
/// (0, 0) and whose upper right one at (1, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform(pub(super) [[f64; 3]; 2]);

impl Default for UvTransform {
    fn default() -> Self {
        Self::from_parts([1.0; 2], 0.0, [0.0; 2])
    }
}

impl UvTransform {
    /// Rows of the factors of u and v, and of what is added.
    #[must_use]
    pub fn from_rows(rows: [[f32; 3]; 2]) -> Self {
        Self(rows.map(|row| row.map(f64::from)))
    }

    /// Multiplies by `scale`, turns by so many degrees counter-clockwise, adds `offset`.
    #[must_use]
    pub fn from_parts(scale: [f32; 2], degrees: f32, offset: [f32; 2]) -> Self {
        let [x, y] = scale.map(f64::from);
        let [right, up] = offset.map(f64::from);
        // Exact where nothing turns.
        let (sin, cos) = match degrees {
            0.0 => (0.0, 1.0),
            _ => f64::from(degrees).to_radians().sin_cos(),
        };
        Self([[cos * x, -sin * y, right], [sin * x, cos * y, up]])
    }

    /// The place, in f64, which keeps it exact far out. Coordinates that are none would
    /// make colours that are none; they become 0.
    pub(super) fn apply(&self, [u, v]: [f32; 2]) -> [f64; 2] {
        let [u, v] = [f64::from(u), f64::from(v)];
        self.0.map(|[a, b, c]| {
            // Infinity times nothing is not a number, but it is not asked for either.
            let b = if b == 0.0 { 0.0 } else { b * v };
            let a = if a == 0.0 { 0.0 } else { a * u };
            let place = a + b + c;
            if place.is_finite() { place } else { 0.0 }
        })
    }
}

/// All of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lookup {
    /// How stored values become linear ones.
    pub color_space: ColorSpace,
    /// What happens between pixel centres.
    pub interpolation: Interpolation,
    /// What is beyond the edges.
    pub extension: Extension,
    /// What alpha does to the colour.
    pub alpha: Alpha,
    /// From texture coordinates to the image.
    pub transform: UvTransform,
    /// Which of a mesh's texture coordinates are meant, 0 for its first.
    pub uv_map: usize,
}

impl Extension {
    /// Which of `count` pixels stands at this index; `None` for none.
    pub(super) fn pixel(self, index: i64, count: usize) -> Option<usize> {
        let count = count as i64;
        let pixel = match self {
            // Divisions of whole numbers are slow, and few places need one.
            _ if (0..count).contains(&index) => index,
            Self::Repeat => index.rem_euclid(count),
            Self::Clip => return None,
            Self::Extend => index.clamp(0, count - 1),
            Self::Mirror => {
                let place = index.rem_euclid(2 * count);
                place.min(2 * count - 1 - place)
            }
        };
        Some(pixel as usize)
    }
}

/// What is farther out, in pixels, is as good as here: f64 knows no halves there.
const FARTHEST: f64 = 1e15;

impl Extension {
    /// A place of the image in pixels along a side of `count`, within the first
    /// repetition where all are alike.
    pub(super) fn pixels(self, place: f64, count: usize) -> f64 {
        match self {
            Self::Repeat => (place - place.floor()) * count as f64,
            _ => (place * count as f64).clamp(-FARTHEST, FARTHEST),
        }
    }
}

/// The weights of the uniform cubic B-spline.
pub(super) fn b_spline(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    let rest = 1.0 - t;
    [
        rest * rest * rest / 6.0,
        (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0,
        (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0,
        t3 / 6.0,
    ]
}

//! Images that are looked up by direction or by texture coordinates.

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
}

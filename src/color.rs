//! Colours: scene-linear Rec. 709, three numbers.

use glam::Vec3;

/// A colour, a reflectance or a radiance per channel, scene-linear Rec. 709.
pub type Rgb = Vec3;

/// Relative luminance Y of a Rec. 709 colour, in the colour's own unit
/// (ITU-R BT.709-6, item 3.2).
#[must_use]
pub fn luminance(c: Rgb) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

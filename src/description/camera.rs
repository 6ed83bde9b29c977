//! The camera, with the quantities Blender shows.

use super::transform::Transform;
use super::value::Clash;
use serde::Deserialize;

/// A camera that looks along its local −z, local y up.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// From the camera's space to the world's; its scale is ignored.
    #[serde(default)]
    pub transform: Transform,
    /// How directions become pixels.
    pub projection: Projection,
    /// The aperture; a pinhole when absent.
    pub depth_of_field: Option<DepthOfField>,
    /// Where along the view axis it begins and ends to see, in metres; all of it when absent.
    pub clip: Option<[f32; 2]>,
}

/// How directions become pixels.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// Rays through one point.
    Perspective(Perspective),
    /// Parallel rays.
    Orthographic(Orthographic),
}

/// Rays through one point.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawPerspective")]
pub struct Perspective {
    /// How much is seen.
    pub opening: Opening,
    /// In millimetres.
    pub sensor_width: f32,
    /// In millimetres.
    pub sensor_height: f32,
    /// Which side of the image the sensor is fitted to.
    pub sensor_fit: SensorFit,
    /// To the right, in units of the fitted side.
    pub shift_x: f32,
    /// Upwards, in units of the fitted side.
    pub shift_y: f32,
    /// A pixel's height over its width.
    pub pixel_aspect: f32,
}

/// How much a perspective camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opening {
    /// The full angle on the fitted side, in degrees.
    Fov(f32),
    /// The focal length, in millimetres.
    Lens(f32),
}

/// Parallel rays.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Orthographic {
    /// The length of the fitted side, in metres.
    pub scale: f32,
    /// Which side of the image `scale` is for.
    pub sensor_fit: SensorFit,
    /// To the right, in units of the fitted side.
    pub shift_x: f32,
    /// Upwards, in units of the fitted side.
    pub shift_y: f32,
}

impl Default for Orthographic {
    fn default() -> Self {
        Self {
            scale: 6.0,
            sensor_fit: SensorFit::Auto,
            shift_x: 0.0,
            shift_y: 0.0,
        }
    }
}

/// The side of the image that the sensor is fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorFit {
    /// The longer one, with the sensor's width.
    #[default]
    Auto,
    /// The width, with the sensor's width.
    Horizontal,
    /// The height, with the sensor's height.
    Vertical,
}

/// A lens with an aperture.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawDepthOfField")]
pub struct DepthOfField {
    /// The size of the aperture.
    pub aperture: Aperture,
    /// Along the view axis, in metres.
    pub focus_distance: f32,
}

/// The size of the aperture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aperture {
    /// The focal length over the diameter.
    FStop(f32),
    /// In metres.
    Radius(f32),
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct RawPerspective {
    fov: Option<f32>,
    lens: Option<f32>,
    sensor_width: f32,
    sensor_height: f32,
    sensor_fit: SensorFit,
    shift_x: f32,
    shift_y: f32,
    pixel_aspect: f32,
}

impl Default for RawPerspective {
    fn default() -> Self {
        Self {
            fov: None,
            lens: None,
            sensor_width: 36.0,
            sensor_height: 24.0,
            sensor_fit: SensorFit::Auto,
            shift_x: 0.0,
            shift_y: 0.0,
            pixel_aspect: 1.0,
        }
    }
}

impl TryFrom<RawPerspective> for Perspective {
    type Error = Clash;

    fn try_from(raw: RawPerspective) -> Result<Self, Clash> {
        let opening = match (raw.fov, raw.lens) {
            (Some(_), Some(_)) => return Err(Clash::between("fov", "lens")),
            (Some(degrees), None) => Opening::Fov(degrees),
            (None, millimetres) => Opening::Lens(millimetres.unwrap_or(50.0)),
        };
        Ok(Self {
            opening,
            sensor_width: raw.sensor_width,
            sensor_height: raw.sensor_height,
            sensor_fit: raw.sensor_fit,
            shift_x: raw.shift_x,
            shift_y: raw.shift_y,
            pixel_aspect: raw.pixel_aspect,
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDepthOfField {
    fstop: Option<f32>,
    aperture_radius: Option<f32>,
    focus_distance: f32,
}

impl TryFrom<RawDepthOfField> for DepthOfField {
    type Error = Clash;

    fn try_from(raw: RawDepthOfField) -> Result<Self, Clash> {
        let aperture = match (raw.fstop, raw.aperture_radius) {
            (Some(_), Some(_)) => return Err(Clash::between("fstop", "aperture_radius")),
            (Some(fstop), None) => Aperture::FStop(fstop),
            (None, Some(metres)) => Aperture::Radius(metres),
            (None, None) => {
                return Err(Clash::new(
                    "focus_distance",
                    "`fstop` or `aperture_radius` must say how wide the lens is",
                ));
            }
        };
        Ok(Self {
            aperture,
            focus_distance: raw.focus_distance,
        })
    }
}

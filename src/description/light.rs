//! Lights other than emissive meshes, with the quantities Cycles takes.

use super::transform::Transform;
use super::value;
use crate::rays::{RayKind, RayKinds};
use serde::Deserialize;

/// A light that shines along its local −z, or all round.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(from = "RawLight")]
pub struct Light {
    /// A name for messages.
    pub name: Option<String>,
    /// From the light's space to the world's.
    pub transform: Transform,
    /// A scene-linear Rec. 709 factor.
    pub color: [f32; 3],
    /// In stops: power is multiplied by 2 to this.
    pub exposure: f32,
    /// Whether camera rays see the light.
    pub visible_to_camera: bool,
    /// Of diffuse, glossy and transmission: the rays that pass it, and the scattering
    /// that its light is left out of.
    pub hidden_from: Vec<RayKind>,
    /// The shape and the power.
    pub kind: LightKind,
}

impl Light {
    /// The rays that meet it.
    #[must_use]
    pub fn seen_by(&self) -> RayKinds {
        seen_by(self.visible_to_camera, &self.hidden_from)
    }
}

/// All rays but those from the camera, if it does not see the thing, and those that it is
/// hidden from.
pub(super) fn seen_by(camera: bool, hidden: &[RayKind]) -> RayKinds {
    let camera = (!camera).then_some(RayKind::Camera);
    RayKinds::all_but(hidden.iter().copied().chain(camera))
}

/// The shape and the power of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Shines all round.
    Point {
        /// In watts, as Cycles counts them.
        power: f32,
        /// In metres.
        radius: f32,
        /// A disk that faces the shading point instead of a sphere.
        soft_falloff: bool,
    },
    /// Shines into a cone.
    Spot {
        /// In watts, as Cycles counts them.
        power: f32,
        /// The full angle of the cone, in degrees.
        size: f32,
        /// The share of the cone that is blurred, 0 to 1.
        blend: f32,
        /// In metres.
        radius: f32,
    },
    /// Shines from infinitely far.
    Sun {
        /// The irradiance of a plane facing the sun, in W·m⁻².
        strength: f32,
        /// The full angle of its disk, in degrees.
        angle: f32,
    },
    /// Shines from a flat shape.
    Area {
        /// In watts, as Cycles counts them.
        power: f32,
        /// The shape in the local xy plane.
        shape: AreaShape,
        /// The full angle it shines into, in degrees; 180 is the half-space.
        spread: f32,
    },
}

/// The shape of an area light, in its local xy plane, centred.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AreaShape {
    /// A rectangle.
    Rectangle {
        /// Along x, in metres.
        width: f32,
        /// Along y, in metres.
        height: f32,
    },
    /// An ellipse.
    Disk {
        /// The axis along x (a diameter), in metres.
        width: f32,
        /// The axis along y (a diameter), in metres.
        height: f32,
    },
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum RawLight {
    Point(RawPoint),
    Spot(RawSpot),
    Sun(RawSun),
    Area(RawArea),
}

/// Declares the keys of a kind of light beside those that all share: serde's
/// `flatten` would lose both unknown keys and the place of errors.
macro_rules! raw_lights {
    ($($raw:ident { $($(#[$attribute:meta])* $key:ident: $type:ty,)* } => $kind:expr;)*) => {
        $(
            #[derive(Deserialize)]
            #[serde(deny_unknown_fields)]
            struct $raw {
                name: Option<String>,
                #[serde(default)]
                transform: Transform,
                #[serde(default = "value::ones", deserialize_with = "value::triple")]
                color: [f32; 3],
                #[serde(default)]
                exposure: f32,
                #[serde(default)]
                visible_to_camera: bool,
                #[serde(default)]
                hidden_from: Vec<RayKind>,
                $($(#[$attribute])* $key: $type,)*
            }

            impl From<$raw> for Light {
                fn from(raw: $raw) -> Self {
                    let $raw {
                        name, transform, color, exposure, visible_to_camera, hidden_from, $($key),*
                    } = raw;
                    Self {
                        name, transform, color, exposure, visible_to_camera, hidden_from,
                        kind: $kind,
                    }
                }
            }
        )*
    };
}

raw_lights! {
    RawPoint {
        power: f32,
        #[serde(default)]
        radius: f32,
        #[serde(default = "value::yes")]
        soft_falloff: bool,
    } => LightKind::Point { power, radius, soft_falloff };
    RawSpot {
        power: f32,
        #[serde(default = "spot_size")]
        size: f32,
        #[serde(default = "spot_blend")]
        blend: f32,
        #[serde(default)]
        radius: f32,
    } => LightKind::Spot { power, size, blend, radius };
    RawSun {
        strength: f32,
        #[serde(default)]
        angle: f32,
    } => LightKind::Sun { strength, angle };
    RawArea {
        power: f32,
        shape: AreaShape,
        #[serde(default = "area_spread")]
        spread: f32,
    } => LightKind::Area { power, shape, spread };
}

fn spot_size() -> f32 {
    45.0
}

fn spot_blend() -> f32 {
    0.15
}

fn area_spread() -> f32 {
    180.0
}

impl From<RawLight> for Light {
    fn from(raw: RawLight) -> Self {
        match raw {
            RawLight::Point(raw) => raw.into(),
            RawLight::Spot(raw) => raw.into(),
            RawLight::Sun(raw) => raw.into(),
            RawLight::Area(raw) => raw.into(),
        }
    }
}

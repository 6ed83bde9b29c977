//! Where things are.

use super::value::{self, Clash};
use serde::Deserialize;

/// From an object's own space to the world's, in metres.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawTransform")]
pub enum Transform {
    /// Four rows of four numbers, acting on column vectors.
    Matrix([[f32; 4]; 4]),
    /// First scaled, then rotated, then moved.
    Parts {
        /// The image of the origin, in metres.
        location: [f32; 3],
        /// Euler angles in degrees, about x first, then y, then z.
        rotation: [f32; 3],
        /// The factors along the object's axes.
        scale: [f32; 3],
    },
    /// Local −z points from `from` to `to`.
    LookAt {
        /// The image of the origin, in metres.
        from: [f32; 3],
        /// The point looked at, in metres.
        to: [f32; 3],
        /// The direction that local y is as near to as can be.
        up: [f32; 3],
    },
}

impl Default for Transform {
    /// The identity.
    fn default() -> Self {
        Self::Parts {
            location: [0.0; 3],
            rotation: [0.0; 3],
            scale: [1.0; 3],
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTransform {
    matrix: Option<[[f32; 4]; 4]>,
    location: Option<[f32; 3]>,
    rotation: Option<[f32; 3]>,
    #[serde(default, deserialize_with = "value::optional_triple")]
    scale: Option<[f32; 3]>,
    look_at: Option<RawLookAt>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLookAt {
    from: [f32; 3],
    to: [f32; 3],
    #[serde(default = "z_axis")]
    up: [f32; 3],
}

fn z_axis() -> [f32; 3] {
    [0.0, 0.0, 1.0]
}

impl TryFrom<RawTransform> for Transform {
    type Error = Clash;

    fn try_from(raw: RawTransform) -> Result<Self, Clash> {
        let part = [
            ("location", raw.location),
            ("rotation", raw.rotation),
            ("scale", raw.scale),
        ]
        .into_iter()
        .find_map(|(key, given)| given.map(|_| key));
        match (raw.matrix, raw.look_at, part) {
            (Some(_), Some(_), _) => Err(Clash::between("matrix", "look_at")),
            (Some(_), None, Some(part)) => Err(Clash::between("matrix", part)),
            (None, Some(_), Some(part)) => Err(Clash::between("look_at", part)),
            (Some(rows), None, None) => Ok(Self::Matrix(rows)),
            (None, Some(RawLookAt { from, to, up }), None) => Ok(Self::LookAt { from, to, up }),
            (None, None, _) => Ok(Self::Parts {
                location: raw.location.unwrap_or_default(),
                rotation: raw.rotation.unwrap_or_default(),
                scale: raw.scale.unwrap_or([1.0; 3]),
            }),
        }
    }
}

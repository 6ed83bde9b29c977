//! Objects that are filled with something that absorbs.

use super::material::MaterialRef;
use super::validate::{At, Check, Range};
use super::value::{Clash, optional_triple};
use serde::Deserialize;

/// A surface around something that absorbs.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Raw")]
pub struct Filled {
    /// The surface.
    pub surface: MaterialRef,
    /// What is inside.
    pub interior: Interior,
}

/// How much is absorbed inside, by Beer and Lambert's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interior {
    /// Per metre and channel.
    Absorption([f32; 3]),
    /// So much that this share is left.
    Transmitting {
        /// The share that is left.
        transmittance: [f32; 3],
        /// After so many metres.
        depth: f32,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    surface: MaterialRef,
    #[serde(default, deserialize_with = "optional_triple")]
    absorption: Option<[f32; 3]>,
    #[serde(default, deserialize_with = "optional_triple")]
    transmittance: Option<[f32; 3]>,
    depth: Option<f32>,
}

impl TryFrom<Raw> for Filled {
    type Error = Clash;

    fn try_from(raw: Raw) -> Result<Self, Clash> {
        let interior = match (raw.absorption, raw.transmittance, raw.depth) {
            (Some(_), Some(_), _) => return Err(Clash::between("absorption", "transmittance")),
            (Some(_), None, Some(_)) => return Err(Clash::between("absorption", "depth")),
            (None, None, Some(_)) => {
                return Err(Clash::new("depth", "`depth` needs `transmittance`"));
            }
            (None, None, None) => {
                let message = "expected `absorption`, or `transmittance` and `depth`";
                return Err(Clash::new("surface", message));
            }
            (Some(absorption), None, None) => Interior::Absorption(absorption),
            (None, Some(transmittance), depth) => Interior::Transmitting {
                transmittance,
                depth: depth.unwrap_or(1.0),
            },
        };
        Ok(Self {
            surface: raw.surface,
            interior,
        })
    }
}

impl Interior {
    /// Per metre and channel.
    #[must_use]
    pub fn absorption(&self) -> [f32; 3] {
        match *self {
            Self::Absorption(absorption) => absorption,
            Self::Transmitting {
                transmittance,
                depth,
            } => transmittance.map(|share| (-share.ln() / depth).min(f32::MAX)),
        }
    }
}

impl Filled {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        self.surface.check_part(check, at.key("surface"));
        match self.interior {
            Interior::Absorption(absorption) => {
                check.triple(absorption, Range::NonNegative, at.key("absorption"));
            }
            Interior::Transmitting {
                transmittance,
                depth,
            } => {
                let range = Range::Above(0.0, 1.0);
                check.triple(transmittance, range, at.key("transmittance"));
                check.number(depth, Range::Positive, at.key("depth"));
            }
        }
    }
}

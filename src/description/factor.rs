//! What mixes two materials.

use super::validate::{At, Check, Range};
use super::value::{Scalar, visit_numbers};
use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, Visitor, value::MapAccessDeserializer};
use serde_yaml::with::singleton_map_recursive;
use std::fmt;

/// The share of the second material of a mix.
#[derive(Clone, Debug, PartialEq)]
pub enum Factor {
    /// A number or a texture.
    Share(Scalar),
    /// The reflectance of a smooth interface towards the viewer.
    Fresnel {
        /// The index of refraction inside over the one outside.
        ior: Scalar,
    },
    /// How far the surface is turned away from the viewer.
    Facing {
        /// 0 to 1; at one half, 1 − cosθ.
        blend: Scalar,
    },
    /// 1 seen from inside.
    Backfacing,
    /// 1 for camera rays.
    CameraRay,
}

impl Default for Factor {
    fn default() -> Self {
        Self::Share(Scalar::Value(0.5))
    }
}

impl<'de> Deserialize<'de> for Factor {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(rename_all = "snake_case")]
        enum ByView {
            Fresnel(Fresnel),
            Facing(Facing),
            Backfacing,
            CameraRay,
        }
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Fresnel {
            #[serde(default = "ior")]
            ior: Scalar,
        }
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Facing {
            #[serde(default = "half")]
            blend: Scalar,
        }
        fn ior() -> Scalar {
            Scalar::Value(1.45)
        }
        fn half() -> Scalar {
            Scalar::Value(0.5)
        }

        impl From<ByView> for Factor {
            fn from(by_view: ByView) -> Self {
                match by_view {
                    ByView::Fresnel(Fresnel { ior }) => Self::Fresnel { ior },
                    ByView::Facing(Facing { blend }) => Self::Facing { blend },
                    ByView::Backfacing => Self::Backfacing,
                    ByView::CameraRay => Self::CameraRay,
                }
            }
        }

        struct FactorVisitor;

        impl<'de> Visitor<'de> for FactorVisitor {
            type Value = Factor;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str(
                    "a number, {texture: NAME}, {fresnel: {ior: 1.45}}, {facing: {blend: 0.5}}, backfacing or camera_ray",
                )
            }

            visit_numbers!(Factor, n => Factor::Share(Scalar::Value(n as f32)));

            fn visit_str<E: de::Error>(self, name: &str) -> Result<Factor, E> {
                ByView::deserialize(de::value::StrDeserializer::new(name)).map(Factor::from)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Factor, A::Error> {
                let value = serde_yaml::Value::deserialize(MapAccessDeserializer::new(map))?;
                let textured = value.get("texture").is_some() || value.get("channel").is_some();
                let read = |value| {
                    if textured {
                        Scalar::deserialize(value).map(Factor::Share)
                    } else {
                        singleton_map_recursive::deserialize::<ByView, _>(value).map(Factor::from)
                    }
                };
                read(value).map_err(de::Error::custom)
            }
        }

        deserializer.deserialize_any(FactorVisitor)
    }
}

impl Factor {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        match self {
            Self::Share(share) => check.scalar(share, Range::UNIT, at.clone()),
            Self::Fresnel { ior } => {
                check.scalar(ior, Range::Positive, at.key("fresnel").key("ior"));
            }
            Self::Facing { blend } => {
                check.scalar(blend, Range::UNIT, at.key("facing").key("blend"));
            }
            Self::Backfacing | Self::CameraRay => {}
        }
    }
}

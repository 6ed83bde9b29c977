//! Blender's Principled BSDF, by the sockets of its node.

use super::relief::{Bump, NormalMap, Relief};
use super::rough::Tangent;
use super::validate::{At, Check, Range};
use super::value::{Clash, Color, Scalar};
use crate::texture::Channel;
use serde::Deserialize;
use serde::de::{self, Deserializer};

/// The Blender whose Cycles is meant, where they differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // the names say it all
pub enum Version {
    V3_4,
    V4_5,
    V5_0,
}

impl<'de> Deserialize<'de> for Version {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match f64::deserialize(deserializer)? {
            3.4 => Ok(Self::V3_4),
            4.5 => Ok(Self::V4_5),
            5.0 => Ok(Self::V5_0),
            other => Err(de::Error::invalid_value(
                de::Unexpected::Float(other),
                &"3.4, 4.5 or 5.0",
            )),
        }
    }
}

/// How what lies below a layer is darkened by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layering {
    /// By the layer's albedo towards the viewer, as in Cycles.
    #[default]
    Cycles,
    /// As it comes of light that walks among the layers.
    Walks,
}

/// How facets scatter, as the node has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Facets {
    /// Once.
    Ggx,
    /// As often as it comes.
    MultiGgx,
}

/// Blender's Principled BSDF.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Raw")]
pub struct Principled {
    /// How layers darken each other.
    pub layering: Layering,
    /// Whether light that meets facets again is followed.
    pub multiple: bool,
    /// Where the tangent comes from.
    pub tangent: Tangent,
    /// What replaces the interpolated normal.
    pub normal: Option<NormalMap>,
    /// What leans it.
    pub bump: Option<Bump>,
    /// Whether its thin film lies on metal too, as it does since 5.0.
    pub filmed_metal: bool,
    /// The values.
    pub sockets: Sockets,
}

/// The values of the node's sockets.
#[derive(Clone, Debug, PartialEq)]
pub enum Sockets {
    /// Of Blender 2.8 to 3.6.
    V3(Principled3),
    /// Of Blender 4 and 5.
    V4(Principled4),
}

/// What a socket may be: a number, a colour or a texture.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, [r, g, b] or {texture: NAME}"
)]
enum Socket {
    Number(f32),
    Color([f32; 3]),
    Texture(SocketTexture),
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct SocketTexture {
    texture: String,
    channel: Option<Channel>,
}

/// What a socket is read as.
trait FromSocket: Sized {
    fn from_socket(socket: Socket, key: &'static str) -> Result<Self, Clash>;

    fn check(&self, check: &mut Check<'_, '_>, range: Range, at: At);
}

impl FromSocket for Scalar {
    fn from_socket(socket: Socket, key: &'static str) -> Result<Self, Clash> {
        match socket {
            Socket::Number(value) => Ok(Self::Value(value)),
            Socket::Color(_) => Err(Clash::new(
                key,
                "expected a number or {texture: NAME}, found a colour",
            )),
            Socket::Texture(SocketTexture { texture, channel }) => Ok(Self::Texture {
                name: texture,
                channel: channel.unwrap_or_default(),
            }),
        }
    }

    fn check(&self, check: &mut Check<'_, '_>, range: Range, at: At) {
        check.scalar(self, range, at);
    }
}

impl FromSocket for Color {
    fn from_socket(socket: Socket, key: &'static str) -> Result<Self, Clash> {
        match socket {
            Socket::Number(value) => Ok(Self::Value([value; 3])),
            Socket::Color(value) => Ok(Self::Value(value)),
            Socket::Texture(SocketTexture {
                texture,
                channel: None,
            }) => Ok(Self::Texture(texture)),
            Socket::Texture(_) => Err(Clash::new(key, "a colour takes no `channel`")),
        }
    }

    fn check(&self, check: &mut Check<'_, '_>, range: Range, at: At) {
        check.color(self, range, at);
    }
}

/// Declares the keys of all versions.
macro_rules! raw {
    ($($key:ident)*) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Raw {
            version: Version,
            #[serde(default)]
            layering: Layering,
            distribution: Option<Facets>,
            #[serde(default)]
            tangent: Tangent,
            normal: Option<NormalMap>,
            bump: Option<Bump>,
            $($key: Option<Socket>,)*
        }

        impl Raw {
            /// A key that is left.
            fn rest(&self) -> Option<&'static str> {
                $(if self.$key.is_some() {
                    return Some(stringify!($key));
                })*
                None
            }
        }
    };
}

raw! {
    base_color metallic roughness ior alpha
    subsurface subsurface_color specular specular_tint anisotropic anisotropic_rotation sheen
    sheen_tint clearcoat clearcoat_roughness transmission transmission_roughness emission
    emission_strength
    diffuse_roughness subsurface_weight specular_ior_level transmission_weight coat_weight
    coat_roughness coat_ior coat_tint sheen_weight sheen_roughness emission_color
    thin_film_thickness thin_film_ior
}

/// Declares a node's sockets with their defaults and ranges.
macro_rules! node {
    ($(#[$doc:meta])* $name:ident {
        $($(#[$key_doc:meta])* $key:ident: $type:ident = $default:expr, $range:expr;)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            $($(#[$key_doc])* pub $key: $type,)*
        }

        impl $name {
            fn take(raw: &mut Raw) -> Result<Self, Clash> {
                Ok(Self {
                    $($key: match raw.$key.take() {
                        Some(socket) => $type::from_socket(socket, stringify!($key))?,
                        None => $default.into(),
                    },)*
                })
            }

            fn check(&self, check: &mut Check<'_, '_>, at: &At) {
                $(self.$key.check(check, $range, at.key(stringify!($key)));)*
            }
        }
    };
}

const TURNS: Range = Range::Within(-1.0, 1.0);

node! {
    /// The node of Blender 2.8 to 3.6.
    Principled3 {
        /// The albedo, or the reflectance of metal at normal incidence.
        base_color: Color = 0.8, Range::UNIT;
        /// The share of the base that has `subsurface_color`.
        subsurface: Scalar = 0.0, Range::UNIT;
        /// The albedo of what light scatters in.
        subsurface_color: Color = 0.8, Range::UNIT;
        /// How much of it is metal.
        metallic: Scalar = 0.0, Range::UNIT;
        /// Reflectance at normal incidence, over 0.08.
        specular: Scalar = 0.5, Range::NonNegative;
        /// How much of the base's hue the reflection has.
        specular_tint: Scalar = 0.0, Range::UNIT;
        /// √α.
        roughness: Scalar = 0.5, Range::UNIT;
        /// 0 to 1, wider along the tangent.
        anisotropic: Scalar = 0.0, Range::UNIT;
        /// Turns of the tangent.
        anisotropic_rotation: Scalar = 0.0, TURNS;
        /// A factor on the sheen.
        sheen: Scalar = 0.0, Range::NonNegative;
        /// How much of the base's hue the sheen has.
        sheen_tint: Scalar = 0.5, Range::UNIT;
        /// A factor on the coat, 4 for a full one.
        clearcoat: Scalar = 0.0, Range::NonNegative;
        /// √α of the coat.
        clearcoat_roughness: Scalar = 0.03, Range::UNIT;
        /// Index of refraction of what is transmitted.
        ior: Scalar = 1.45, Range::Positive;
        /// How much is transmitted instead of scattered by the base.
        transmission: Scalar = 0.0, Range::UNIT;
        /// What single-scattering transmission has of roughness besides.
        transmission_roughness: Scalar = 0.0, Range::UNIT;
        /// Radiance over `emission_strength`.
        emission: Color = 0.0, Range::NonNegative;
        /// W·m⁻²·sr⁻¹.
        emission_strength: Scalar = 1.0, Range::NonNegative;
        /// How much does not go straight through.
        alpha: Scalar = 1.0, Range::UNIT;
    }
}

node! {
    /// The node of Blender 4 and 5.
    Principled4 {
        /// The albedo, or the reflectance of metal at normal incidence.
        base_color: Color = 0.8, Range::UNIT;
        /// How much of it is metal.
        metallic: Scalar = 0.0, Range::UNIT;
        /// √α.
        roughness: Scalar = 0.5, Range::UNIT;
        /// Index of refraction.
        ior: Scalar = 1.5, Range::Positive;
        /// How much does not go straight through.
        alpha: Scalar = 1.0, Range::UNIT;
        /// Oren and Nayar's roughness of the base.
        diffuse_roughness: Scalar = 0.0, Range::UNIT;
        /// How much of the base light scatters in.
        subsurface_weight: Scalar = 0.0, Range::UNIT;
        /// One half leaves the reflectance of `ior`, 0 takes it away.
        specular_ior_level: Scalar = 0.5, Range::NonNegative;
        /// A factor on the reflectance at normal incidence, for metal at cosθ = 1/7.
        specular_tint: Color = 1.0, Range::NonNegative;
        /// 0 to 1, wider along the tangent.
        anisotropic: Scalar = 0.0, Range::UNIT;
        /// Turns of the tangent.
        anisotropic_rotation: Scalar = 0.0, TURNS;
        /// How much is transmitted instead of scattered by the base.
        transmission_weight: Scalar = 0.0, Range::UNIT;
        /// How much of a coat there is.
        coat_weight: Scalar = 0.0, Range::NonNegative;
        /// √α of the coat.
        coat_roughness: Scalar = 0.03, Range::UNIT;
        /// Index of refraction of the coat.
        coat_ior: Scalar = 1.5, Range::Positive;
        /// What the coat lets through at normal incidence, there and back.
        coat_tint: Color = 1.0, Range::UNIT;
        /// How much sheen there is.
        sheen_weight: Scalar = 0.0, Range::NonNegative;
        /// How loose the fibres are.
        sheen_roughness: Scalar = 0.5, Range::UNIT;
        /// A factor on the sheen.
        sheen_tint: Color = 1.0, Range::NonNegative;
        /// Thickness of a film on the interface, nm.
        thin_film_thickness: Scalar = 0.0, Range::NonNegative;
        /// Its index of refraction.
        thin_film_ior: Scalar = 1.33, Range::Positive;
        /// Radiance over `emission_strength`.
        emission_color: Color = 1.0, Range::NonNegative;
        /// W·m⁻²·sr⁻¹.
        emission_strength: Scalar = 0.0, Range::NonNegative;
    }
}

impl From<f32> for Scalar {
    fn from(value: f32) -> Self {
        Self::Value(value)
    }
}

impl From<f32> for Color {
    fn from(value: f32) -> Self {
        Self::Value([value; 3])
    }
}

impl TryFrom<Raw> for Principled {
    type Error = Clash;

    fn try_from(mut raw: Raw) -> Result<Self, Clash> {
        let (sockets, usual, node) = match raw.version {
            Version::V3_4 => (
                Sockets::V3(Principled3::take(&mut raw)?),
                Facets::Ggx,
                "3.4",
            ),
            Version::V4_5 | Version::V5_0 => (
                Sockets::V4(Principled4::take(&mut raw)?),
                Facets::MultiGgx,
                "4.5 and 5.0",
            ),
        };
        if let Some(key) = raw.rest() {
            let message = format!("the node of version {node} has no `{key}`");
            return Err(Clash::new(key, message));
        }
        Ok(Self {
            layering: raw.layering,
            multiple: raw.distribution.unwrap_or(usual) == Facets::MultiGgx,
            tangent: raw.tangent,
            normal: raw.normal,
            bump: raw.bump,
            filmed_metal: raw.version == Version::V5_0,
            sockets,
        })
    }
}

impl Principled {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        check.relief(Relief::of(&self.normal, &self.bump), at);
        match &self.sockets {
            Sockets::V3(sockets) => sockets.check(check, at),
            Sockets::V4(sockets) => sockets.check(check, at),
        }
    }
}

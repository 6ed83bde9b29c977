//! Values that may be written in more than one way.

use crate::texture::Channel;
use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor, value::MapAccessDeserializer};
use std::fmt;

/// A number, or a texture that gives one.
#[derive(Clone, Debug, PartialEq)]
pub enum Scalar {
    /// The same number everywhere.
    Value(f32),
    /// One channel of a texture.
    Texture {
        /// The texture's name.
        name: String,
        /// Which channel to take.
        channel: Channel,
    },
}

/// A scene-linear Rec. 709 colour, or a texture that gives one.
#[derive(Clone, Debug, PartialEq)]
pub enum Color {
    /// The same colour everywhere.
    Value([f32; 3]),
    /// The red, green and blue of the texture of this name.
    Texture(String),
}

impl Color {
    /// Grey of value 1: leaves what it multiplies as it is.
    pub const WHITE: Self = Self::Value([1.0; 3]);
}

/// Two keys that exclude each other, or one that lacks its partner.
#[derive(Debug)]
pub(super) struct Clash {
    /// The key to point at.
    key: &'static str,
    message: String,
}

impl Clash {
    pub(super) fn new(key: &'static str, message: impl Into<String>) -> Self {
        Self {
            key,
            message: message.into(),
        }
    }

    pub(super) fn between(first: &str, second: &'static str) -> Self {
        Self::new(
            second,
            format!("`{first}` and `{second}` exclude each other"),
        )
    }
}

/// What separates the key to point at from the message; serde hands errors on
/// as text alone.
pub(super) const CLASH_SEPARATOR: char = '\u{1f}';

impl fmt::Display for Clash {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}{CLASH_SEPARATOR}{}", self.key, self.message)
    }
}

pub(super) fn one() -> f32 {
    1.0
}

pub(super) fn whole() -> Scalar {
    Scalar::Value(1.0)
}

pub(super) fn ones<const N: usize>() -> [f32; N] {
    [1.0; N]
}

pub(super) fn yes() -> bool {
    true
}

/// Reads `[r, g, b]`, or one number for all three.
pub(super) fn triple<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f32; 3], D::Error> {
    deserializer.deserialize_any(TripleVisitor)
}

/// As [`triple`], for keys that may be absent.
pub(super) fn optional_triple<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[f32; 3]>, D::Error> {
    triple(deserializer).map(Some)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScalarTexture {
    texture: String,
    #[serde(default)]
    channel: Channel,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ColorTexture {
    texture: String,
}

/// The numbers of YAML, whichever way they are written.
macro_rules! visit_numbers {
    ($value:ty, $number:ident => $result:expr) => {
        fn visit_f64<E: de::Error>(self, $number: f64) -> Result<$value, E> {
            Ok($result)
        }
        fn visit_i64<E: de::Error>(self, $number: i64) -> Result<$value, E> {
            Ok($result)
        }
        fn visit_u64<E: de::Error>(self, $number: u64) -> Result<$value, E> {
            Ok($result)
        }
    };
}

pub(super) use visit_numbers;

struct TripleVisitor;

impl<'de> Visitor<'de> for TripleVisitor {
    type Value = [f32; 3];

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number or three numbers")
    }

    visit_numbers!([f32; 3], n => [n as f32; 3]);

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<[f32; 3], A::Error> {
        <[f32; 3]>::deserialize(de::value::SeqAccessDeserializer::new(seq))
    }
}

struct ScalarVisitor;

impl<'de> Visitor<'de> for ScalarVisitor {
    type Value = Scalar;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number or {texture: NAME}")
    }

    visit_numbers!(Scalar, n => Scalar::Value(n as f32));

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Scalar, A::Error> {
        let ScalarTexture { texture, channel } =
            ScalarTexture::deserialize(MapAccessDeserializer::new(map))?;
        Ok(Scalar::Texture {
            name: texture,
            channel,
        })
    }
}

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ScalarVisitor)
    }
}

struct ColorVisitor;

impl<'de> Visitor<'de> for ColorVisitor {
    type Value = Color;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, [r, g, b] or {texture: NAME}")
    }

    visit_numbers!(Color, n => Color::Value([n as f32; 3]));

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Color, A::Error> {
        TripleVisitor.visit_seq(seq).map(Color::Value)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Color, A::Error> {
        let ColorTexture { texture } = ColorTexture::deserialize(MapAccessDeserializer::new(map))?;
        Ok(Color::Texture(texture))
    }
}

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ColorVisitor)
    }
}

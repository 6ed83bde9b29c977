//! Materials.

use super::conductor::Conductor;
use super::factor::Factor;
use super::filled::Filled;
use super::layered::Layered;
use super::openpbr::OpenPbr;
use super::principled::{Principled, Version};
use super::relief::{Bump, NormalMap, Relief};
use super::rough::{Distribution, Rough, Scattering, Tangent, raw_rough, roughness_of};
use super::validate::{At, Check, Range};
use super::value::{Clash, Color, Scalar};
use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, Visitor, value::MapAccessDeserializer};
use std::fmt;

/// How a surface scatters, passes or emits light.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// A rough metal.
    Conductor(Conductor),
    /// Rough glass.
    Dielectric(Dielectric),
    /// What rough glass lets through, without Fresnel's factor.
    Refraction(Dielectric),
    /// Lambertian facets on a rough surface.
    RoughDiffuse(RoughDiffuse),
    /// Lambert's law, or Oren and Nayar's.
    Diffuse(Diffuse),
    /// Lambert's law, to the other side.
    Translucent(Translucent),
    /// Ashikhmin's velvet.
    Velvet(Velvet),
    /// Fibres on a surface.
    Sheen(Sheen),
    /// Shines on both sides.
    Emission(Emission),
    /// Lets light straight through.
    Transparent(Colored),
    /// Two materials, blended.
    Mix(Mix),
    /// Two materials, added.
    Sum(Sum),
    /// A surface around something that absorbs.
    Filled(Filled),
    /// Interfaces over a base.
    Layered(Layered),
    /// Blender's node.
    Principled(Box<Principled>),
    /// OpenPBR's surface.
    #[serde(rename = "openpbr")]
    OpenPbr(Box<OpenPbr>),
}

/// Rough glass.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawDielectric")]
pub struct Dielectric {
    /// The microsurface.
    pub rough: Rough,
    /// The index of refraction inside over the one outside.
    pub ior: Scalar,
    /// A factor on every reflection and refraction.
    pub color: Color,
}

/// Lambertian facets on a rough surface.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawRoughDiffuse")]
pub struct RoughDiffuse {
    /// The microsurface.
    pub rough: Rough,
    /// The albedo of every facet.
    pub color: Color,
}

/// Lambert's law, or Oren and Nayar's.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Diffuse {
    /// The albedo.
    pub color: Color,
    /// 0 for Lambert's law, up to 1.
    pub roughness: Scalar,
    /// Which of Cycles' formulas is meant for rough ones.
    pub version: Version,
    /// What replaces the interpolated normal.
    pub normal: Option<NormalMap>,
    /// What leans it.
    pub bump: Option<Bump>,
}

impl Default for Diffuse {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
            roughness: Scalar::Value(0.0),
            version: Version::V4_5,
            normal: None,
            bump: None,
        }
    }
}

/// A material that a colour says all about.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Colored {
    /// The share of light that it passes on.
    pub color: Color,
}

impl Default for Colored {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
        }
    }
}

/// Lambert's law, to the other side.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Translucent {
    /// The share of light that it passes on.
    pub color: Color,
    /// What replaces the interpolated normal.
    pub normal: Option<NormalMap>,
    /// What leans it.
    pub bump: Option<Bump>,
}

impl Default for Translucent {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
            normal: None,
            bump: None,
        }
    }
}

/// Ashikhmin's velvet.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Velvet {
    /// A factor on its light.
    pub color: Color,
    /// How far fibres lean from the normal, as the tangent of an angle.
    pub sigma: Scalar,
    /// What replaces the interpolated normal.
    pub normal: Option<NormalMap>,
    /// What leans it.
    pub bump: Option<Bump>,
}

impl Default for Velvet {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
            sigma: Scalar::Value(1.0),
            normal: None,
            bump: None,
        }
    }
}

/// Fibres on a surface.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sheen {
    /// A factor on its light.
    pub color: Color,
    /// How loose the fibres are, 0 to 1.
    pub roughness: Scalar,
    /// What replaces the interpolated normal.
    pub normal: Option<NormalMap>,
    /// What leans it.
    pub bump: Option<Bump>,
}

impl Default for Sheen {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
            roughness: Scalar::Value(0.5),
            normal: None,
            bump: None,
        }
    }
}

/// Shines on both sides.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Emission {
    /// Scene-linear Rec. 709.
    pub color: Color,
    /// The factor that makes `color` a radiance in W·m⁻²·sr⁻¹.
    pub strength: Scalar,
}

impl Default for Emission {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
            strength: Scalar::Value(1.0),
        }
    }
}

/// Two materials, blended.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mix {
    /// The share of `b`, 0 to 1.
    #[serde(default)]
    pub factor: Factor,
    /// The first material.
    pub a: MaterialRef,
    /// The second material.
    pub b: MaterialRef,
}

/// Two materials, added: nothing keeps what they reflect together below 1.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sum {
    /// The first material.
    pub a: MaterialRef,
    /// The second material.
    pub b: MaterialRef,
}

/// A material by name, or written in place.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialRef {
    /// A name among the scene's materials.
    Name(String),
    /// A material of its own.
    Inline(Box<Material>),
}

impl<'de> Deserialize<'de> for MaterialRef {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct MaterialRefVisitor;

        impl<'de> Visitor<'de> for MaterialRefVisitor {
            type Value = MaterialRef;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a material, or a material")
            }

            fn visit_str<E>(self, name: &str) -> Result<MaterialRef, E> {
                Ok(MaterialRef::Name(name.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<MaterialRef, A::Error> {
                let material = Material::deserialize(MapAccessDeserializer::new(&mut map))?;
                if map.next_key::<de::IgnoredAny>()?.is_some() {
                    return Err(de::Error::invalid_value(
                        de::Unexpected::Map,
                        &"map with a single key",
                    ));
                }
                Ok(MaterialRef::Inline(Box::new(material)))
            }
        }

        deserializer.deserialize_any(MaterialRefVisitor)
    }
}

raw_rough! {
    RawDielectric {
        ior: Option<Scalar>,
        color: Option<Color>,
    }
    RawRoughDiffuse {
        color: Option<Color>,
    }
}

impl TryFrom<RawDielectric> for Dielectric {
    type Error = Clash;

    fn try_from(mut raw: RawDielectric) -> Result<Self, Clash> {
        Ok(Self {
            rough: raw.rough()?,
            ior: raw.ior.unwrap_or(Scalar::Value(1.5)),
            color: raw.color.unwrap_or(Color::WHITE),
        })
    }
}

impl TryFrom<RawRoughDiffuse> for RoughDiffuse {
    type Error = Clash;

    fn try_from(mut raw: RawRoughDiffuse) -> Result<Self, Clash> {
        Ok(Self {
            rough: raw.rough()?,
            color: raw.color.unwrap_or(Color::WHITE),
        })
    }
}

impl Material {
    /// Reports values out of range and names that lead nowhere.
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: At) {
        match self {
            Self::Conductor(conductor) => conductor.check(check, at.key("conductor")),
            Self::Dielectric(glass) => glass.check(check, at.key("dielectric")),
            Self::Refraction(glass) => glass.check(check, at.key("refraction")),
            Self::RoughDiffuse(matte) => {
                let at = at.key("rough_diffuse");
                matte.rough.check(check, &at);
                check.color(&matte.color, Range::UNIT, at.key("color"));
            }
            Self::Diffuse(diffuse) => {
                let at = at.key("diffuse");
                check.color(&diffuse.color, Range::UNIT, at.key("color"));
                check.scalar(&diffuse.roughness, Range::UNIT, at.key("roughness"));
                check.relief(Relief::of(&diffuse.normal, &diffuse.bump), &at);
            }
            Self::Translucent(part) => {
                let at = at.key("translucent");
                check.color(&part.color, Range::UNIT, at.key("color"));
                check.relief(Relief::of(&part.normal, &part.bump), &at);
            }
            Self::Transparent(part) => {
                check.color(&part.color, Range::UNIT, at.key("transparent").key("color"));
            }
            Self::Velvet(velvet) => {
                let at = at.key("velvet");
                check.color(&velvet.color, Range::UNIT, at.key("color"));
                check.scalar(&velvet.sigma, Range::NonNegative, at.key("sigma"));
                check.relief(Relief::of(&velvet.normal, &velvet.bump), &at);
            }
            Self::Sheen(sheen) => {
                let at = at.key("sheen");
                check.color(&sheen.color, Range::UNIT, at.key("color"));
                check.scalar(&sheen.roughness, Range::UNIT, at.key("roughness"));
                check.relief(Relief::of(&sheen.normal, &sheen.bump), &at);
            }
            Self::Emission(emission) => {
                let at = at.key("emission");
                check.color(&emission.color, Range::NonNegative, at.key("color"));
                check.scalar(&emission.strength, Range::NonNegative, at.key("strength"));
            }
            Self::Mix(mix) => {
                let at = at.key("mix");
                mix.factor.check(check, &at.key("factor"));
                mix.a.check_part(check, at.key("a"));
                mix.b.check_part(check, at.key("b"));
            }
            Self::Sum(sum) => {
                let at = at.key("sum");
                sum.a.check_part(check, at.key("a"));
                sum.b.check_part(check, at.key("b"));
            }
            Self::Filled(filled) => filled.check(check, &at.key("filled")),
            Self::Layered(layered) => layered.check(check, &at.key("layered")),
            Self::Principled(principled) => principled.check(check, &at.key("principled")),
            Self::OpenPbr(surface) => surface.check(check, &at.key("openpbr")),
        }
    }

    /// What replaces and leans its interpolated normal.
    #[must_use]
    pub fn relief(&self) -> Relief<'_> {
        match self {
            Self::Conductor(Conductor { rough, .. })
            | Self::Dielectric(Dielectric { rough, .. })
            | Self::Refraction(Dielectric { rough, .. })
            | Self::RoughDiffuse(RoughDiffuse { rough, .. }) => {
                Relief::of(&rough.normal, &rough.bump)
            }
            Self::Diffuse(part) => Relief::of(&part.normal, &part.bump),
            Self::Translucent(part) => Relief::of(&part.normal, &part.bump),
            Self::Velvet(part) => Relief::of(&part.normal, &part.bump),
            Self::Sheen(part) => Relief::of(&part.normal, &part.bump),
            Self::Layered(part) => Relief::of(&part.normal, &part.bump),
            Self::Principled(part) => Relief::of(&part.normal, &part.bump),
            Self::OpenPbr(part) => Relief::of(&part.normal, &part.bump),
            _ => Relief::default(),
        }
    }

    /// The materials that it is made of.
    pub(crate) fn parts(&self) -> impl Iterator<Item = &MaterialRef> {
        let parts = match self {
            Self::Mix(Mix { a, b, .. }) | Self::Sum(Sum { a, b }) => [Some(a), Some(b)],
            Self::Filled(filled) => [Some(&filled.surface), None],
            Self::Layered(layered) => [layered.base.as_ref(), None],
            _ => [None; 2],
        };
        parts.into_iter().flatten()
    }
}

impl MaterialRef {
    /// Checks a part of a material.
    pub(super) fn check_part(&self, check: &mut Check<'_, '_>, at: At) {
        if let Self::Inline(material) = self {
            if let Material::Filled(_) = **material {
                let message = "a part has no inside of its own: put `filled` around the whole";
                check.report(at.clone(), message.to_owned());
            }
        }
        self.check(check, at);
    }

    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: At) {
        match self {
            Self::Name(name) => check.reference("materials", "material", name, at),
            Self::Inline(material) => material.check(check, at),
        }
    }
}

impl Dielectric {
    fn check(&self, check: &mut Check<'_, '_>, at: At) {
        self.rough.check(check, &at);
        check.scalar(&self.ior, Range::Positive, at.key("ior"));
        check.color(&self.color, Range::UNIT, at.key("color"));
    }
}

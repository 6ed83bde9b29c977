//! Materials.

use super::filled::Filled;
use super::layered::Layered;
use super::openpbr::OpenPbr;
use super::principled::{Principled, Version};
use super::relief::{Bump, NormalMap, Relief};
use super::rough::{Distribution, Rough, Roughness, Scattering, Tangent, raw_rough, roughness_of};
use super::validate::{At, Check, Range};
use super::value::{Clash, Color, Scalar, visit_numbers};
use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, Visitor, value::MapAccessDeserializer};
use serde_yaml::with::singleton_map_recursive;
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

/// A rough metal.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawConductor")]
pub struct Conductor {
    /// The microsurface.
    pub rough: Rough,
    /// The reflectance of every facet.
    pub reflectance: Reflectance,
}

/// The Fresnel reflectance of a metal's facets.
#[derive(Clone, Debug, PartialEq)]
pub enum Reflectance {
    /// The same at all angles.
    Color(Color),
    /// Measured complex indices of refraction.
    Metal(Metal),
    /// A complex index of refraction per channel, η + ik.
    Complex {
        /// The real part.
        eta: Color,
        /// The imaginary part, positive for absorption.
        k: Color,
    },
    /// Schlick's approximation.
    Schlick {
        /// At normal incidence.
        f0: Color,
    },
    /// Schlick's approximation corrected near 82°.
    F82 {
        /// At normal incidence.
        f0: Color,
        /// The reflectance at cos θ = 1/7.
        f82: Color,
    },
    /// Complex indices below a thin film.
    Film {
        /// The film.
        film: ThinFilm,
        /// The metal: [`Self::Metal`] or [`Self::Complex`].
        below: Box<Reflectance>,
    },
    /// The same, as Blender's nodes say it.
    EdgeTint {
        /// At normal incidence.
        f0: Color,
        /// The factor on Schlick's value at cos θ = 1/7.
        tint: Color,
    },
}

/// A film whose two reflections interfere.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThinFilm {
    /// Index of refraction, absolute.
    #[serde(default = "water")]
    pub ior: Scalar,
    /// Thickness in nm.
    pub thickness: Scalar,
}

impl ThinFilm {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        check.scalar(&self.ior, Range::Positive, at.key("ior"));
        check.scalar(&self.thickness, Range::NonNegative, at.key("thickness"));
    }
}

fn water() -> Scalar {
    Scalar::Value(1.33)
}

/// A metal with known indices of refraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // the names say it all
pub enum Metal {
    Gold,
    Silver,
    Copper,
    Aluminium,
    Iron,
    Chromium,
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
    RawConductor {
        color: Option<Color>,
        metal: Option<Metal>,
        eta: Option<Color>,
        k: Option<Color>,
        f0: Option<Color>,
        f82: Option<Color>,
        edge_tint: Option<Color>,
        thin_film: Option<ThinFilm>,
    }
    RawDielectric {
        ior: Option<Scalar>,
        color: Option<Color>,
    }
    RawRoughDiffuse {
        color: Option<Color>,
    }
}

impl TryFrom<RawConductor> for Conductor {
    type Error = Clash;

    fn try_from(mut raw: RawConductor) -> Result<Self, Clash> {
        let rough = raw.rough()?;
        let given: Vec<&str> = [
            ("color", raw.color.is_some()),
            ("metal", raw.metal.is_some()),
            ("eta", raw.eta.is_some() || raw.k.is_some()),
            (
                "f0",
                raw.f0.is_some() || raw.f82.is_some() || raw.edge_tint.is_some(),
            ),
        ]
        .into_iter()
        .filter_map(|(key, given)| given.then_some(key))
        .collect();
        if let [first, second, ..] = given[..] {
            return Err(Clash::new(
                second,
                format!(
                    "`{first}` and `{second}` exclude each other: a conductor takes one of `color`, `metal`, `eta` and `k`, `f0`, `f0` and `f82`, or `f0` and `edge_tint`"
                ),
            ));
        }
        if raw.f82.is_some() && raw.edge_tint.is_some() {
            return Err(Clash::between("f82", "edge_tint"));
        }
        if raw.edge_tint.is_some() && raw.f0.is_none() {
            return Err(Clash::new("edge_tint", "`edge_tint` needs `f0`"));
        }
        let reflectance = match (raw.metal, raw.eta, raw.k, raw.f0, raw.f82) {
            (Some(metal), ..) => Reflectance::Metal(metal),
            (_, Some(eta), Some(k), ..) => Reflectance::Complex { eta, k },
            (_, Some(_), None, ..) => return Err(Clash::new("eta", "`eta` needs `k`")),
            (_, None, Some(_), ..) => return Err(Clash::new("k", "`k` needs `eta`")),
            (.., Some(f0), Some(f82)) => Reflectance::F82 { f0, f82 },
            (.., Some(f0), None) => match raw.edge_tint {
                Some(tint) => Reflectance::EdgeTint { f0, tint },
                None => Reflectance::Schlick { f0 },
            },
            (.., None, Some(_)) => return Err(Clash::new("f82", "`f82` needs `f0`")),
            (.., None, None) => Reflectance::Color(raw.color.unwrap_or(Color::WHITE)),
        };
        let reflectance = match (raw.thin_film, reflectance) {
            (None, reflectance) => reflectance,
            (Some(film), below @ (Reflectance::Metal(_) | Reflectance::Complex { .. })) => {
                Reflectance::Film {
                    film,
                    below: Box::new(below),
                }
            }
            _ => {
                return Err(Clash::new(
                    "thin_film",
                    "`thin_film` needs `metal`, or `eta` and `k`: a film on a colour has no phase",
                ));
            }
        };
        Ok(Self { rough, reflectance })
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
                let factor = at.key("factor");
                match &mix.factor {
                    Factor::Share(share) => check.scalar(share, Range::UNIT, factor),
                    Factor::Fresnel { ior } => {
                        check.scalar(ior, Range::Positive, factor.key("fresnel").key("ior"));
                    }
                    Factor::Facing { blend } => {
                        check.scalar(blend, Range::UNIT, factor.key("facing").key("blend"));
                    }
                    Factor::Backfacing | Factor::CameraRay => {}
                }
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

impl Conductor {
    fn check(&self, check: &mut Check<'_, '_>, at: At) {
        self.rough.check(check, &at);
        self.reflectance.check(check, &at);
    }
}

impl Reflectance {
    fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        match self {
            Self::Film { film, below } => {
                film.check(check, &at.key("thin_film"));
                below.check(check, at);
            }
            Reflectance::Color(color) => check.color(color, Range::UNIT, at.key("color")),
            Reflectance::Metal(_) => {}
            Reflectance::Complex { eta, k } => {
                check.color(eta, Range::Positive, at.key("eta"));
                check.color(k, Range::NonNegative, at.key("k"));
            }
            Reflectance::Schlick { f0 } => check.color(f0, Range::UNIT, at.key("f0")),
            Reflectance::F82 { f0, f82 } => {
                check.color(f0, Range::UNIT, at.key("f0"));
                check.color(f82, Range::UNIT, at.key("f82"));
            }
            Reflectance::EdgeTint { f0, tint } => {
                check.color(f0, Range::UNIT, at.key("f0"));
                check.color(tint, Range::UNIT, at.key("edge_tint"));
            }
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

impl Rough {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        match &self.roughness {
            Roughness::Alpha(alpha) => check.scalar(alpha, Range::NonNegative, at.key("alpha")),
            Roughness::AlphaXy { x, y } => {
                check.scalar(x, Range::NonNegative, at.key("alpha_x"));
                check.scalar(y, Range::NonNegative, at.key("alpha_y"));
                if let (Scalar::Value(x), Scalar::Value(y)) = (x, y) {
                    if (*x == 0.0) != (*y == 0.0) {
                        check.report(
                            at.key("alpha_y"),
                            "expected `alpha_x` and `alpha_y` both 0 or both above 0".to_owned(),
                        );
                    }
                }
            }
            Roughness::Blender {
                roughness,
                anisotropy,
            } => {
                check.scalar(roughness, Range::UNIT, at.key("roughness"));
                check.scalar(anisotropy, Range::Within(-1.0, 1.0), at.key("anisotropy"));
            }
        }
        check.scalar(&self.rotation, Range::Within(-1.0, 1.0), at.key("rotation"));
        check.relief(Relief::of(&self.normal, &self.bump), at);
    }
}

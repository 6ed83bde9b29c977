//! Materials.

use super::value::{self, Clash, Color, Scalar};
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
    /// Lambertian facets on a rough surface.
    RoughDiffuse(RoughDiffuse),
    /// Lambert's law.
    Diffuse(Diffuse),
    /// Shines on both sides.
    Emission(Emission),
    /// Lets light straight through.
    Transparent(Transparent),
    /// Two materials, blended.
    Mix(Mix),
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
        eta: [f32; 3],
        /// The imaginary part, positive for absorption.
        k: [f32; 3],
    },
    /// Schlick's approximation.
    Schlick {
        /// At normal incidence.
        f0: [f32; 3],
    },
    /// Schlick's approximation corrected near 82°.
    F82 {
        /// At normal incidence.
        f0: [f32; 3],
        /// The factor on Schlick's value at cos θ = 1/7.
        f82: [f32; 3],
    },
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
    pub ior: f32,
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

/// Lambert's law.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Diffuse {
    /// The albedo.
    pub color: Color,
}

impl Default for Diffuse {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
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
    pub strength: f32,
}

impl Default for Emission {
    fn default() -> Self {
        Self {
            color: Color::WHITE,
            strength: 1.0,
        }
    }
}

/// Lets light straight through.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transparent {
    /// The transmittance.
    #[serde(default = "value::ones", deserialize_with = "value::triple")]
    pub color: [f32; 3],
}

/// Two materials, blended.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mix {
    /// The share of `b`, 0 to 1.
    #[serde(default = "half")]
    pub factor: Scalar,
    /// The first material.
    pub a: MaterialRef,
    /// The second material.
    pub b: MaterialRef,
}

fn half() -> Scalar {
    Scalar::Value(0.5)
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

/// A microsurface.
#[derive(Clone, Debug, PartialEq)]
pub struct Rough {
    /// The distribution of normals.
    pub distribution: Distribution,
    /// Whether light that meets the microsurface again is followed.
    pub scattering: Scattering,
    /// How rough.
    pub roughness: Roughness,
    /// How far the tangent is turned counter-clockwise about the normal, in
    /// turns.
    pub rotation: Scalar,
    /// Where the tangent comes from.
    pub tangent: Tangent,
}

/// How rough, in the way the file says it.
#[derive(Clone, Debug, PartialEq)]
pub enum Roughness {
    /// α, the same in both directions.
    Alpha(Scalar),
    /// α along the tangent and across.
    AlphaXy {
        /// Along the tangent.
        x: Scalar,
        /// Along the bitangent.
        y: Scalar,
    },
    /// Blender's roughness, the square root of α.
    Blender {
        /// √α, 0 to 1.
        roughness: Scalar,
        /// −1 to 1, as in Blender's Anisotropic node.
        anisotropy: Scalar,
    },
}

/// A distribution of microfacet normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Trowbridge and Reitz's.
    #[default]
    Ggx,
    /// Beckmann and Spizzichino's.
    Beckmann,
}

/// Whether light that meets the microsurface again is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scattering {
    /// Followed until it leaves.
    #[default]
    Multiple,
    /// Lost after the first facet.
    Single,
}

/// Where the tangent comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tangent {
    /// Along the texture coordinate u.
    #[default]
    Uv,
    /// Azimuthal about an axis of the object.
    Radial(Axis),
}

/// An axis of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // the names say it all
pub enum Axis {
    X,
    Y,
    Z,
}

/// Declares the keys of a rough material beside those that all share: serde's
/// `flatten` would lose both unknown keys and the place of errors.
macro_rules! raw_rough {
    ($($raw:ident { $($(#[$attribute:meta])* $key:ident: $type:ty,)* })*) => {
        $(
            #[derive(Deserialize)]
            #[serde(deny_unknown_fields)]
            struct $raw {
                #[serde(default)]
                distribution: Distribution,
                #[serde(default)]
                scattering: Scattering,
                alpha: Option<Scalar>,
                alpha_x: Option<Scalar>,
                alpha_y: Option<Scalar>,
                roughness: Option<Scalar>,
                anisotropy: Option<Scalar>,
                rotation: Option<Scalar>,
                #[serde(default)]
                tangent: Tangent,
                $($(#[$attribute])* $key: $type,)*
            }

            impl $raw {
                fn rough(&mut self) -> Result<Rough, Clash> {
                    let alphas = [self.alpha.take(), self.alpha_x.take(), self.alpha_y.take()];
                    Ok(Rough {
                        distribution: self.distribution,
                        scattering: self.scattering,
                        roughness: roughness(alphas, self.roughness.take(), self.anisotropy.take())?,
                        rotation: self.rotation.take().unwrap_or(Scalar::Value(0.0)),
                        tangent: self.tangent,
                    })
                }
            }
        )*
    };
}

raw_rough! {
    RawConductor {
        color: Option<Color>,
        metal: Option<Metal>,
        #[serde(default, deserialize_with = "value::optional_triple")]
        eta: Option<[f32; 3]>,
        #[serde(default, deserialize_with = "value::optional_triple")]
        k: Option<[f32; 3]>,
        #[serde(default, deserialize_with = "value::optional_triple")]
        f0: Option<[f32; 3]>,
        #[serde(default, deserialize_with = "value::optional_triple")]
        f82: Option<[f32; 3]>,
    }
    RawDielectric {
        ior: Option<f32>,
        color: Option<Color>,
    }
    RawRoughDiffuse {
        color: Option<Color>,
    }
}

fn roughness(
    [alpha, alpha_x, alpha_y]: [Option<Scalar>; 3],
    roughness: Option<Scalar>,
    anisotropy: Option<Scalar>,
) -> Result<Roughness, Clash> {
    let blender = match (&roughness, &anisotropy) {
        (Some(_), _) => Some("roughness"),
        (None, Some(_)) => Some("anisotropy"),
        (None, None) => None,
    };
    match (alpha, alpha_x, alpha_y, blender) {
        (Some(_), _, _, Some(key)) => Err(Clash::between("alpha", key)),
        (Some(_), Some(_), _, _) => Err(Clash::between("alpha", "alpha_x")),
        (Some(_), _, Some(_), _) => Err(Clash::between("alpha", "alpha_y")),
        (None, Some(_), _, Some(key)) => Err(Clash::between("alpha_x", key)),
        (None, _, Some(_), Some(key)) => Err(Clash::between("alpha_y", key)),
        (None, Some(_), None, None) => Err(Clash::new("alpha_x", "`alpha_x` needs `alpha_y`")),
        (None, None, Some(_), None) => Err(Clash::new("alpha_y", "`alpha_y` needs `alpha_x`")),
        (Some(alpha), None, None, None) => Ok(Roughness::Alpha(alpha)),
        (None, Some(x), Some(y), None) => Ok(Roughness::AlphaXy { x, y }),
        (None, None, None, _) => Ok(Roughness::Blender {
            roughness: roughness.unwrap_or(Scalar::Value(0.5)),
            anisotropy: anisotropy.unwrap_or(Scalar::Value(0.0)),
        }),
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
            ("f0", raw.f0.is_some() || raw.f82.is_some()),
        ]
        .into_iter()
        .filter_map(|(key, given)| given.then_some(key))
        .collect();
        if let [first, second, ..] = given[..] {
            return Err(Clash::new(
                second,
                format!(
                    "`{first}` and `{second}` exclude each other: a conductor takes one of `color`, `metal`, `eta` and `k`, `f0`, or `f0` and `f82`"
                ),
            ));
        }
        let reflectance = match (raw.metal, raw.eta, raw.k, raw.f0, raw.f82) {
            (Some(metal), ..) => Reflectance::Metal(metal),
            (_, Some(eta), Some(k), ..) => Reflectance::Complex { eta, k },
            (_, Some(_), None, ..) => return Err(Clash::new("eta", "`eta` needs `k`")),
            (_, None, Some(_), ..) => return Err(Clash::new("k", "`k` needs `eta`")),
            (.., Some(f0), Some(f82)) => Reflectance::F82 { f0, f82 },
            (.., Some(f0), None) => Reflectance::Schlick { f0 },
            (.., None, Some(_)) => return Err(Clash::new("f82", "`f82` needs `f0`")),
            (.., None, None) => Reflectance::Color(raw.color.unwrap_or(Color::WHITE)),
        };
        Ok(Self { rough, reflectance })
    }
}

impl TryFrom<RawDielectric> for Dielectric {
    type Error = Clash;

    fn try_from(mut raw: RawDielectric) -> Result<Self, Clash> {
        Ok(Self {
            rough: raw.rough()?,
            ior: raw.ior.unwrap_or(1.5),
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

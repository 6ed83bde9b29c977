//! Metals, and the films on them.

use super::relief::{Bump, NormalMap};
use super::rough::{Distribution, Rough, Scattering, Tangent, raw_rough, roughness_of};
use super::validate::{At, Check, Range};
use super::value::{Clash, Color, Scalar};
use serde::Deserialize;

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

impl Conductor {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: At) {
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

//! Surfaces made of layers.

use super::conductor::ThinFilm;
use super::factor::Factor;
use super::material::{Material, MaterialRef};
use super::relief::{Bump, NormalMap, Relief};
use super::rough::{Distribution, Rough, Scattering, Tangent, raw_rough, roughness_of};
use super::validate::{At, Check, Range};
use super::value::{Clash, Color, Scalar};
use serde::Deserialize;

/// Interfaces, from the top, over a base.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layered {
    /// From the top.
    pub interfaces: Vec<Interface>,
    /// What they lie on; absent: the medium below the last of them goes on.
    pub base: Option<MaterialRef>,
    /// How far the tangent of all layers is turned counter-clockwise about the
    /// normal, in turns.
    #[serde(default = "none")]
    pub rotation: Scalar,
    /// Where it comes from.
    #[serde(default)]
    pub tangent: Tangent,
    /// What replaces the interpolated normal of all layers.
    pub normal: Option<NormalMap>,
    /// What leans it.
    pub bump: Option<Bump>,
}

fn none() -> Scalar {
    Scalar::Value(0.0)
}

/// A dielectric interface and the slab below it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawInterface")]
pub struct Interface {
    /// The microsurface.
    pub rough: Rough,
    /// The index of refraction below it, absolute.
    pub ior: Scalar,
    /// What the slab below absorbs.
    pub slab: Slab,
    /// A film on the interface.
    pub film: Option<ThinFilm>,
}

/// What a slab absorbs.
#[derive(Clone, Debug, PartialEq)]
pub enum Slab {
    /// Nothing.
    Clear,
    /// By Beer and Lambert's law.
    Absorbing {
        /// Per metre and channel.
        absorption: Color,
        /// Metres.
        thickness: Scalar,
    },
    /// So much that this share crosses it at normal incidence, one way.
    Transmitting(Color),
}

raw_rough! {
    RawInterface {
        ior: Option<Scalar>,
        absorption: Option<Color>,
        thickness: Option<Scalar>,
        transmittance: Option<Color>,
        thin_film: Option<ThinFilm>,
    }
}

impl TryFrom<RawInterface> for Interface {
    type Error = Clash;

    fn try_from(mut raw: RawInterface) -> Result<Self, Clash> {
        if raw.rotation.is_some() {
            return Err(Clash::new("rotation", OWN_TANGENT));
        }
        if raw.tangent != Tangent::Uv {
            return Err(Clash::new("tangent", OWN_TANGENT));
        }
        if raw.scattering == Scattering::Single {
            return Err(Clash::new("scattering", OWN_SCATTERING));
        }
        if raw.normal.is_some() {
            return Err(Clash::new("normal", OWN_NORMAL));
        }
        if raw.bump.is_some() {
            return Err(Clash::new("bump", OWN_NORMAL));
        }
        let rough = raw.rough()?;
        let slab = match (raw.absorption, raw.thickness, raw.transmittance) {
            (None, None, None) => Slab::Clear,
            (Some(_), _, Some(_)) => return Err(Clash::between("absorption", "transmittance")),
            (None, Some(_), Some(_)) => return Err(Clash::between("thickness", "transmittance")),
            (None, Some(_), None) => {
                let message =
                    "`thickness` needs `absorption`: that of a clear slab changes nothing";
                return Err(Clash::new("thickness", message));
            }
            (None, None, Some(color)) => Slab::Transmitting(color),
            (Some(absorption), thickness, None) => Slab::Absorbing {
                absorption,
                thickness: thickness.unwrap_or(Scalar::Value(1.0)),
            },
        };
        Ok(Self {
            rough,
            ior: raw.ior.unwrap_or(Scalar::Value(1.5)),
            slab,
            film: raw.thin_film,
        })
    }
}

const OWN_TANGENT: &str = "the layers share one tangent: give it to `layered`";
const OWN_NORMAL: &str = "the layers share one normal: give it to `layered`";
const OWN_SCATTERING: &str = "layers are by walks, which follow all scattering";

/// What a base may be.
const BASES: &str =
    "`conductor`, `rough_diffuse`, `diffuse`, `dielectric` or a `mix` of the first three";

impl Layered {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        if self.interfaces.is_empty() && self.base.is_none() {
            let message = "expected interfaces or a `base`".to_owned();
            check.report(at.key("interfaces"), message);
        }
        for (index, interface) in self.interfaces.iter().enumerate() {
            interface.check(check, &at.key("interfaces").index(index));
        }
        if let (Some(last), None) = (self.interfaces.last(), &self.base) {
            let key = match last.slab {
                Slab::Clear => None,
                Slab::Absorbing { .. } => Some("absorption"),
                Slab::Transmitting(_) => Some("transmittance"),
            };
            if let Some(key) = key {
                let at = at.key("interfaces").index(self.interfaces.len() - 1);
                let message = "there is no slab below the last interface without a `base`";
                check.report(at.key(key), message.to_owned());
            }
        }
        check.scalar(&self.rotation, Range::Within(-1.0, 1.0), at.key("rotation"));
        check.relief(Relief::of(&self.normal, &self.bump), at);
        if let Some(base) = &self.base {
            base.check(check, at.key("base"));
            check_base(base, false, check, at.key("base"));
        }
    }
}

impl Interface {
    fn check(&self, check: &mut Check<'_, '_>, at: &At) {
        self.rough.check(check, at);
        check.scalar(&self.ior, Range::Positive, at.key("ior"));
        if let Some(film) = &self.film {
            film.check(check, &at.key("thin_film"));
        }
        match &self.slab {
            Slab::Clear => {}
            Slab::Absorbing {
                absorption,
                thickness,
            } => {
                check.color(absorption, Range::NonNegative, at.key("absorption"));
                check.scalar(thickness, Range::NonNegative, at.key("thickness"));
            }
            Slab::Transmitting(color) => {
                check.color(color, Range::Above(0.0, 1.0), at.key("transmittance"));
            }
        }
    }
}

/// Reports what can't lie below interfaces. Materials by name are known to exist,
/// or told already; what they are is seen when the stack is made.
fn check_base(base: &MaterialRef, in_mix: bool, check: &mut Check<'_, '_>, at: At) {
    let material = match base {
        MaterialRef::Inline(material) => material,
        MaterialRef::Name(_) => return,
    };
    if let Material::Mix(mix) = &**material {
        let at = at.key("mix");
        check_base(&mix.a, true, check, at.key("a"));
        check_base(&mix.b, true, check, at.key("b"));
    }
    if let Err(message) = fits(material, in_mix) {
        check.report(at, message);
    }
}

/// Whether a material, mixed with another or alone, can be the base of a stack; of a
/// mix its factor alone is looked at.
pub(crate) fn fits(material: &Material, in_mix: bool) -> Result<(), String> {
    if !material.relief().is_flat() {
        return Err(OWN_NORMAL.to_owned());
    }
    let rough = match material {
        Material::Conductor(conductor) => &conductor.rough,
        Material::RoughDiffuse(matte) => &matte.rough,
        Material::Diffuse(diffuse) => {
            return if diffuse.roughness == Scalar::Value(0.0) {
                Ok(())
            } else {
                Err(
                    "a diffuse base follows Lambert's law: for a rough one take `rough_diffuse`"
                        .to_owned(),
                )
            };
        }
        Material::Dielectric(_) if in_mix => {
            return Err(
                "a part of the base's mix is open: light would be both stopped and let through"
                    .to_owned(),
            );
        }
        Material::Dielectric(glass) => {
            if glass.color != Color::WHITE {
                return Err("an interface of a stack has no `color`: colour the slab below one by its `transmittance`".to_owned());
            }
            &glass.rough
        }
        Material::Mix(mix) => {
            return match mix.factor {
                Factor::Share(_) => Ok(()),
                _ => Err("below interfaces nobody is in sight: a base's `factor` is a number or a texture".to_owned()),
            };
        }
        _ => return Err(format!("a base is {BASES}")),
    };
    if rough.scattering == Scattering::Single {
        return Err(OWN_SCATTERING.to_owned());
    }
    if rough.tangent != Tangent::Uv || rough.rotation != none() {
        return Err(OWN_TANGENT.to_owned());
    }
    Ok(())
}

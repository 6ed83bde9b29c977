//! The keys that all rough materials share.

use super::relief::{Bump, NormalMap, Relief};
use super::validate::{At, Check, Range};
use super::value::{Clash, Scalar};
pub use crate::bsdf::Distribution;
use serde::Deserialize;

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
    /// What replaces the interpolated normal.
    pub normal: Option<NormalMap>,
    /// What leans it.
    pub bump: Option<Bump>,
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
    ($($raw:ident { $($key:ident: $type:ty,)* })*) => {
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
                normal: Option<NormalMap>,
                bump: Option<Bump>,
                $($key: $type,)*
            }

            impl $raw {
                fn rough(&mut self) -> Result<Rough, Clash> {
                    let alphas = [self.alpha.take(), self.alpha_x.take(), self.alpha_y.take()];
                    let blender = [self.roughness.take(), self.anisotropy.take()];
                    Ok(Rough {
                        distribution: self.distribution,
                        scattering: self.scattering,
                        roughness: roughness_of(self.distribution, alphas, blender)?,
                        rotation: self.rotation.take().unwrap_or(Scalar::Value(0.0)),
                        tangent: self.tangent,
                        normal: self.normal.take(),
                        bump: self.bump.take(),
                    })
                }
            }
        )*
    };
}

/// Roughness where the distribution has one.
pub(super) fn roughness_of(
    distribution: Distribution,
    alphas: [Option<Scalar>; 3],
    [rough, anisotropy]: [Option<Scalar>; 2],
) -> Result<Roughness, Clash> {
    if distribution.has_roughness() {
        return roughness(alphas, rough, anisotropy);
    }
    let [alpha, alpha_x, alpha_y] = &alphas;
    let given = [
        ("alpha", alpha),
        ("alpha_x", alpha_x),
        ("alpha_y", alpha_y),
        ("roughness", &rough),
        ("anisotropy", &anisotropy),
    ];
    match given.into_iter().find(|(_, value)| value.is_some()) {
        Some((key, _)) => Err(Clash::new(
            key,
            "the quadratic distribution has no roughness",
        )),
        None => Ok(Roughness::Alpha(Scalar::Value(1.0))),
    }
}

/// Roughness in one of the ways that a file may say it.
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

pub(super) use raw_rough;

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

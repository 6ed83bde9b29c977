//! From what the file says of a material to what is rendered: names become
//! indices, mixes become flat lists, the estimator is chosen.

use std::collections::BTreeMap;

use arrayvec::ArrayVec;

use super::material::{
    Distribution, Facet, Leaf, Material, Number, RoughMaterial, Roughness, Tangent, Tint,
    WeightedLeaf,
};
use crate::bsdf::{Albedos, MAX_CLOSURES, Method, Normals, WhiteFacets};
use crate::color::Rgb;
use crate::description as desc;
use smithwalk_model::{self as model, ConductorFresnel};

/// What can keep a material that reads well from being rendered.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum MaterialError {
    /// Nested mixes with too many leaves.
    #[error("the mix has more than {MAX_CLOSURES} materials in all; the most is {MAX_CLOSURES}")]
    TooManyClosures,
    /// A name that is not among the materials.
    #[error("there is no material `{0}`")]
    UnknownMaterial(String),
    /// A name that is not among the textures.
    #[error("there is no texture `{0}`")]
    UnknownTexture(String),
}

/// Looks up names while a material is compiled.
pub struct Names<'a> {
    /// The file's materials.
    pub materials: &'a BTreeMap<String, desc::Material>,
    /// The index of each texture.
    pub textures: &'a BTreeMap<String, usize>,
    /// The estimator that the file or the command line asks for.
    pub estimator: desc::Estimator,
}

/// Compiles one material with all that its mixes refer to.
///
/// # Errors
/// When a name is unknown or the mix has too many leaves.
pub fn compile_material(
    material: &desc::Material,
    names: &Names<'_>,
) -> Result<Material, MaterialError> {
    let mut leaves = Vec::new();
    add_leaves(material, names, &Above::default(), &mut leaves)?;
    Ok(Material { leaves })
}

/// The product of mix factors above a material.
#[derive(Clone)]
struct Above {
    share: f32,
    factors: ArrayVec<(Number, bool), MAX_CLOSURES>,
}

impl Default for Above {
    fn default() -> Self {
        Self {
            share: 1.0,
            factors: ArrayVec::new(),
        }
    }
}

impl Above {
    /// One level down, on the side of `b` or on that of `a`.
    fn below(&self, factor: Number, is_b: bool) -> Result<Self, MaterialError> {
        let mut below = self.clone();
        match factor {
            Number::Constant(f) => below.share *= if is_b { f } else { 1.0 - f },
            Number::Texture(..) => below
                .factors
                .try_push((factor, !is_b))
                .map_err(|_| MaterialError::TooManyClosures)?,
        }
        Ok(below)
    }
}

fn add_leaves(
    material: &desc::Material,
    names: &Names<'_>,
    above: &Above,
    leaves: &mut Vec<WeightedLeaf>,
) -> Result<(), MaterialError> {
    let leaf = match material {
        desc::Material::Mix(mix) => {
            let factor = names.number(&mix.factor)?;
            for (child, is_b) in [(&mix.a, false), (&mix.b, true)] {
                let below = above.below(factor, is_b)?;
                // A share of exactly zero never contributes.
                if below.share > 0.0 {
                    add_leaves(names.material(child)?, names, &below, leaves)?;
                }
            }
            return Ok(());
        }
        desc::Material::Conductor(conductor) => {
            names.rough(&conductor.rough, names.metal(&conductor.reflectance)?)?
        }
        desc::Material::Dielectric(glass) => names.rough(
            &glass.rough,
            Facet::Glass(glass.ior, names.tint(&glass.color)?),
        )?,
        desc::Material::RoughDiffuse(matte) => {
            names.rough(&matte.rough, Facet::Matte(names.tint(&matte.color)?))?
        }
        desc::Material::Diffuse(diffuse) => Leaf::Lambert(names.tint(&diffuse.color)?),
        desc::Material::Emission(emission) => {
            Leaf::Emission(names.tint(&emission.color)?, emission.strength)
        }
        desc::Material::Transparent(transparent) => Leaf::Transparent(transparent.color.into()),
    };
    if leaves.len() == MAX_CLOSURES {
        return Err(MaterialError::TooManyClosures);
    }
    leaves.push(WeightedLeaf {
        share: above.share,
        factors: above.factors.clone(),
        leaf,
    });
    Ok(())
}

impl<'a> Names<'a> {
    fn material(
        &self,
        reference: &'a desc::MaterialRef,
    ) -> Result<&'a desc::Material, MaterialError> {
        match reference {
            desc::MaterialRef::Inline(material) => Ok(material),
            desc::MaterialRef::Name(name) => self
                .materials
                .get(name)
                .ok_or_else(|| MaterialError::UnknownMaterial(name.clone())),
        }
    }

    fn texture(&self, name: &str) -> Result<usize, MaterialError> {
        let index = self.textures.get(name).copied();
        index.ok_or_else(|| MaterialError::UnknownTexture(name.to_owned()))
    }

    fn number(&self, scalar: &desc::Scalar) -> Result<Number, MaterialError> {
        match scalar {
            desc::Scalar::Value(value) => Ok(Number::Constant(*value)),
            desc::Scalar::Texture { name, channel } => {
                Ok(Number::Texture(self.texture(name)?, *channel))
            }
        }
    }

    fn tint(&self, color: &desc::Color) -> Result<Tint, MaterialError> {
        match color {
            desc::Color::Value(value) => Ok(Tint::Constant(Rgb::from(*value))),
            desc::Color::Texture(name) => Ok(Tint::Texture(self.texture(name)?)),
        }
    }

    fn metal(&self, reflectance: &desc::Reflectance) -> Result<Facet, MaterialError> {
        let rgb = model::Rgb;
        Ok(match reflectance {
            desc::Reflectance::Color(color) => Facet::Tinted(self.tint(color)?),
            desc::Reflectance::Metal(metal) => {
                let [eta, k] = complex_index(*metal);
                Facet::Metal(ConductorFresnel::Complex {
                    eta: rgb(eta),
                    k: rgb(k),
                })
            }
            desc::Reflectance::Complex { eta, k } => Facet::Metal(ConductorFresnel::Complex {
                eta: rgb(*eta),
                k: rgb(*k),
            }),
            desc::Reflectance::Schlick { f0 } => {
                Facet::Metal(ConductorFresnel::Schlick { f0: rgb(*f0) })
            }
            desc::Reflectance::F82 { f0, f82 } => Facet::Metal(ConductorFresnel::F82 {
                f0: rgb(*f0),
                f82: rgb(*f82),
            }),
        })
    }

    fn rough(&self, rough: &desc::Rough, facet: Facet) -> Result<Leaf, MaterialError> {
        let (roughness, isotropic) = match &rough.roughness {
            desc::Roughness::Alpha(alpha) => {
                let alpha = self.number(alpha)?;
                (Roughness::Alpha(alpha, alpha), true)
            }
            desc::Roughness::AlphaXy { x, y } => {
                let (x, y) = (self.number(x)?, self.number(y)?);
                (Roughness::Alpha(x, y), x == y)
            }
            desc::Roughness::Blender {
                roughness,
                anisotropy,
            } => {
                let anisotropy = self.number(anisotropy)?;
                let isotropic = anisotropy == Number::Constant(0.0);
                (
                    Roughness::Blender {
                        roughness: self.number(roughness)?,
                        anisotropy,
                    },
                    isotropic,
                )
            }
        };
        let tangent = match rough.tangent {
            _ if isotropic => Tangent::Any,
            desc::Tangent::Uv => Tangent::Uv,
            desc::Tangent::Radial(axis) => Tangent::Radial(axis),
        };
        let distribution = match rough.distribution {
            desc::Distribution::Ggx => Distribution::Ggx,
            desc::Distribution::Beckmann => Distribution::Beckmann,
        };
        Ok(Leaf::Rough(RoughMaterial {
            distribution,
            roughness,
            rotation: self.number(&rough.rotation)?,
            tangent,
            facet,
            method: method(self.estimator, rough.scattering, distribution, facet),
        }))
    }
}

/// The estimator for a material: what the file insists on, or for `auto` the
/// one that measured best for these facets (docs/estimators.md). The
/// position-free estimator is for conductors; where it does not exist, two walks
/// do the work. Orders above the first are thinned where they are faint, which
/// is decided at every hit: roughness may have a texture, and angles count.
fn method(
    asked: desc::Estimator,
    scattering: desc::Scattering,
    distribution: Distribution,
    facet: Facet,
) -> Method {
    let metal = matches!(facet, Facet::Metal(_) | Facet::Tinted(_));
    match (scattering, asked) {
        (desc::Scattering::Single, _) | (_, desc::Estimator::Single) => Method::Single,
        (_, desc::Estimator::Walk) => Method::Multiple(model::Estimator::Walk),
        (_, desc::Estimator::TwoWalk) => Method::Multiple(model::Estimator::TwoWalk),
        (_, desc::Estimator::PositionFree) if metal => {
            Method::Multiple(model::Estimator::PositionFree)
        }
        (_, desc::Estimator::PositionFree) => Method::Multiple(model::Estimator::TwoWalk),
        (_, desc::Estimator::Auto) => match facet {
            Facet::Metal(_) | Facet::Tinted(_) => Method::Thinned(model::Estimator::PositionFree),
            Facet::Glass(..) => Method::Thinned(model::Estimator::TwoWalk),
            // Their first order is no cheaper than a step of a walk.
            Facet::Matte(_) => Method::Multiple(model::Estimator::TwoWalk),
        },
        (_, desc::Estimator::Compensated) => Method::Compensated(albedos(distribution, facet)),
    }
}

/// The table that single scattering on such facets is scaled by.
fn albedos(distribution: Distribution, facet: Facet) -> &'static Albedos {
    let normals = match distribution {
        Distribution::Ggx => Normals::Ggx,
        Distribution::Beckmann => Normals::Beckmann,
    };
    let white = match facet {
        Facet::Metal(_) | Facet::Tinted(_) => WhiteFacets::Conductor,
        Facet::Glass(ior, _) => WhiteFacets::Dielectric(ior),
        Facet::Matte(_) => WhiteFacets::Diffuse,
    };
    Albedos::of(normals, white)
}

/// η and k of a metal for red, green and blue (650, 550 and 450 nm), rounded
/// from published measurements.
fn complex_index(metal: desc::Metal) -> [[f32; 3]; 2] {
    match metal {
        desc::Metal::Gold => [[0.183, 0.421, 1.373], [3.424, 2.346, 1.770]],
        desc::Metal::Silver => [[0.159, 0.145, 0.135], [3.929, 3.190, 2.381]],
        desc::Metal::Copper => [[0.271, 0.677, 1.316], [3.609, 2.625, 2.292]],
        desc::Metal::Aluminium => [[1.346, 0.965, 0.617], [7.475, 6.400, 5.303]],
        desc::Metal::Iron => [[2.911, 2.950, 2.585], [3.089, 2.932, 2.767]],
        desc::Metal::Chromium => [[3.107, 3.181, 2.323], [3.331, 3.329, 3.135]],
    }
}

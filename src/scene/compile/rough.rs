//! Compiles rough surfaces: metals, glass, diffuse facets.

use super::super::material::{
    Facet, Leaf, Number, Reflectance, RoughMaterial, Roughness, Tangent, ThinFilm, Tint,
};
use super::{Compiler, MaterialError};
use crate::bsdf::{Albedos, Distribution, Method, WhiteFacets};
use crate::color::Rgb;
use crate::description as desc;
use crate::features::Features;
use smithwalk_model as model;

impl Compiler<'_> {
    /// What slopes that are averaged need, and the roughness that stands for them.
    pub(super) fn filter_slopes(
        &mut self,
        texture: &str,
        leaf: &mut Leaf,
    ) -> Result<(), MaterialError> {
        self.need_if(Features::FOOTPRINTS, true);
        self.filtered.insert(texture.to_owned());
        if let Leaf::Lambert(tint) = *leaf {
            let facet = Facet::Matte(tint);
            let distribution = Distribution::Beckmann;
            *leaf = Leaf::Rough(RoughMaterial {
                distribution,
                roughness: Roughness::Alpha(Number::Constant(0.0), Number::Constant(0.0)),
                rotation: Number::Constant(0.0),
                tangent: Tangent::Any,
                facet,
                method: self.method(desc::Scattering::Multiple, distribution, facet)?,
            });
        }
        let Leaf::Rough(rough) = leaf else {
            return Err(MaterialError::NotRough);
        };
        self.need_if(Features::MULTIPLE_SCATTERING, rough.method.is_multiple());
        self.need_if(rough.distribution.feature(), true);
        self.need_if(rough.facet.kind().feature(), true);
        Ok(())
    }

    pub(super) fn metal(
        &mut self,
        reflectance: &desc::Reflectance,
    ) -> Result<Reflectance, MaterialError> {
        Ok(match reflectance {
            desc::Reflectance::Color(color) => Reflectance::Constant(self.tint(color)?),
            desc::Reflectance::Metal(metal) => {
                let [eta, k] = complex_index(*metal).map(|c| Tint::Constant(Rgb::from(c)));
                Reflectance::Complex { eta, k }
            }
            desc::Reflectance::Complex { eta, k } => Reflectance::Complex {
                eta: self.tint(eta)?,
                k: self.tint(k)?,
            },
            desc::Reflectance::Schlick { f0 } => Reflectance::Schlick(self.tint(f0)?),
            desc::Reflectance::F82 { f0, f82 } => Reflectance::F82 {
                f0: self.tint(f0)?,
                f82: self.tint(f82)?,
            },
            desc::Reflectance::Film { film, below } => match self.metal(below)? {
                Reflectance::Complex { eta, k } => Reflectance::Film {
                    film: self.film(film)?,
                    eta,
                    k,
                },
                _ => unreachable!("a film lies on complex indices"),
            },
            desc::Reflectance::EdgeTint { f0, tint } => Reflectance::EdgeTint {
                f0: self.tint(f0)?,
                tint: self.tint(tint)?,
            },
        })
    }

    pub(super) fn film(&mut self, film: &desc::ThinFilm) -> Result<ThinFilm, MaterialError> {
        Ok(ThinFilm {
            ior: self.number(&film.ior)?,
            thickness: self.number(&film.thickness)?,
        })
    }

    pub(super) fn rough(
        &mut self,
        rough: &desc::Rough,
        facet: Facet,
    ) -> Result<Leaf, MaterialError> {
        let (roughness, isotropic) = self.roughness(&rough.roughness)?;
        let tangent = self.tangent(rough.tangent, isotropic);
        let method = self.method(rough.scattering, rough.distribution, facet)?;
        self.need_if(
            Features::MULTIPLE_SCATTERING,
            method.is_multiple() && !roughness.is_smooth(),
        );
        self.need_if(rough.distribution.feature(), true);
        self.need_if(facet.kind().feature(), true);
        Ok(Leaf::Rough(RoughMaterial {
            distribution: rough.distribution,
            roughness,
            rotation: self.number(&rough.rotation)?,
            tangent,
            facet,
            method,
        }))
    }

    /// How rough, and whether it is the same in all directions.
    pub(super) fn roughness(
        &mut self,
        roughness: &desc::Roughness,
    ) -> Result<(Roughness, bool), MaterialError> {
        Ok(match roughness {
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
                let roughness = self.number(roughness)?;
                let isotropic = anisotropy.is(0.0);
                (
                    Roughness::Blender {
                        roughness,
                        anisotropy,
                    },
                    isotropic,
                )
            }
        })
    }

    pub(super) fn tangent(&mut self, tangent: desc::Tangent, isotropic: bool) -> Tangent {
        if isotropic {
            return Tangent::Any;
        }
        self.need_if(Features::ANISOTROPY, true);
        match tangent {
            desc::Tangent::Uv => {
                self.needs.uvs = true;
                Tangent::Uv
            }
            desc::Tangent::Radial(axis) => Tangent::Radial(axis),
        }
    }

    /// The estimator for facets: what the file insists on, or for `auto` the one
    /// that measured best for them (docs/estimators.md). The position-free
    /// estimator is for conductors; where it does not exist, two walks do the
    /// work. Orders above the first are thinned where they are faint, which is
    /// decided at every hit: roughness may have a texture, and angles count.
    pub(super) fn method(
        &self,
        scattering: desc::Scattering,
        distribution: Distribution,
        facet: Facet,
    ) -> Result<Method, MaterialError> {
        let metal = matches!(facet, Facet::Metal(_));
        Ok(match (scattering, self.estimator) {
            (desc::Scattering::Single, _) | (_, desc::Estimator::Single) => Method::Single,
            (_, desc::Estimator::Walk) => Method::Multiple(model::Estimator::Walk),
            (_, desc::Estimator::TwoWalk) => Method::Multiple(model::Estimator::TwoWalk),
            (_, desc::Estimator::PositionFree) if metal => {
                Method::Multiple(model::Estimator::PositionFree)
            }
            (_, desc::Estimator::PositionFree) => Method::Multiple(model::Estimator::TwoWalk),
            (_, desc::Estimator::Auto) => match facet {
                Facet::Metal(_) => Method::Thinned(model::Estimator::PositionFree),
                Facet::Glass(..) | Facet::Refraction(..) => {
                    Method::Thinned(model::Estimator::TwoWalk)
                }
                // Their first order is no cheaper than a step of a walk.
                Facet::Matte(_) => Method::Multiple(model::Estimator::TwoWalk),
            },
            (_, desc::Estimator::Compensated) => {
                let white = match facet {
                    Facet::Metal(_) => WhiteFacets::Conductor,
                    Facet::Glass(Number::Constant(ior), _) => WhiteFacets::Dielectric(ior),
                    Facet::Glass(..) => return Err(MaterialError::TexturedIndex),
                    // There is no white one: total reflection absorbs.
                    Facet::Refraction(..) => return Ok(Method::Single),
                    Facet::Matte(_) => WhiteFacets::Diffuse,
                };
                Method::Compensated(Albedos::of(distribution, white))
            }
        })
    }
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

//! Compiles stacks of interfaces.

use super::super::material::{
    BaseLayer, InterfaceLayer, LayeredMaterial, Layers, Leaf, Relief, Roughness, Slab,
};
use super::{Compiler, MaterialError};
use crate::bsdf::Distribution;
use crate::description as desc;
use crate::features::Features;

impl Compiler<'_> {
    pub(super) fn layered(&mut self, layered: &desc::Layered) -> Result<Leaf, MaterialError> {
        let mut interfaces = Vec::with_capacity(layered.interfaces.len() + 1);
        for interface in &layered.interfaces {
            interfaces.push(InterfaceLayer {
                ior: self.number(&interface.ior)?,
                relief: self.relief(&interface.rough)?,
                slab: match &interface.slab {
                    desc::Slab::Clear => Slab::Clear,
                    desc::Slab::Absorbing {
                        absorption,
                        thickness,
                    } => Slab::Absorbing(self.tint(absorption)?, self.number(thickness)?),
                    desc::Slab::Transmitting(color) => Slab::Transmitting(self.tint(color)?),
                },
                film: match &interface.film {
                    Some(film) => Some(self.film(film)?),
                    None => None,
                },
            });
        }
        let base = match &layered.base {
            None => BaseLayer::Open,
            Some(base) => match self.part(base)? {
                material @ desc::Material::Dielectric(glass) => {
                    desc::fits(material, false).map_err(MaterialError::Stack)?;
                    interfaces.push(InterfaceLayer {
                        ior: self.number(&glass.ior)?,
                        relief: self.relief(&glass.rough)?,
                        slab: Slab::Clear,
                        film: None,
                    });
                    BaseLayer::Open
                }
                material => self.base(material, false)?,
            },
        };
        let layers = Layers { interfaces, base };
        let tangent = self.tangent(layered.tangent, layers.is_isotropic());
        let open = matches!(layers.base, BaseLayer::Open);
        self.need_walks();
        self.need_if(Features::TRANSMISSION, open);
        let rotation = self.number(&layered.rotation)?;
        let material = LayeredMaterial::new(layers, rotation, tangent)
            .map_err(|error| MaterialError::Stack(error.to_string()))?;
        Ok(Leaf::Layered(Box::new(material)))
    }

    /// What stacks need.
    pub(super) fn need_walks(&mut self) {
        self.need_if(Features::LAYERS.with(Features::MULTIPLE_SCATTERING), true);
        if matches!(
            self.estimator,
            desc::Estimator::Single | desc::Estimator::Compensated
        ) {
            self.note("layers are by walks, whatever the estimator");
        }
    }

    fn base(
        &mut self,
        material: &desc::Material,
        in_mix: bool,
    ) -> Result<BaseLayer, MaterialError> {
        desc::fits(material, in_mix).map_err(MaterialError::Stack)?;
        Ok(match material {
            desc::Material::Conductor(conductor) => BaseLayer::Metal(
                self.relief(&conductor.rough)?,
                self.metal(&conductor.reflectance)?,
            ),
            desc::Material::RoughDiffuse(matte) => {
                BaseLayer::Matte(self.relief(&matte.rough)?, self.tint(&matte.color)?)
            }
            desc::Material::Diffuse(diffuse) => BaseLayer::Lambert(self.tint(&diffuse.color)?),
            desc::Material::Mix(mix) => {
                let desc::Factor::Share(share) = &mix.factor else {
                    unreachable!("other factors don't fit");
                };
                let share = self.number(share)?;
                let [a, b] = [&mix.a, &mix.b].map(|part| self.part(part));
                BaseLayer::Mix(
                    share,
                    Box::new([self.base(a?, true)?, self.base(b?, true)?]),
                )
            }
            _ => unreachable!("other kinds don't fit"),
        })
    }

    fn relief(&mut self, rough: &desc::Rough) -> Result<Relief, MaterialError> {
        if !matches!(
            rough.distribution,
            Distribution::Ggx | Distribution::Beckmann
        ) {
            let message = "layers have the distributions `ggx` and `beckmann`";
            return Err(MaterialError::Stack(message.to_owned()));
        }
        Ok(Relief {
            distribution: rough.distribution,
            roughness: self.roughness(&rough.roughness)?.0,
        })
    }
}

impl Layers {
    /// Whether no layer has a direction.
    fn is_isotropic(&self) -> bool {
        let interfaces = self.interfaces.iter();
        interfaces
            .map(|interface| interface.relief)
            .all(is_isotropic)
            && self.base.is_isotropic()
    }
}

impl BaseLayer {
    fn is_isotropic(&self) -> bool {
        match self {
            Self::Open | Self::Lambert(_) => true,
            Self::Metal(relief, _) | Self::Matte(relief, _) => is_isotropic(*relief),
            Self::Mix(_, parts) => parts.iter().all(Self::is_isotropic),
        }
    }
}

fn is_isotropic(relief: Relief) -> bool {
    match relief.roughness {
        Roughness::Alpha(x, y) => x == y,
        Roughness::Blender { anisotropy, .. } => anisotropy.is(0.0),
    }
}

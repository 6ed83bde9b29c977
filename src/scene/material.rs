//! Materials as they are rendered: flat lists of closures whose parameters are
//! numbers or texture indices.

use arrayvec::ArrayVec;
use glam::{Vec2, Vec3};

use super::{Surface, View};
use crate::bsdf::{
    Bsdf, Closure, Frame, Interface, Lambert, MAX_CLOSURES, Method, Mirror, Rough, WeightedClosure,
};
use crate::color::Rgb;
use crate::description::{Axis, Channel};
use crate::features::{Features, has};
use crate::texture::Texture;
use smithwalk_model::{
    self as model, Beckmann, Conductor, ConductorFresnel, Dielectric, Diffuse, Ggx, Microsurface,
};

/// A number at every point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// Everywhere the same.
    Constant(f32),
    /// A channel of the scene's texture of this index.
    Texture(usize, Channel),
}

impl Number {
    #[inline]
    fn at<const F: u32>(self, textures: &[Texture], uv: Vec2) -> f32 {
        match self {
            Self::Constant(value) => value,
            Self::Texture(index, channel) if has::<F>(Features::TEXTURES) => {
                textures[index].channel(uv.into(), channel)
            }
            Self::Texture(..) => left_out(),
        }
    }
}

/// A colour at every point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tint {
    /// Everywhere the same.
    Constant(Rgb),
    /// Red, green and blue of the scene's texture of this index.
    Texture(usize),
}

impl Tint {
    #[inline]
    fn at<const F: u32>(self, textures: &[Texture], uv: Vec2) -> Rgb {
        match self {
            Self::Constant(value) => value,
            Self::Texture(..) if !has::<F>(Features::TEXTURES) => left_out(),
            Self::Texture(index) => {
                let [r, g, b, _] = textures[index].sample(uv.into());
                Rgb::new(r, g, b)
            }
        }
    }
}

/// How rough, in the two languages of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Roughness {
    /// Slope roughness along the tangent and across it.
    Alpha(Number, Number),
    /// Blender's: α = roughness², stretched by the Anisotropic node's rule.
    Blender {
        /// √α, 0 to 1.
        roughness: Number,
        /// −1 to 1.
        anisotropy: Number,
    },
}

impl Roughness {
    #[inline]
    fn alphas<const F: u32>(self, textures: &[Texture], uv: Vec2) -> (f32, f32) {
        match self {
            Self::Alpha(x, y) => {
                let at = |number: Number| number.at::<F>(textures, uv).max(0.0);
                (at(x), at(y))
            }
            Self::Blender {
                roughness,
                anisotropy,
            } => blender_alphas(
                roughness.at::<F>(textures, uv).clamp(0.0, 1.0),
                anisotropy.at::<F>(textures, uv),
            ),
        }
    }
}

/// α_x and α_y of Blender's Anisotropic node: a > 0 narrows the lobe along the
/// tangent. The clamp of |a| keeps 1 − |a| from vanishing, as Cycles does.
#[must_use]
pub fn blender_alphas(roughness: f32, anisotropy: f32) -> (f32, f32) {
    let alpha = roughness * roughness;
    let a = anisotropy.clamp(-0.99, 0.99);
    let (x, y) = if a < 0.0 {
        (alpha / (1.0 + a), alpha * (1.0 + a))
    } else {
        (alpha * (1.0 - a), alpha / (1.0 - a))
    };
    (x.min(1.0), y.min(1.0))
}

/// The distribution of facet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Trowbridge–Reitz.
    Ggx,
    /// Gaussian slopes.
    Beckmann,
}

/// What the facets are made of.
#[derive(Clone, Copy, Debug)]
pub enum Facet {
    /// Metal with a constant Fresnel law.
    Metal(ConductorFresnel<f32>),
    /// Metal that reflects this share of light at all angles.
    Tinted(Tint),
    /// Glass: index of refraction inside over outside, and a colour.
    Glass(f32, Tint),
    /// Lambertian.
    Matte(Tint),
}

/// Where the x axis of a closure's frame points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangent {
    /// Nowhere in particular: the closure is isotropic.
    Any,
    /// Along the texture coordinate u.
    Uv,
    /// Round an axis of the object.
    Radial(Axis),
}

/// A rough material before its parameters are looked up.
#[derive(Clone, Copy, Debug)]
pub struct RoughMaterial {
    /// The distribution of normals.
    pub distribution: Distribution,
    /// How wide it is.
    pub roughness: Roughness,
    /// Turns of the tangent, counter-clockwise about the normal.
    pub rotation: Number,
    /// Where the tangent is without rotation.
    pub tangent: Tangent,
    /// What the facets are.
    pub facet: Facet,
    /// Which orders, and how they are estimated.
    pub method: Method,
}

/// One leaf of a mix.
#[derive(Clone, Copy, Debug)]
pub enum Leaf {
    /// Lambert's law.
    Lambert(Tint),
    /// Straight through.
    Transparent(Rgb),
    /// A microsurface.
    Rough(RoughMaterial),
    /// Radiance colour · strength on both sides, W·m⁻²·sr⁻¹.
    Emission(Tint, f32),
}

/// A leaf with the product of mix factors above it.
#[derive(Clone, Debug)]
pub struct WeightedLeaf {
    /// The constant part of the product.
    pub share: f32,
    /// Textured factors; `true` takes one minus the factor.
    pub factors: ArrayVec<(Number, bool), MAX_CLOSURES>,
    /// The leaf.
    pub leaf: Leaf,
}

impl WeightedLeaf {
    fn share_at<const F: u32>(&self, textures: &[Texture], uv: Vec2) -> f32 {
        self.factors
            .iter()
            .fold(self.share, |share, (factor, complement)| {
                let f = factor.at::<F>(textures, uv).clamp(0.0, 1.0);
                share * if *complement { 1.0 - f } else { f }
            })
    }
}

/// A material: at most [`MAX_CLOSURES`] leaves.
#[derive(Clone, Debug, Default)]
pub struct Material {
    /// The leaves of the mix; one for a plain material.
    pub leaves: Vec<WeightedLeaf>,
}

impl Material {
    /// The closures at a point, weighted for who looks at it.
    #[must_use]
    #[inline]
    pub fn bsdf<const F: u32>(
        &self,
        textures: &[Texture],
        surface: &Surface,
        _view: View,
    ) -> Bsdf<F> {
        let mut bsdf = Bsdf::new(surface.geometric_normal);
        let most = if has::<F>(Features::MIXES) {
            MAX_CLOSURES
        } else {
            1
        };
        for weighted in self.leaves.iter().take(most) {
            let share = if has::<F>(Features::MIXES) {
                weighted.share_at::<F>(textures, surface.uv)
            } else {
                1.0
            };
            let isotropic = || Frame::about(surface.normal);
            let (closure, frame) = match &weighted.leaf {
                Leaf::Emission(..) => continue,
                Leaf::Lambert(tint) => {
                    let albedo = tint.at::<F>(textures, surface.uv);
                    (Closure::Lambert(Lambert { albedo }), isotropic())
                }
                // What goes straight through does so by the true surface: an
                // interpolated normal may face away from the viewer.
                Leaf::Transparent(color) => (
                    Closure::Transparent(*color),
                    Frame::about(surface.geometric_normal),
                ),
                Leaf::Rough(rough) => (
                    rough.closure::<F>(textures, surface),
                    rough.frame::<F>(textures, surface),
                ),
            };
            bsdf.push(WeightedClosure {
                weight: Rgb::splat(share),
                chance: share,
                frame,
                closure,
            });
        }
        bsdf
    }

    /// The closures of a horizontal surface whose tangent is along x, seen from
    /// `wo`, above or below: what measurements of a material without textures
    /// look at.
    #[must_use]
    pub fn horizontal(&self, wo: Vec3) -> Bsdf {
        let view = View { wo, camera: false };
        self.bsdf(&[], &Surface::horizontal(wo.z > 0.0), view)
    }

    /// The radiance that leaves the point with these texture coordinates on either side, W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn emission(&self, textures: &[Texture], uv: Vec2) -> Rgb {
        let mut sum = Rgb::ZERO;
        for weighted in &self.leaves {
            if let Leaf::Emission(tint, strength) = weighted.leaf {
                sum += tint.at::<ALL>(textures, uv)
                    * (strength * weighted.share_at::<ALL>(textures, uv));
            }
        }
        sum
    }

    /// Whether any leaf shines.
    #[must_use]
    pub fn emits(&self) -> bool {
        self.leaves
            .iter()
            .any(|l| matches!(l.leaf, Leaf::Emission(_, strength) if strength > 0.0))
    }

    /// Whether light may reach it from behind.
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.leaves.iter().any(|weighted| {
            matches!(&weighted.leaf, Leaf::Rough(rough) if matches!(rough.facet, Facet::Glass(..)))
        })
    }

    /// The colour that a noise filter or a compositor takes for the albedo.
    #[must_use]
    pub fn albedo(&self, textures: &[Texture], uv: Vec2) -> Rgb {
        let color = |leaf: &Leaf| match leaf {
            Leaf::Lambert(tint) => tint.at::<ALL>(textures, uv),
            Leaf::Transparent(color) => *color,
            Leaf::Emission(..) => Rgb::ZERO,
            Leaf::Rough(rough) => match rough.facet {
                Facet::Metal(fresnel) => Rgb::from(fresnel.reflectance(1.0).0),
                Facet::Tinted(tint) | Facet::Glass(_, tint) | Facet::Matte(tint) => {
                    tint.at::<ALL>(textures, uv)
                }
            },
        };
        self.leaves
            .iter()
            .map(|l| color(&l.leaf) * l.share_at::<ALL>(textures, uv))
            .sum()
    }
}

impl RoughMaterial {
    /// The frame to scatter in; only anisotropic closures need the tangent.
    #[inline]
    fn frame<const F: u32>(&self, textures: &[Texture], surface: &Surface) -> Frame {
        if !has::<F>(Features::ANISOTROPY) {
            return Frame::about(surface.normal);
        }
        let tangent = match self.tangent {
            Tangent::Any => return Frame::about(surface.normal),
            Tangent::Uv => surface.tangent_along_u(),
            Tangent::Radial(axis) => surface.radial_tangent(axis),
        };
        Frame::with_tangent(
            surface.normal,
            tangent,
            self.rotation.at::<F>(textures, surface.uv),
        )
    }

    #[inline]
    fn closure<const F: u32>(&self, textures: &[Texture], surface: &Surface) -> Closure {
        let (alpha_x, alpha_y) = self.roughness.alphas::<F>(textures, surface.uv);
        let color = |tint: Tint| tint.at::<F>(textures, surface.uv);
        let eta = |ior: f32| if surface.front { ior } else { 1.0 / ior };
        if alpha_x == 0.0 && alpha_y == 0.0 {
            return match self.facet {
                Facet::Metal(fresnel) => Closure::Mirror(Mirror { fresnel }),
                Facet::Tinted(tint) => Closure::Mirror(Mirror {
                    fresnel: constant_fresnel(color(tint)),
                }),
                Facet::Glass(ior, tint) => Closure::Interface(Interface {
                    eta: eta(ior),
                    color: color(tint),
                }),
                Facet::Matte(tint) => Closure::Lambert(Lambert {
                    albedo: color(tint),
                }),
            };
        }
        // A groove: smooth one way only. The model has no such limit; this is
        // far below what f32 directions resolve.
        let (alpha_x, alpha_y) = (alpha_x.max(MIN_ALPHA), alpha_y.max(MIN_ALPHA));
        let method = self.method;
        /// Pairs the facets with the material's distribution.
        macro_rules! rough {
            ($facets:expr, $ggx:ident, $beckmann:ident) => {
                match self.distribution {
                    Distribution::Ggx => Closure::$ggx(Rough {
                        surface: Microsurface {
                            ndf: Ggx { alpha_x, alpha_y },
                            facets: $facets,
                        },
                        method,
                    }),
                    Distribution::Beckmann => Closure::$beckmann(Rough {
                        surface: Microsurface {
                            ndf: Beckmann { alpha_x, alpha_y },
                            facets: $facets,
                        },
                        method,
                    }),
                }
            };
        }
        match self.facet {
            Facet::Metal(fresnel) => {
                rough!(Conductor { fresnel }, GgxConductor, BeckmannConductor)
            }
            Facet::Tinted(tint) => rough!(
                Conductor {
                    fresnel: constant_fresnel(color(tint))
                },
                GgxConductor,
                BeckmannConductor
            ),
            Facet::Glass(ior, tint) => rough!(
                Dielectric {
                    eta: eta(ior),
                    tint: to_model_color(color(tint))
                },
                GgxDielectric,
                BeckmannDielectric
            ),
            Facet::Matte(tint) => {
                rough!(
                    Diffuse {
                        albedo: to_model_color(color(tint))
                    },
                    GgxDiffuse,
                    BeckmannDiffuse
                )
            }
        }
    }
}

/// For what is asked for too seldom to be compiled for each kernel.
const ALL: u32 = Features::EVERYTHING.bits();

/// Where a kernel lacks a feature of its scene, which it is chosen not to.
#[cold]
fn left_out() -> ! {
    unreachable!("the kernel has what the scene uses")
}

/// The least roughness across a groove that is smooth along it.
const MIN_ALPHA: f32 = 1e-7;

fn to_model_color(color: Vec3) -> model::Rgb<f32> {
    model::Rgb(color.to_array())
}

fn constant_fresnel(color: Rgb) -> ConductorFresnel<f32> {
    ConductorFresnel::Constant(to_model_color(color))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Anisotropic node's rule, worked by hand.
    #[test]
    fn anisotropy_follows_the_blender_node() {
        let close =
            |(x, y): (f32, f32), (a, b): (f32, f32)| (x - a).abs() < 1e-6 && (y - b).abs() < 1e-6;
        assert!(close(blender_alphas(0.5, 0.0), (0.25, 0.25)));
        assert!(close(blender_alphas(0.5, 0.5), (0.125, 0.5)));
        assert!(close(blender_alphas(0.5, -0.5), (0.5, 0.125)));
        assert!(
            close(blender_alphas(0.9, 0.5), (0.405, 1.0)),
            "the larger one is clamped"
        );
    }
}

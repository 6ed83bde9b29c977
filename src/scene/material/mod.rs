//! Materials as they are rendered: flat lists of closures whose parameters are
//! numbers or texture indices.

mod factor;
mod layers;
mod openpbr;
mod perturbation;
mod principled;
mod rough;
mod value;
mod walked;

pub use factor::Factor;
pub use layers::{BaseLayer, InterfaceLayer, LayeredMaterial, Layers, Relief, Slab};
pub use openpbr::OpenPbr;
pub use perturbation::{Bump, NormalMap, Perturbation};
pub use principled::{Layering, Principled3, Principled4, Setup};
pub use rough::{Facet, Reflectance, RoughMaterial, Roughness, Tangent, ThinFilm, blender_alphas};
pub use value::{Ground, Number, Point, Tint, VertexColors};

use arrayvec::ArrayVec;
use glam::Vec3;

use super::{Surface, View};
use crate::bsdf::{
    Bsdf, Closure, Diffuser, Frame, Lambert, MAX_CLOSURES, OrenNayar, Sheen, WeightedClosure,
    seen_by_closures,
};
use crate::color::Rgb;
use crate::description::Version;
use crate::features::{Features, has};
use crate::texture::Texture;

/// One leaf of a mix.
#[derive(Clone, Debug)]
pub enum Leaf {
    /// Lambert's law.
    Lambert(Tint),
    /// Oren and Nayar's, of a roughness and by the formula of a version of Cycles.
    OrenNayar(Tint, Number, Version),
    /// Lambert's law, to the other side.
    Translucent(Tint),
    /// Ashikhmin's velvet: colour and σ.
    Velvet(Tint, Number),
    /// Fibres: colour and roughness.
    Sheen(Tint, Number),
    /// Straight through.
    Transparent(Tint),
    /// A microsurface.
    Rough(RoughMaterial),
    /// Radiance colour · strength on both sides, W·m⁻²·sr⁻¹.
    Emission(Tint, Number),
    /// Interfaces over a base.
    Layered(Box<LayeredMaterial>),
    /// The node of Blender 2.8 to 3.6.
    Principled3(Box<Principled3>),
    /// The node of Blender 4 and 5.
    Principled4(Box<Principled4>),
    /// OpenPBR's surface.
    OpenPbr(Box<OpenPbr>),
}

/// A leaf with the product of mix factors above it.
#[derive(Clone, Debug)]
pub struct WeightedLeaf {
    /// The constant part of the product.
    pub share: f32,
    /// Other factors; `true` takes one minus the factor.
    pub factors: ArrayVec<(Factor, bool), MAX_CLOSURES>,
    /// The leaf.
    pub leaf: Leaf,
    /// What replaces its normal.
    pub perturbation: Option<Box<Perturbation>>,
}

impl WeightedLeaf {
    #[inline]
    fn share_at<const F: u32>(&self, point: &Point<'_>) -> f32 {
        self.factors
            .iter()
            .fold(self.share, |share, (factor, complement)| {
                let f = factor.at::<F>(point);
                share * if *complement { 1.0 - f } else { f }
            })
    }
}

/// A material: at most [`MAX_CLOSURES`] closures.
#[derive(Clone, Debug, Default)]
pub struct Material {
    /// The leaves of the mix; one for a plain material.
    pub leaves: Vec<WeightedLeaf>,
    /// What the inside of objects of this material absorbs, m⁻¹.
    pub interior: Option<Rgb>,
}

impl Material {
    /// The closures at a point, weighted for who looks at it.
    #[must_use]
    pub fn bsdf<const F: u32>(&self, ground: Ground<'_>, surface: &Surface, view: View) -> Bsdf<F> {
        let mut bsdf = Bsdf::new(surface.geometric_normal);
        self.add_closures(&mut bsdf, ground, surface, view);
        bsdf
    }

    /// Adds the closures at a point, weighted for who looks at it. Returning them costs
    /// a copy of two kilobytes.
    pub fn add_closures<const F: u32>(
        &self,
        bsdf: &mut Bsdf<F>,
        ground: Ground<'_>,
        surface: &Surface,
        view: View,
    ) {
        let most = if has::<F>(Features::MIXES) {
            MAX_CLOSURES
        } else {
            1
        };
        let even = Point::shaded(ground, surface, view);
        for weighted in self.leaves.iter().take(most) {
            let share = if has::<F>(Features::MIXES) {
                weighted.share_at::<F>(&even)
            } else {
                1.0
            };
            let perturbed = match &weighted.perturbation {
                Some(perturbation) if has::<F>(Features::NORMAL_MAPS) => {
                    Some(perturbation.surface::<F>(&even, surface))
                }
                _ => None,
            };
            let (surface, point, spread) = match &perturbed {
                Some((surface, spread)) => (
                    surface,
                    Point::shaded(ground, surface, view),
                    spread.as_ref(),
                ),
                None => (surface, even, None),
            };
            let seen = || seen_by_closures(surface.normal, surface.geometric_normal, view.wo);
            // Layers are weighed by the albedo of what lies on them.
            let layered = || Point {
                cos: seen().dot(surface.normal).max(0.0),
                ..point
            };
            let isotropic = || Frame::about(surface.normal);
            let (closure, frame) = match &weighted.leaf {
                Leaf::Emission(..) => continue,
                Leaf::Lambert(tint) => {
                    let albedo = tint.at::<F>(&point);
                    (Closure::Lambert(Lambert { albedo }), isotropic())
                }
                // What goes straight through does so by the true surface: an
                // interpolated normal may face away from the viewer.
                Leaf::Transparent(tint) => (
                    Closure::Transparent(tint.at::<F>(&point)),
                    Frame::about(surface.geometric_normal),
                ),
                Leaf::Rough(rough) => {
                    let frame = rough.tangent.frame::<F>(rough.rotation, &point, surface);
                    match spread {
                        None => (rough.closure::<F>(&point), frame),
                        Some(spread) => {
                            let alphas = rough.roughness.alphas::<F>(&point);
                            let (alphas, frame) = spread.widen(alphas, frame);
                            (rough.closure_of::<F>(&point, alphas), frame)
                        }
                    }
                }
                Leaf::Layered(layers) if has::<F>(Features::LAYERS) => {
                    match layers.closure::<F>(&point, surface) {
                        Some(closure) => closure,
                        None => continue,
                    }
                }
                Leaf::Principled3(node) if has::<F>(Features::PRINCIPLED) => {
                    node.add(bsdf, &layered(), surface, share);
                    continue;
                }
                Leaf::Principled4(node) if has::<F>(Features::PRINCIPLED) => {
                    node.add(bsdf, &layered(), surface, share);
                    continue;
                }
                Leaf::OpenPbr(node) if has::<F>(Features::PRINCIPLED) => {
                    node.add(bsdf, &point, surface, share);
                    continue;
                }
                leaf if has::<F>(Features::DIFFUSERS) => {
                    match leaf.diffuser::<F>(&point, isotropic().to_local(seen())) {
                        Some(lobe) => (Closure::Diffuser(lobe), isotropic()),
                        None => continue,
                    }
                }
                _ => value::left_out(),
            };
            bsdf.push(WeightedClosure {
                weight: Rgb::splat(share),
                chance: share,
                frame,
                closure,
            });
        }
    }

    /// The closures of a horizontal surface whose tangent is along x, seen from
    /// `wo`, above or below: what measurements of a material without textures
    /// look at.
    #[must_use]
    pub fn horizontal(&self, wo: Vec3) -> Bsdf {
        let view = View { wo, camera: false };
        self.bsdf(Ground::default(), &Surface::horizontal(wo.z > 0.0), view)
    }

    /// The radiance that leaves the point towards the viewer, W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn emission(&self, point: &Point<'_>) -> Rgb {
        let mut sum = Rgb::ZERO;
        for weighted in &self.leaves {
            let share = || weighted.share_at::<ALL>(point);
            sum += match &weighted.leaf {
                Leaf::Emission(tint, strength) => {
                    tint.at::<ALL>(point) * (strength.at::<ALL>(point).max(0.0) * share())
                }
                Leaf::Principled3(node) => node.emission::<ALL>(point) * share(),
                Leaf::Principled4(node) => node.emission::<ALL>(point) * share(),
                Leaf::OpenPbr(node) => node.emission::<ALL>(point) * share(),
                _ => continue,
            };
        }
        sum
    }

    /// What it shines on average, W·m⁻²·sr⁻¹: textures by their mean, factors that
    /// differ from point to point by one half.
    #[must_use]
    pub fn mean_emission(&self, textures: &[Texture]) -> Rgb {
        let mut sum = Rgb::ZERO;
        for weighted in &self.leaves {
            let Some((tint, strength)) = weighted.leaf.shines() else {
                continue;
            };
            let factors: f32 = weighted
                .factors
                .iter()
                .map(|(factor, complement)| {
                    let f = factor.typical();
                    if *complement { 1.0 - f } else { f }
                })
                .product();
            sum += tint.mean(textures) * (strength.mean(textures) * weighted.share * factors);
        }
        sum
    }

    /// Whether any leaf shines.
    #[must_use]
    pub fn emits(&self) -> bool {
        self.leaves
            .iter()
            .any(|weighted| weighted.leaf.shines().is_some())
    }

    /// Whether some of it has a normal of its own.
    #[must_use]
    pub fn is_perturbed(&self) -> bool {
        self.leaves
            .iter()
            .any(|weighted| weighted.perturbation.is_some())
    }

    /// The shading normal at a point: that of its leaves, weighted (unit length).
    #[must_use]
    pub fn normal(&self, point: &Point<'_>, surface: &Surface) -> Vec3 {
        if !self.is_perturbed() {
            return surface.normal;
        }
        let sum: Vec3 = self
            .leaves
            .iter()
            .map(|weighted| {
                let normal = match &weighted.perturbation {
                    Some(perturbation) => perturbation.surface::<ALL>(point, surface).0.normal,
                    None => surface.normal,
                };
                normal * weighted.share_at::<ALL>(point)
            })
            .sum();
        sum.try_normalize().unwrap_or(surface.normal)
    }

    /// Whether light may reach it from behind.
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.leaves.iter().any(|weighted| match &weighted.leaf {
            Leaf::Rough(rough) => matches!(rough.facet, Facet::Glass(..) | Facet::Refraction(..)),
            Leaf::Layered(layers) => layers.is_open(),
            Leaf::Principled3(node) => !node.transmission.is(0.0),
            Leaf::Principled4(node) => !node.transmission_weight.is(0.0),
            Leaf::OpenPbr(node) => !node.transmission_weight.is(0.0),
            Leaf::Translucent(_) => true,
            _ => false,
        })
    }

    /// Where the tangents of its leaves point.
    fn tangents(&self) -> impl Iterator<Item = Tangent> {
        self.leaves.iter().filter_map(|l| match &l.leaf {
            Leaf::Rough(rough) => Some(rough.tangent),
            Leaf::Layered(layers) => Some(layers.tangent()),
            Leaf::Principled3(node) => Some(node.setup.tangent),
            Leaf::Principled4(node) => Some(node.setup.tangent),
            Leaf::OpenPbr(node) => Some(node.setup.tangent),
            _ => None,
        })
    }

    /// Whether a tangent runs round an axis of the object.
    #[must_use]
    pub fn has_radial_tangent(&self) -> bool {
        self.tangents().any(|t| matches!(t, Tangent::Radial(_)))
    }

    /// Whether it may look different when it is turned about the normal.
    #[must_use]
    pub fn has_tangent(&self) -> bool {
        self.tangents().any(|tangent| tangent != Tangent::Any)
    }

    /// The colour that a noise filter or a compositor takes for the albedo.
    #[must_use]
    pub fn albedo(&self, point: &Point<'_>) -> Rgb {
        let color = |leaf: &Leaf| match leaf {
            Leaf::Lambert(tint)
            | Leaf::OrenNayar(tint, ..)
            | Leaf::Translucent(tint)
            | Leaf::Velvet(tint, _)
            | Leaf::Sheen(tint, _)
            | Leaf::Transparent(tint) => tint.at::<ALL>(point),
            Leaf::Emission(..) => Rgb::ZERO,
            Leaf::Rough(rough) => rough.albedo::<ALL>(point),
            Leaf::Layered(layers) => layers.albedo::<ALL>(point),
            Leaf::Principled3(node) => node.base_color.at::<ALL>(point),
            Leaf::Principled4(node) => node.base_color.at::<ALL>(point),
            Leaf::OpenPbr(node) => node.base_color.at::<ALL>(point),
        };
        self.leaves
            .iter()
            .map(|l| color(&l.leaf) * l.share_at::<ALL>(point))
            .sum()
    }
}

impl Leaf {
    /// How many closures it comes to at the most; what shines takes a place, too.
    #[must_use]
    pub fn most_closures(&self) -> usize {
        match self {
            Self::Principled3(node) => node.most_closures(),
            Self::Principled4(node) => node.most_closures(),
            Self::OpenPbr(node) => node.most_closures(),
            _ => 1,
        }
    }

    /// The colour and strength of what it shines; `None` if it does not.
    fn shines(&self) -> Option<(Tint, Number)> {
        let (tint, strength) = match self {
            Self::Emission(tint, strength) => (*tint, *strength),
            Self::Principled3(node) => (node.emission, node.emission_strength),
            Self::Principled4(node) => (node.emission_color, node.emission_strength),
            Self::OpenPbr(node) => (node.emission_color, node.emission_strength()),
            _ => return None,
        };
        (!strength.is(0.0) && tint != Tint::Constant(Rgb::ZERO)).then_some((tint, strength))
    }

    /// The wide lobe of such a leaf at a point seen from `wo`, in the local frame.
    fn diffuser<const F: u32>(&self, point: &Point<'_>, wo: Vec3) -> Option<Diffuser> {
        Some(match self {
            Self::OrenNayar(tint, roughness, version) => {
                let (albedo, roughness) = (tint.at::<F>(point), roughness.share::<F>(point));
                Diffuser::OrenNayar(match version {
                    Version::V3_4 => OrenNayar::of_cycles_3(albedo, roughness),
                    Version::V4_5 | Version::V5_0 => OrenNayar::of_cycles_4(albedo, roughness, wo),
                })
            }
            Self::Translucent(tint) => Diffuser::Translucent(tint.at::<F>(point)),
            Self::Velvet(tint, sigma) => Diffuser::Velvet {
                color: tint.at::<F>(point),
                steepness: sigma.at::<F>(point).max(LEAST_SIGMA).powi(-2),
            },
            Self::Sheen(tint, roughness) => Diffuser::Sheen(Sheen::new(
                tint.at::<F>(point),
                roughness.share::<F>(point),
                wo.z,
            )),
            _ => return None,
        })
    }
}

/// The least σ of velvet, as in Cycles.
const LEAST_SIGMA: f32 = 0.01;

/// For what is asked for too seldom to be compiled for each kernel.
const ALL: u32 = Features::EVERYTHING.bits();

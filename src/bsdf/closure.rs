//! The closed set of closures, matched once per hit.

use glam::Vec3;

use super::{
    BsdfSample, ByFacets, Diffuser, Interface, Lambert, Mirror, Rough, RoughClosure, Stack,
};
use crate::color::Rgb;
use crate::features::{Features, has};
use crate::rays::RayKind;
use smithwalk_model::{self as model, Beckmann, Conductor, Draw, Ggx, Tally};

/// Everything that a surface can scatter with.
#[derive(Clone, Debug)]
pub enum Closure {
    /// Perfectly diffuse.
    Lambert(Lambert),
    /// An exact mirror.
    Mirror(Mirror),
    /// An exact smooth interface.
    Interface(Interface),
    /// Lets this share of the light straight through.
    Transparent(Rgb),
    /// A microsurface.
    Rough(RoughClosure),
    /// Another wide lobe.
    Diffuser(Diffuser),
    /// Interfaces over a base.
    Layered(Stack),
}

/// The closures that can be evaluated for several directions at once.
pub(super) enum Laned<'a> {
    Ggx(&'a Rough<Ggx<f32>, Conductor<f32>>),
    Beckmann(&'a Rough<Beckmann<f32>, Conductor<f32>>),
}

/// Below this cosine a direction counts as inside the surface: nothing is
/// scattered from there, and 1/cosθ would overflow.
pub(super) const MIN_COS: f32 = 1e-7;

impl Closure {
    /// Whether code for the features `F` has to know this closure. Asked before
    /// a match, it takes the other arms out of it.
    #[inline(always)]
    pub(super) fn is_in<const F: u32>(&self) -> bool {
        match self {
            Self::Lambert(_) => true,
            Self::Mirror(_) => has::<F>(Features::METALS),
            Self::Interface(_) => has::<F>(Features::TRANSMISSION),
            Self::Transparent(_) => has::<F>(Features::TRANSPARENCY),
            Self::Rough(rough) => rough.is_in::<F>(),
            Self::Diffuser(_) => has::<F>(Features::DIFFUSERS),
            Self::Layered(_) => has::<F>(Features::LAYERS),
        }
    }

    /// Whether all of its light goes into single directions, so that `eval`
    /// and `pdf` have nothing to say.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Mirror(_) | Self::Interface(_) | Self::Transparent(_) => true,
            Self::Layered(stack) => stack.is_delta(),
            Self::Lambert(_) | Self::Rough(_) | Self::Diffuser(_) => false,
        }
    }

    /// The kind of ray that a direction with this cosine is.
    #[inline(always)]
    pub(super) fn kind(&self, cos: f32) -> RayKind {
        match self {
            _ if cos < 0.0 => RayKind::Transmission,
            Self::Lambert(_) | Self::Diffuser(_) => RayKind::Diffuse,
            Self::Rough(rough) if rough.has_diffuse_facets() => RayKind::Diffuse,
            _ => RayKind::Glossy,
        }
    }

    /// Draws a direction; see the contract of [`crate::bsdf`]. Degenerate samples
    /// are refused: what comes back is a finite direction with a finite, non-negative,
    /// non-zero weight.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
        if wo.z.is_nan() || wo.z <= MIN_COS {
            return None;
        }
        let sample = match self {
            Self::Rough(rough) => rough.sample(wo, rng)?,
            Self::Diffuser(lobe) => lobe.sample(wo, rng)?,
            Self::Layered(stack) => stack.sample(wo, rng)?,
            Self::Lambert(lambert) => lambert.sample(rng),
            Self::Mirror(mirror) => mirror.sample(wo),
            Self::Interface(interface) => interface.sample(wo, rng)?,
            Self::Transparent(color) => BsdfSample {
                wi: -wo,
                weight: *color,
                order: 1,
                delta: true,
            },
        };
        sample.is_usable().then_some(sample)
    }

    /// Adds f·|cosθ_i| or an estimate of it, sr⁻¹, to `tally`, order by order;
    /// nothing for delta closures.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3, rng: &mut impl Draw<f32>, tally: &mut impl Tally<f32>) {
        if !(wo.z > MIN_COS && wi.z.abs() > MIN_COS) {
            return;
        }
        // Eight walks take less time in lanes than one takes without. GGX gains as much
        // where that is the noise, and loses where it is not: there one is cheap.
        if let Self::Rough(RoughClosure::Beckmann(ByFacets::Conductor(rough))) = self {
            if rough.is_automatic() {
                return rough.eval_eightfold(wo, wi, rng, tally);
            }
        }
        match self {
            Self::Rough(rough) => rough.eval(wo, wi, rng, tally),
            Self::Diffuser(lobe) => tally.add(1, model::Rgb(lobe.eval(wo, wi).to_array())),
            Self::Layered(stack) => stack.eval(wo, wi, rng, tally),
            Self::Lambert(lambert) => tally.add(1, model::Rgb(lambert.eval(wi).to_array())),
            Self::Mirror(_) | Self::Interface(_) | Self::Transparent(_) => {}
        }
    }

    /// The closure if it can be evaluated for several directions at once.
    #[inline(always)]
    pub(super) fn in_lanes<const F: u32>(&self) -> Option<Laned<'_>> {
        if !self.is_in::<F>() {
            return None;
        }
        let Self::Rough(rough) = self else {
            return None;
        };
        match rough {
            RoughClosure::Ggx(ByFacets::Conductor(rough)) if rough.suits_lanes() => {
                Some(Laned::Ggx(rough))
            }
            RoughClosure::Beckmann(ByFacets::Conductor(rough)) if rough.suits_lanes() => {
                Some(Laned::Beckmann(rough))
            }
            _ => None,
        }
    }

    /// The density that multiple importance sampling uses, sr⁻¹; zero for
    /// delta closures.
    #[inline(always)]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !(wo.z > MIN_COS && wi.z.abs() > MIN_COS) {
            return 0.0;
        }
        match self {
            Self::Rough(rough) => rough.pdf(wo, wi),
            Self::Diffuser(lobe) => lobe.pdf(wo, wi),
            Self::Layered(stack) => stack.pdf(wo, wi),
            Self::Lambert(lambert) => lambert.pdf(wi),
            Self::Mirror(_) | Self::Interface(_) | Self::Transparent(_) => 0.0,
        }
    }
}

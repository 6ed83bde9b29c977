//! How surfaces scatter: the contract, and one file for each kind of closure.
//!
//! # The contract
//! Directions are unit vectors in the local frame (z = shading normal, on the
//! viewer's side), all pointing away from the surface. `wo` is towards where
//! the path came from and has `wo.z > 0`; `wi` is where it goes on, below the
//! surface (`wi.z < 0`) for transmission.
//!
//! - [`Closure::sample`] draws `wi`; its weight is f·|cosθ_i|/p with p the
//!   density it was drawn with, known in closed form or not.
//! - [`Closure::eval`] is f·|cosθ_i| in sr⁻¹, **with** the cosine; for
//!   microsurfaces an unbiased estimate of it, not its value.
//! - [`Closure::pdf`] is a density in sr⁻¹ (no cosine inside) that is positive
//!   wherever `eval` can be and integrates to one. For walks it is a stand-in
//!   for their own density, which has no closed form: multiple importance
//!   sampling is unbiased with any such density that both techniques share.
//!
//! [`smithwalk_model`] names the directions from the walk's point of view: its
//! walks begin at ω_i and leave along ω_o. Paths begin at the eye, so `wo` here is
//! the model's ω_i, and `wi` its ω_o; the cosine in `eval` is that of `wi`.
//!
//! What is carried along a path is L/n²: crossing an interface does not scale
//! it. As long as the eye and the lights are in the same medium that is exact,
//! and it is how Cycles does it.

mod clearcoat;
mod closure;
mod compensation;
mod diffuser;
mod frame;
mod horizons;
mod interface;
mod lambert;
mod mirror;
mod mixture;
mod rise;
mod rough;
mod sheen;
mod stack;
mod table;

pub use clearcoat::Clearcoat;
pub use closure::Closure;
pub use compensation::{Albedos, MeanWeight, WhiteFacets};
pub use diffuser::{Diffuser, OrenNayar};
pub use frame::Frame;
pub use horizons::{seen_by_closures, within_reach};
pub use interface::Interface;
pub use lambert::Lambert;
pub use mirror::Mirror;
pub use mixture::{Bsdf, InLanes, MAX_CLOSURES, ScatterSample, WeightedClosure};
pub use rise::Rises;
pub use rough::{Method, Rough};
pub use sheen::Sheen;
pub use stack::{Stack, StackLayers};
pub use table::{ByFacets, Distribution, FacetKind, Listed, RoughClosure, Width, WidthInLanes};

use glam::Vec3;

use crate::color::Rgb;
use smithwalk_model::{self as model, Tally, Vector3};

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The direction to go on in, local frame, unit length.
    pub wi: Vec3,
    /// f·|cosθ_i| over the density of `wi`; for a delta closure the fraction of
    /// light that goes this way over the probability of choosing it.
    pub weight: Rgb,
    /// How many facets the light met: 1 is single scattering.
    pub order: u32,
    /// Whether this is one of few single directions, which no light sample can meet
    /// and [`Closure::eval`] does not know of.
    pub delta: bool,
}

impl BsdfSample {
    /// Whether it is a finite direction with a finite, non-negative, non-zero weight.
    pub(crate) fn is_usable(&self) -> bool {
        self.wi.is_finite()
            && self.weight.is_finite()
            && self.weight.min_element() >= 0.0
            && self.weight.max_element() > 0.0
    }
}

impl From<model::Exit<f32>> for BsdfSample {
    #[inline]
    fn from(exit: model::Exit<f32>) -> Self {
        Self {
            wi: from_model(exit.direction),
            weight: Rgb::from(exit.weight.0),
            order: exit.order,
            delta: false,
        }
    }
}

/// f·|cosθ_i| in sr⁻¹ (or light that it weighted), apart by scattering order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ByOrder {
    /// One facet met at every surface.
    pub single: Rgb,
    /// More than one facet met at some surface.
    pub multiple: Rgb,
}

impl ByOrder {
    /// Nothing.
    pub const ZERO: Self = Self {
        single: Rgb::ZERO,
        multiple: Rgb::ZERO,
    };

    /// Both together.
    #[must_use]
    pub fn total(self) -> Rgb {
        self.single + self.multiple
    }
}

impl Tally<f32> for ByOrder {
    #[inline]
    fn add(&mut self, order: u32, value: model::Rgb<f32>) {
        let value = Rgb::from(value.0);
        if order <= 1 {
            self.single += value;
        } else {
            self.multiple += value;
        }
    }
}

impl std::ops::AddAssign for ByOrder {
    fn add_assign(&mut self, other: Self) {
        self.single += other.single;
        self.multiple += other.multiple;
    }
}

impl std::ops::Mul<Rgb> for ByOrder {
    type Output = Self;

    fn mul(self, factor: Rgb) -> Self {
        Self {
            single: self.single * factor,
            multiple: self.multiple * factor,
        }
    }
}

/// To the model's own vectors, which know no glam.
#[inline]
fn to_model(v: Vec3) -> Vector3<f32> {
    Vector3 {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}

/// And back.
#[inline]
fn from_model(v: Vector3<f32>) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

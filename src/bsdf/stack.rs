//! Layered surfaces behind the closure contract.

use std::ops::Deref;

use glam::Vec3;

use super::{BsdfSample, from_model, to_model};
use crate::color::Rgb;
use smithwalk_model::layered::Layered;
use smithwalk_model::{Draw, Tally, Vector3};

/// A stack of interfaces, by the side that it is seen from. All orders, by walks.
#[derive(Clone, Debug)]
pub struct Stack {
    layers: StackLayers,
    /// The stack's frame is this one, point-reflected.
    inverted: bool,
}

/// Where a stack's layers are kept: apart, since every closure at a hit has the size of
/// the largest.
#[derive(Clone, Debug)]
pub enum StackLayers {
    /// With the material, which is everywhere the same.
    Fixed(&'static Layered<f32>),
    /// Made for this hit.
    Made(Box<Layered<f32>>),
}

impl Deref for StackLayers {
    type Target = Layered<f32>;

    fn deref(&self) -> &Layered<f32> {
        match self {
            Self::Fixed(layers) => layers,
            Self::Made(layers) => layers,
        }
    }
}

impl Stack {
    /// A stack seen from outside (`front`) or from inside. Behind an opaque base is
    /// what is before it, as it is with closures of one surface.
    #[must_use]
    pub fn new(layers: StackLayers, front: bool) -> Self {
        Self {
            inverted: !front && layers.is_open(),
            layers,
        }
    }

    /// Whether all light leaves in single directions.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        self.layers.is_delta()
    }

    /// One walk.
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
        let exit = self.layers.sample(self.to_stack(wo), rng)?;
        let wi = from_model(exit.direction);
        Some(BsdfSample {
            wi: if self.inverted { -wi } else { wi },
            weight: Rgb::from(exit.weight.0),
            order: exit.order,
            delta: exit.delta,
        })
    }

    /// Adds an unbiased estimate of f·|cosθ_i|, sr⁻¹, to `tally`, order by order.
    pub fn eval(&self, wo: Vec3, wi: Vec3, rng: &mut impl Draw<f32>, tally: &mut impl Tally<f32>) {
        let (wo, wi) = (self.to_stack(wo), self.to_stack(wi));
        self.layers.eval(wo, wi, rng, tally);
    }

    /// The density that stands in for the walk's, sr⁻¹.
    #[must_use]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.layers.pdf(self.to_stack(wo), self.to_stack(wi))
    }

    /// A direction of the viewer's frame in that of the stack.
    fn to_stack(&self, w: Vec3) -> Vector3<f32> {
        to_model(if self.inverted { -w } else { w })
    }
}

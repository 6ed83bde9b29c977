//! What happens at a micro-facet.

mod conductor;
mod dielectric;
mod diffuse;
mod glass;
mod refraction;

pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use glass::Glass;
pub use refraction::Refraction;

use num_traits::One;

use super::{Draw, Ndf, Real, Rgb, Vector3};

/// The side of the macroscopic surface that a walk is on. A walk's frame
/// always has its own side up: crossing a facet reflects it at the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side of +z, in which walks begin.
    Above,
    /// The side of −z, to which only dielectric facets let light through.
    Below,
}

impl Side {
    /// The other side.
    #[inline]
    pub fn other(self) -> Self {
        match self {
            Self::Above => Self::Below,
            Self::Below => Self::Above,
        }
    }

    /// The relative index of the far side, for n(below) / n(above) = `eta`.
    #[inline]
    fn eta<F: Real>(self, eta: F) -> F {
        match self {
            Self::Above => eta,
            Self::Below => eta.recip(),
        }
    }
}

/// One interaction, as a walk samples it.
#[derive(Clone, Copy, Debug)]
pub struct Bounce<F> {
    /// The unit direction in which the light goes on, in the frame of the
    /// side it came from.
    pub direction: Vector3<F>,
    /// Whether it went through the facet to the other side.
    pub crosses: bool,
    /// The share of the light that is not absorbed, per channel, in [0, 1].
    pub weight: Rgb<F>,
}

/// The value of a phase function.
#[derive(Clone, Copy, Debug)]
pub struct Phase<F> {
    /// The density of the outgoing direction, sr⁻¹; over all directions, of
    /// both reflection and transmission, it integrates to 1.
    pub density: F,
    /// The share of the light that is not absorbed, per channel, in [0, 1].
    pub weight: Rgb<F>,
}

impl<F: Real> Phase<F> {
    #[inline]
    fn none() -> Self {
        Self {
            density: F::zero(),
            weight: Rgb::black(),
        }
    }
}

/// The interaction of light with the micro-facets, which the distribution of
/// their normals turns into the phase function of the microsurface.
pub trait Facets: Copy {
    /// What it is computed in, `f32` or `f64`.
    type Scalar: Real;

    /// Whether light can come out on the other side.
    const TRANSMITS: bool;

    /// Whether [`Facets::phase`] is exact; otherwise it is an estimate that
    /// depends on the given normal.
    const CLOSED_PHASE: bool;

    /// Whether the facets are mirrors and nothing else, so that a path's
    /// directions determine its normals ([`super::Estimator::PositionFree`]).
    const MIRRORS: bool = false;

    /// Samples the light's way on at a facet with normal `m` that faces `w`,
    /// the direction to where it came from.
    fn scatter(
        &self,
        side: Side,
        w: Vector3<Self::Scalar>,
        m: Vector3<Self::Scalar>,
        rng: &mut impl Draw<Self::Scalar>,
    ) -> Bounce<Self::Scalar>;

    /// The phase function p(−w → o) for light that comes from `w`, with
    /// `sigma` = σ(w). `o` is in the frame of `side`; `crosses` picks the
    /// transmitted part. `m` is a normal sampled from the visible ones of
    /// `w`, for facets whose phase function is not closed.
    fn phase<N: Ndf<Scalar = Self::Scalar>>(
        &self,
        ndf: &N,
        at: At<Self::Scalar>,
        o: Vector3<Self::Scalar>,
        crosses: bool,
        m: Vector3<Self::Scalar>,
    ) -> Phase<Self::Scalar>;

    /// These facets seen from the other side.
    fn inverted(&self) -> Self;

    /// n(below) / n(above).
    #[inline]
    fn relative_index(&self) -> Self::Scalar {
        Self::Scalar::one()
    }

    /// The colour of what goes straight on, where the surface is none: a
    /// dielectric as dense as its surroundings.
    #[inline]
    fn invisible(&self) -> Option<Rgb<Self::Scalar>> {
        None
    }
}

/// Where light comes from, at an interaction.
#[derive(Clone, Copy, Debug)]
pub struct At<F> {
    /// The side it is on.
    pub side: Side,
    /// The unit direction to where it comes from, in that side's frame; it
    /// may point up or down.
    pub w: Vector3<F>,
    /// σ(w), which whoever moved the light has computed already.
    pub sigma: F,
}

//! Microfacet BSDFs with multiple scattering on the Smith microsurface.
//!
//! The model is Heitz, Hanika, d'Eon and Dachsbacher 2016,
//! "Multiple-Scattering Microfacet BSDFs with the Smith Model"
//! (<https://eheitzresearch.wordpress.com/240-2/>): light walks among
//! micro-facets whose heights and normals are independent, until it leaves.
//! It keeps all the energy that single scattering loses, for any roughness.
//!
//! A [`Microsurface`] is a distribution of normals ([`Ggx`], [`Beckmann`],
//! [`Quadratic`], a [`NormalTable`], or any other [`Ndf`]) and what its facets do ([`Conductor`],
//! [`Dielectric`], [`Diffuse`], or any other [`Facets`]), in `f32` or `f64`.
//! It knows nothing of a renderer. Several such surfaces over one another are
//! a stack ([`layered`]).
//!
//! # Conventions
//! - Local frame, z = the macroscopic normal. ω_i and ω_o are unit vectors
//!   that point away from the surface; ω_i is above it, ω_o below it for
//!   transmission.
//! - ω_i is where a walk begins and ω_o where it leaves, as in the paper. A
//!   path tracer, whose paths begin at the eye, passes its ω_o, towards the
//!   viewer, as ω_i, and takes the exit as its ω_i, towards the light. Then
//!   f |cosθ_o| has the cosine at the light, which is what a path's throughput
//!   multiplies by, and L/n² is carried.
//! - A BSDF value always includes the cosine, f(ω_i, ω_o) |cosθ_o|, in sr⁻¹.
//!   Transmission follows the energy: without absorption the integral over
//!   both hemispheres of ω_o is 1. So a renderer transports L/n², and
//!   f(ω_i, ω_o) n_i² = f(ω_o, ω_i) n_o².
//! - α is slope roughness, not its square root.
//!
//! # Depth in place of height
//! With C1 the distribution function of heights, the walk tracks the optical
//! depth τ = −ln C1 ≥ 0 below the top of the microsurface. In τ, collisions
//! come at a constant rate per direction, and the height distribution drops
//! out of everything but reports of heights.
//!
//! ```
//! use rand::SeedableRng;
//! use smithwalk_model::*;
//!
//! let gold = Microsurface {
//!     ndf: Ggx::isotropic(0.64_f32),
//!     facets: Conductor { fresnel: ConductorFresnel::Constant(Rgb([1.0, 0.71, 0.29])) },
//! };
//! let mut rng = Stream(rand_pcg::Pcg32::seed_from_u64(1));
//! let wi = Vector3::spherical(0.5, 0.0);
//! if let Some(exit) = gold.sample(wi, &mut rng) {
//!     assert!(exit.direction.z > 0.0 && exit.weight.max_channel() <= 1.0);
//! }
//!
//! // What single and multiple scattering send towards a direction.
//! let mut split = Split::default();
//! gold.eval(Estimator::Walk, wi, Vector3::spherical(0.8, 2.0), &mut rng, &mut split);
//! assert!(split.total().max_channel() >= 0.0);
//! ```

mod draw;
mod facets;
mod film;
mod first_order;
pub mod fresnel;
pub mod heights;
mod lanes;
pub mod layered;
mod ndf;
mod position_free;
mod proxy;
mod real;
mod tally;
mod two_walk;
mod vector;
mod walk;

#[cfg(test)]
mod tests;

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

// Their traits and types are in the signatures of this crate.
pub use {num_traits, rand, wide};

pub use draw::{Draw, Stream};
pub use facets::{
    At, Bounce, Conductor, Dielectric, Diffuse, Facets, Glass, Phase, Refraction, Side,
};
pub use film::Film;
pub use fresnel::ConductorFresnel;
pub use lanes::{BeckmannLanes, Directions, GgxLanes, LANES, NdfInLanes, NdfLanes};
pub use ndf::*;
pub use real::{Real, ln_beta};
pub use tally::{PerOrder, Split, Tally, Total};
pub use vector::{Rgb, Vector3};

/// A rough surface: the distribution of its micro-normals, and what happens
/// at one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microsurface<N, I> {
    /// Distribution of micro-normals.
    pub ndf: N,
    /// Interaction at a facet.
    pub facets: I,
}

/// How light left the microsurface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exit<F> {
    /// Unit direction, away from the surface; z < 0 is transmission.
    pub direction: Vector3<F>,
    /// f |cosθ_o| over the density of the walk: the share that was not
    /// absorbed, per channel. At most 1, unless roulette has kept alive a
    /// walk of thousands of orders.
    pub weight: Rgb<F>,
    /// The number of facets met, ≥ 1.
    pub order: u32,
}

/// The unbiased estimators of f(ω_i, ω_o) |cosθ_o|, all orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Estimator {
    /// One walk from ω_i, connected to ω_o at every facet (Heitz et al. 2016,
    /// § 4.3). Unbounded: where the paths that matter begin with a rare facet,
    /// the standard error of its mean says little.
    Walk,
    /// The first order in closed form; higher ones from a walk on either
    /// side, combined by the balance heuristic. Bounded.
    TwoWalk,
    /// The two walks with the depth integrated out, the best for conductors.
    /// Other facets, and α above about 5, where orders are too many for it,
    /// fall back to [`Estimator::TwoWalk`].
    PositionFree,
}

/// Λ at tanθ = 2 from which [`Estimator::PositionFree`] is not worth its time,
/// which goes with the square of the order.
const STEEP: f64 = 5.0;

/// Cosines up to this are grazing: nothing is scattered. Rates σ/cosθ above it
/// are finite in single precision too.
const GRAZING: f64 = 1e-30;

impl<F, N, I> Microsurface<N, I>
where
    F: Real,
    N: Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    /// Estimates f(ω_i, ω_o) |cosθ_o| (sr⁻¹) by `estimator`, giving each
    /// order's share to `tally`. Nothing is given where the value is 0:
    /// outside ω_i,z > 0, or below an opaque surface.
    pub fn eval(
        &self,
        estimator: Estimator,
        wi: Vector3<F>,
        wo: Vector3<F>,
        rng: &mut impl Draw<F>,
        tally: &mut impl Tally<F>,
    ) {
        if !self.links(wi, wo) {
            return;
        }
        match estimator {
            Estimator::Walk => self.eval_walk(wi, wo, rng, tally),
            Estimator::PositionFree if self.suits_position_free() => {
                self.eval_position_free(wi, wo, rng, tally)
            }
            Estimator::TwoWalk | Estimator::PositionFree => self.eval_two_walk(wi, wo, rng, tally),
        }
    }

    /// Whether [`Estimator::PositionFree`] is itself and not a fall-back.
    #[inline]
    pub fn suits_position_free(&self) -> bool {
        I::MIRRORS && self.steep_lambda() < F::of(STEEP)
    }

    /// Λ at tanθ = 2, between the axes: a one-number summary of roughness.
    #[inline]
    fn steep_lambda(&self) -> F {
        let (side, up) = (F::of(0.4f64.sqrt()), F::of(0.2f64.sqrt()));
        self.ndf.lambda(Vector3::new(side, side, up))
    }

    /// Whether light can go from `wi` to `wo` other than straight on.
    #[inline]
    fn links(&self, wi: Vector3<F>, wo: Vector3<F>) -> bool {
        let grazing = F::of(GRAZING);
        let leaves = wo.z > grazing || (I::TRANSMITS && wo.z < -grazing);
        enters(wi) && leaves && wo.is_finite() && self.facets.invisible().is_none()
    }
}

/// Whether light can come in from `wi`.
#[inline]
fn enters<F: Real>(wi: Vector3<F>) -> bool {
    wi.z > F::of(GRAZING) && wi.is_finite()
}

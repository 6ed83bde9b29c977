//! Surfaces made of layers: rough or smooth interfaces, absorbing slabs
//! between them, and a base.
//!
//! Light walks among the interfaces as it walks among the facets of one:
//! horizontally they are endless, so that its direction, its slab and its
//! weight are all there is to know (Guo, Hašan and Zhao 2018, "Position-Free
//! Monte Carlo Simulation for Arbitrary Layered BSDFs"). At an interface it
//! takes one microsurface walk, all orders, from the side that it comes from;
//! through a slab it is weighted with e^{−σt/|cosθ|}.
//!
//! A [`Layered`] surface keeps the conventions of the crate: f |cosθ_o| in
//! sr⁻¹, lossless stacks integrate to 1, and
//! f(ω_i, ω_o) n_i² = f(ω_o, ω_i) n_o². Inside a stack L/n² needs no factors.
//!
//! ```
//! use rand::SeedableRng;
//! use smithwalk_model::layered::*;
//! use smithwalk_model::*;
//!
//! let plastic = Layered::new(
//!     &[Interface::new(1.5_f32, Finish::Ggx(Ggx::isotropic(0.1)))],
//!     Base::Diffuse { finish: Finish::Smooth, albedo: Rgb([0.8, 0.1, 0.1]) },
//! )
//! .expect("a valid stack");
//! let mut rng = Stream(rand_pcg::Pcg32::seed_from_u64(1));
//! let wi = Vector3::spherical(0.5, 0.0);
//! let mut split = Split::default();
//! // One evaluation may miss the base; many do not.
//! for _ in 0..64 {
//!     plastic.eval(wi, Vector3::spherical(0.8, 2.0), &mut rng, &mut split);
//! }
//! assert!(split.total().0[0] > split.total().0[1]);
//! ```

mod build;
mod error;
mod eval;
pub(crate) mod proxy;
mod sample;
mod surface;
mod trail;

pub use build::{Base, Finish, Interface};
pub use error::{LayeredError, Quantity};
pub use sample::LayeredExit;

use crate::{GRAZING, Real, Rgb, Vector3};
use smallvec::SmallVec;
use surface::Surface;

/// A stack of interfaces over a base, or open below.
///
/// Light comes from above (ω_i,z > 0), or from below if the stack is open.
#[derive(Clone, Debug, PartialEq)]
pub struct Layered<F: Real> {
    /// The interfaces from the top, then the base unless it is open.
    levels: Vec<Level<F>>,
    /// The medium above each level, then what is below an open stack.
    media: Vec<Medium<F>>,
}

/// What lies between two slabs, or below the last one.
#[derive(Clone, Debug, PartialEq)]
struct Level<F: Real> {
    /// The surfaces of a mix, each with the share of it and of those before it.
    surfaces: SmallVec<[(F, Surface<F>); 1]>,
}

/// A slab, or the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Medium<F> {
    /// Absolute index of refraction.
    ior: F,
    /// Absorption times thickness, per channel.
    depth: Rgb<F>,
}

impl<F: Real> Medium<F> {
    /// The share of light that crosses it along the unit vector `w`.
    #[inline]
    fn transmittance(&self, w: Vector3<F>) -> Rgb<F> {
        self.depth.map(|depth| {
            if depth > F::zero() {
                (-depth / w.z.abs()).exp()
            } else {
                F::one()
            }
        })
    }
}

impl<F: Real> Level<F> {
    /// The number of the surface that `u`, uniform in [0, 1), picks by the shares.
    #[inline]
    fn choose(&self, u: F) -> usize {
        let last = self.surfaces.len() - 1;
        let picked = self.surfaces.iter().position(|&(share, _)| u < share);
        picked.unwrap_or(last)
    }

    /// The n² of the media on both sides of level number `level`, of which an
    /// opaque base has one.
    #[inline]
    fn squares(level: usize, media: &[Medium<F>]) -> [F; 2] {
        let square = |medium: &Medium<F>| medium.ior * medium.ior;
        let above = square(&media[level]);
        [above, media.get(level + 1).map_or(above, square)]
    }
}

/// Where light goes from a level.
enum Next {
    /// To this level.
    Level(usize),
    /// Out of the stack.
    Out,
    /// Nowhere: it goes on along the surface.
    Lost,
}

impl<F: Real> Layered<F> {
    /// Whether light that comes in along `w` can meet the stack, and the level
    /// that it meets first.
    #[inline]
    fn entry(&self, w: Vector3<F>) -> Option<usize> {
        let grazing = F::of(GRAZING);
        if !w.is_finite() {
            None
        } else if w.z > grazing {
            Some(0)
        } else if w.z < -grazing && self.is_open() {
            Some(self.levels.len() - 1)
        } else {
            None
        }
    }

    /// Whether light gets through the stack: it has no opaque base.
    #[must_use]
    #[inline]
    pub fn is_open(&self) -> bool {
        self.media.len() > self.levels.len()
    }

    /// The index of refraction outside, on the side that `w` points to.
    #[must_use]
    #[inline]
    pub fn outside(&self, w: Vector3<F>) -> F {
        let level = if w.z < F::zero() {
            self.levels.len() - 1
        } else {
            0
        };
        self.medium(level, w).ior
    }

    /// Whether all light leaves in single directions: every surface is smooth,
    /// and evaluation gives nothing.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        let mut surfaces = self.levels.iter().flat_map(|level| &level.surfaces);
        surfaces.all(|(_, surface)| surface.is_delta())
    }

    /// Where light goes that leaves `level` along `d`.
    #[inline]
    fn next(&self, level: usize, d: Vector3<F>) -> Next {
        let grazing = F::of(GRAZING);
        if d.z > grazing {
            level.checked_sub(1).map_or(Next::Out, Next::Level)
        } else if d.z < -grazing {
            if level + 1 < self.levels.len() {
                Next::Level(level + 1)
            } else if self.is_open() {
                Next::Out
            } else {
                Next::Lost
            }
        } else {
            Next::Lost
        }
    }

    /// The medium on the side of `level` that `w` points to.
    #[inline]
    fn medium(&self, level: usize, w: Vector3<F>) -> &Medium<F> {
        let below = level + usize::from(w.z < F::zero());
        &self.media[below.min(self.media.len() - 1)]
    }
}

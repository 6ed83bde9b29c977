//! One walk through the stack.

use super::{Layered, Next};
use crate::walk::Roulette;
use crate::{Draw, Real, Rgb, Vector3};

/// How light left a stack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayeredExit<F> {
    /// Unit direction, away from the stack; on the other side than ω_i it was
    /// let through.
    pub direction: Vector3<F>,
    /// f |cosθ_o| over the density of the walk: the share that was not
    /// absorbed, per channel. At most 1, unless roulette has kept it alive.
    pub weight: Rgb<F>,
    /// 1 if the light met one facet at every surface, and 1 more for every
    /// further facet.
    pub order: u32,
    /// The number of times that it met a surface of the stack, ≥ 1.
    pub surfaces: u32,
    /// Whether all of those were smooth: then the direction is one of few, and
    /// [`Layered::eval`] does not know of it.
    pub delta: bool,
}

impl<F: Real> Layered<F> {
    /// One walk that enters from `wi` (unit): where it leaves, with density
    /// ∝ f |cosθ_o| if nothing is absorbed. `None` if it was absorbed, or if
    /// nothing can come from `wi`.
    pub fn sample(&self, wi: Vector3<F>, rng: &mut impl Draw<F>) -> Option<LayeredExit<F>> {
        let mut level = self.entry(wi)?;
        let mut w = wi;
        let mut exit = LayeredExit {
            direction: wi,
            weight: Rgb::white(),
            order: 1,
            surfaces: 0,
            delta: true,
        };
        loop {
            let surface = self.levels[level].pick(rng).1;
            let left = surface.scatter(w, rng)?;
            exit.weight *= left.weight;
            exit.order += left.order - 1;
            exit.surfaces += 1;
            exit.delta &= surface.is_delta();
            exit.direction = left.direction;
            match self.next(level, left.direction) {
                Next::Out => break,
                Next::Lost => return None,
                Next::Level(next) => {
                    let slab = self.medium(level, left.direction);
                    exit.weight *= slab.transmittance(left.direction);
                    level = next;
                }
            }
            w = -left.direction;
            let facets = exit.order - 1 + exit.surfaces;
            if !Roulette::OF_LIGHT.survives(&mut exit.weight, F::one(), facets, rng) {
                return None;
            }
        }
        (exit.weight.max_channel() > F::zero()).then_some(exit)
    }
}

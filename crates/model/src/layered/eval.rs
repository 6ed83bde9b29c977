//! Evaluation: a walk from either end, connected wherever they meet.

use super::trail::Trail;
use super::{Layered, Level};
use crate::{Draw, Real, Tally, Vector3};

/// The walks of one evaluation, which it is for them to be connected.
struct Ends<'a, F> {
    /// The walk whose stops are connected to the other's arrivals.
    stops: &'a Trail<F>,
    arrivals: &'a Trail<F>,
    /// Whether the former is the one from ω_o.
    mirrored: bool,
    /// n_o² |cosθ_o|, which turns a conductance into f |cosθ_o|.
    scale: F,
}

impl<F: Real> Layered<F> {
    /// Estimates f(ω_i, ω_o) |cosθ_o| (sr⁻¹), giving each order's share to
    /// `tally`: order 1 has met one facet at every surface, higher orders that
    /// many more. What smooth surfaces alone send into a single direction is
    /// not part of it. Nothing is given where the value is 0.
    ///
    /// Unbiased: wherever the walk from ω_i stands at a surface, it is
    /// connected to the directions from which that of ω_o comes to the same
    /// surface, and the other way round where that is another technique. The
    /// first order of the first surface has no noise.
    pub fn eval(
        &self,
        wi: Vector3<F>,
        wo: Vector3<F>,
        rng: &mut impl Draw<F>,
        tally: &mut impl Tally<F>,
    ) {
        let (Some(first), Some(last)) = (self.entry(wi), self.entry(wo)) else {
            return;
        };
        if self.is_delta() {
            return;
        }
        let forth = self.trace(wi, first, rng);
        rng.next_walk();
        let back = self.trace(wo, last, rng);
        let ior = self.outside(wo);
        let scale = ior * ior * wo.z.abs();
        let ends = Ends {
            stops: &forth,
            arrivals: &back,
            mirrored: false,
            scale,
        };
        self.connect(&ends, tally);
        let ends = Ends {
            stops: &back,
            arrivals: &forth,
            mirrored: true,
            scale,
        };
        self.connect(&ends, tally);
    }

    /// Every stop of one walk with every arrival of the other at its level.
    fn connect(&self, ends: &Ends<F>, tally: &mut impl Tally<F>) {
        for stop in &ends.stops.stops {
            let come = &ends.stops.arrivals[stop.arrival];
            let level = &self.levels[come.level];
            let surface = &level.surfaces[stop.surface].1;
            let squares = Level::squares(come.level, &self.media);
            for met in &ends.arrivals.arrivals {
                if met.level != come.level {
                    continue;
                }
                let Some(joint) = surface.join(stop, met.w, squares, ends.mirrored) else {
                    break;
                };
                let resistance = come.resistance + joint.resistance + met.resistance;
                if resistance > F::zero() && resistance < F::infinity() {
                    tally.add(
                        come.extra + stop.order + met.extra,
                        stop.weight * joint.weight * met.weight * (ends.scale / resistance),
                    );
                }
            }
        }
    }
}

//! Walks as evaluation records them, to connect one to another.
//!
//! # Resistance
//! A path from ω_i to ω_o passes surfaces with the BSDF values f_1 … f_n. Two
//! walks find it together by meeting at any of them, and each way of meeting
//! is a technique of its own. Walks follow the light, and reciprocity says what
//! the mirrored walk would have done; so the technique that connects at
//! surface e, whose walks contribute everything but f_e, gives the estimate
//! |cosθ_o| n_o² / R_e with R_e = n²/f_e, n the index on the side where light
//! leaves that surface: it is the same for either direction. The balance
//! heuristic (Veach and Guibas 1995) over all the techniques then gives
//!
//!   |cosθ_o| n_o² / Σ R_e
//!
//! whichever of them found the path: the resistances of its surfaces in
//! series. A smooth surface has none, as its f is infinite, and a sharp one
//! hardly any; no estimate exceeds what the dullest surface would give.
//!
//! An interface where light met k ≥ 2 facets is found by connecting to the
//! last of them, or by the mirrored walk to the first: it has two resistances,
//! of the phase functions there in place of f. So has one diffuse facet, whose
//! normal is part of the path. One mirror or dielectric facet has the closed
//! form of the first order, and one resistance.
//!
//! Colours and absorption are the same in both directions, and stay out of the
//! weights.

use super::surface::{Surface, bounce_smooth, each_rough, let_through, localized, side_of};
use super::{Layered, Level, Next};
use crate::walk::{Ray, Roulette, depth_from_other_side};
use crate::{At, Draw, Facets, Microsurface, Ndf, Phase, Real, Rgb, Vector3};
use smallvec::SmallVec;

/// Light on arrival at a level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival<F> {
    /// The number of the level.
    pub level: usize,
    /// The direction to where the light comes from, in the stack's frame.
    pub w: Vector3<F>,
    /// What is left of it.
    pub weight: Rgb<F>,
    /// The facets met beyond the first one of each surface.
    pub extra: u32,
    /// The resistance of the surfaces that it has passed.
    pub resistance: F,
}

/// Light at a facet, before it is scattered there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop<F> {
    /// The arrival that led here, by its number in the trail.
    pub arrival: usize,
    /// Which of the level's surfaces this is.
    pub surface: usize,
    /// The number of the facet since the arrival, from 1.
    pub order: u32,
    /// Where the light comes from.
    pub at: At<F>,
    /// Optical depth below the top of the side that it is on.
    pub depth: F,
    /// The facet's normal.
    pub m: Vector3<F>,
    /// What is left of the light.
    pub weight: Rgb<F>,
    /// The resistance of the mirrored connection, to the first facet; from the
    /// second on.
    pub mirrored: F,
}

/// All arrivals and stops of a walk.
#[derive(Debug)]
pub(super) struct Trail<F> {
    pub arrivals: SmallVec<[Arrival<F>; 8]>,
    pub stops: SmallVec<[Stop<F>; 8]>,
}

/// Light that leaves a surface.
struct Departure<F> {
    /// In the stack's frame.
    direction: Vector3<F>,
    weight: Rgb<F>,
    /// Facets met.
    order: u32,
    resistance: F,
}

/// A surface that joins two walks.
pub(super) struct Joint<F> {
    /// The share of the light that it does not absorb.
    pub weight: Rgb<F>,
    /// Its resistance, by all techniques.
    pub resistance: F,
}

/// The resistance where light leaves with the cosine `cos` into a medium whose
/// n² is `square`, and f |cosθ| is `value`.
#[inline]
fn resistance<F: Real>(square: F, cos: F, value: F) -> F {
    if value > F::zero() {
        square * cos.abs() / value
    } else {
        F::infinity()
    }
}

/// n² on the side of a surface that `w`, in the stack's frame, points to.
#[inline]
fn square_at<F: Real>(squares: [F; 2], w: Vector3<F>) -> F {
    squares[usize::from(w.z < F::zero())]
}

impl<F: Real> Level<F> {
    /// One of the surfaces, and its number.
    #[inline]
    pub(super) fn pick(&self, rng: &mut impl Draw<F>) -> (usize, &Surface<F>) {
        let number = if self.surfaces.len() > 1 {
            self.choose(rng.draw())
        } else {
            0
        };
        (number, &self.surfaces[number].1)
    }
}

impl<F: Real> Layered<F> {
    /// A walk that enters from `w` at `level`.
    pub(super) fn trace(&self, w: Vector3<F>, level: usize, rng: &mut impl Draw<F>) -> Trail<F> {
        let mut trail = Trail {
            arrivals: SmallVec::new(),
            stops: SmallVec::new(),
        };
        let mut arrival = Arrival {
            level,
            w,
            weight: Rgb::white(),
            extra: 0,
            resistance: F::zero(),
        };
        loop {
            trail.arrivals.push(arrival);
            let squares = Level::squares(arrival.level, &self.media);
            let (number, surface) = self.levels[arrival.level].pick(rng);
            let Some(left) = surface.pass(number, squares, &mut trail, rng) else {
                break;
            };
            let Next::Level(next) = self.next(arrival.level, left.direction) else {
                break;
            };
            let slab = self.medium(arrival.level, left.direction);
            arrival = Arrival {
                level: next,
                w: -left.direction,
                weight: left.weight * slab.transmittance(left.direction),
                extra: arrival.extra + left.order - 1,
                resistance: arrival.resistance + left.resistance,
            };
            let met = trail.arrivals.len() as u32 + arrival.extra;
            if !Roulette::OF_LIGHT.survives(&mut arrival.weight, F::one(), met, rng) {
                break;
            }
        }
        trail
    }
}

impl<F: Real> Surface<F> {
    /// Takes the last arrival of `trail` through this surface, number `number`
    /// of its level. `None` if the light is absorbed.
    #[inline]
    fn pass(
        &self,
        number: usize,
        squares: [F; 2],
        trail: &mut Trail<F>,
        rng: &mut impl Draw<F>,
    ) -> Option<Departure<F>> {
        let arrival = *trail.arrivals.last()?;
        let smooth = |direction, share| Departure {
            direction,
            weight: arrival.weight * share,
            order: 1,
            resistance: F::zero(),
        };
        each_rough!(self, rough => rough.wander(number, squares, trail, rng),
            Surface::Interface(facets) if trail.arrivals.len() == 1 => {
                // What it reflects here leaves, and adds nothing: all goes through.
                let side = side_of(arrival.w);
                let (share, direction) = let_through(facets.eta, side, localized(side, arrival.w))?;
                Some(smooth(localized(side, direction), Rgb::splat(share)))
            }
            Surface::Colored(facets) if trail.arrivals.len() == 1 => {
                let side = side_of(arrival.w);
                let w = localized(side, arrival.w);
                let (share, direction) = let_through(facets.eta, side, w)?;
                let color = facets.transmitted(side, w.z);
                Some(smooth(localized(side, direction), color * share))
            }
            Surface::Interface(facets) => {
                let bounce = bounce_smooth(facets, arrival.w, rng);
                Some(smooth(bounce.direction, bounce.weight))
            }
            Surface::Colored(facets) => {
                let bounce = bounce_smooth(facets, arrival.w, rng);
                Some(smooth(bounce.direction, bounce.weight))
            }
            Surface::Mirror(facets) => {
                let bounce = bounce_smooth(facets, arrival.w, rng);
                Some(smooth(bounce.direction, bounce.weight))
            }
            Surface::Lambert(facets) => {
                let side = side_of(arrival.w);
                let w = localized(side, arrival.w);
                trail.stops.push(Stop {
                    arrival: trail.arrivals.len() - 1,
                    surface: number,
                    order: 1,
                    at: At { side, w, sigma: w.z },
                    depth: F::zero(),
                    m: w,
                    weight: arrival.weight,
                    mirrored: F::zero(),
                });
                let bounce = bounce_smooth(facets, arrival.w, rng);
                Some(Departure {
                    resistance: squares[0] * F::PI(),
                    ..smooth(bounce.direction, bounce.weight)
                })
            }
        )
    }

    /// Connects the light at `stop` with light that comes to the same level
    /// from `o`. `mirrored` says that the walks have swapped their parts.
    #[inline]
    pub(super) fn join(
        &self,
        stop: &Stop<F>,
        o: Vector3<F>,
        squares: [F; 2],
        mirrored: bool,
    ) -> Option<Joint<F>> {
        each_rough!(self, rough => rough.join(stop, o, squares, mirrored),
            Surface::Lambert(facets) => (!mirrored).then_some(Joint {
                weight: facets.albedo,
                resistance: squares[0] * F::PI(),
            }),
            Surface::Interface(_) | Surface::Colored(_) | Surface::Mirror(_) => None,
        )
    }
}

impl<F, N, I> Microsurface<N, I>
where
    F: Real,
    N: Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    /// A walk among the facets that leaves its stops in `trail`.
    fn wander(
        &self,
        number: usize,
        squares: [F; 2],
        trail: &mut Trail<F>,
        rng: &mut impl Draw<F>,
    ) -> Option<Departure<F>> {
        let arrival = *trail.arrivals.last()?;
        let mut ray = Ray::arriving(arrival.w);
        let from = -ray.direction;
        let mut at = ray.advance(&self.ndf, rng.draw())?;
        let mut weight = arrival.weight;
        let mut mirrored = F::zero();
        let mut order = 0;
        loop {
            let m = self.ndf.sample_visible(at.w, [rng.draw(), rng.draw()]);
            order += 1;
            let depth = ray.depth;
            trail.stops.push(Stop {
                arrival: trail.arrivals.len() - 1,
                surface: number,
                order,
                at,
                depth,
                m,
                weight,
                mirrored,
            });
            let bounce = self.facets.scatter(at.side, at.w, m, rng);
            weight *= bounce.weight;
            ray.follow(&bounce);
            let met = trail.arrivals.len() as u32 + arrival.extra + order - 1;
            if !Roulette::OF_LIGHT.survives(&mut weight, F::one(), met, rng) {
                return None;
            }
            let Some(next) = ray.advance(&self.ndf, rng.draw()) else {
                let stop = trail.stops.last()?;
                let joint = self.joint(stop, bounce.direction, bounce.crosses, squares);
                return Some(Departure {
                    direction: ray.localized(ray.direction),
                    weight,
                    order,
                    resistance: joint.resistance,
                });
            };
            if order == 1 {
                // What the mirrored walk would connect to.
                let back = At {
                    side: ray.side,
                    w: ray.direction,
                    sigma: self.ndf.projected_area(ray.direction),
                };
                let to = localized(ray.side, arrival.w);
                let phase = self.facets.phase(&self.ndf, back, to, bounce.crosses, m);
                let escape = (-self.ndf.lambda(from) * depth).exp();
                let square = square_at(squares, arrival.w);
                mirrored = resistance(square, from.z, phase.density * escape);
            }
            at = next;
        }
    }

    /// See [`Surface::join`].
    #[inline]
    fn join(
        &self,
        stop: &Stop<F>,
        o: Vector3<F>,
        squares: [F; 2],
        mirrored: bool,
    ) -> Option<Joint<F>> {
        if mirrored && stop.order == 1 && I::CLOSED_PHASE {
            return None;
        }
        let o = localized(stop.at.side, o);
        Some(self.joint(stop, o, o.z < F::zero(), squares))
    }

    /// The way from `stop` out along `o`, in the frame of its side.
    #[inline]
    fn joint(&self, stop: &Stop<F>, o: Vector3<F>, crosses: bool, squares: [F; 2]) -> Joint<F> {
        let Stop { at, depth, m, .. } = *stop;
        let Phase { density, weight } = self.facets.phase(&self.ndf, at, o, crosses, m);
        let leaving = square_at(squares, localized(at.side, o));
        if stop.order == 1 {
            let forth = density * self.escape(at, o);
            let mut sum = resistance(leaving, o.z, forth);
            if !I::CLOSED_PHASE {
                let back = At {
                    side: at.side,
                    w: o,
                    sigma: self.ndf.projected_area(o),
                };
                let phase = self.facets.phase(&self.ndf, back, at.w, crosses, m);
                let coming = square_at(squares, localized(at.side, at.w));
                sum += resistance(coming, at.w.z, phase.density * self.escape(back, at.w));
            }
            return Joint {
                weight,
                resistance: sum,
            };
        }
        let (up, depth) = if crosses {
            (-o, depth_from_other_side(depth))
        } else {
            (o, depth)
        };
        let forth = density * (-self.ndf.lambda(up) * depth).exp();
        Joint {
            weight,
            resistance: resistance(leaving, o.z, forth) + stop.mirrored,
        }
    }
}

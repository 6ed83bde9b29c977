//! The position-free estimator.

use smallvec::SmallVec;
use wide::{CmpGe, CmpGt, CmpLt, f32x8};

use super::math::{Directions, reflectance};
use super::ndf::phase;
use super::ndf::{NdfInLanes, NdfLanes};
use super::rotated::Rotated;
use super::{LANES, survivors};
use crate::position_free::{COMMON, NEVER, RATIOS, SLACK};
use crate::walk::Roulette;
use crate::{Conductor, ConductorFresnel, Draw, Microsurface, Rgb, Split, Tally, Vector3};

/// One stage of a [`Depth`] in each lane.
#[derive(Clone, Copy)]
struct Stage {
    start: f32x8,
    /// The mean of the stage, 1/rate; none at all is 0.
    mean: f32x8,
}

/// The distribution of the depth of a facet in each lane, as in the scalar
/// estimator. Lanes that go up while others go down get a stage of length 0.
struct Depth {
    stages: SmallVec<[Stage; COMMON]>,
}

impl Depth {
    fn enter(&mut self, mean: f32x8) {
        self.stages.clear();
        self.stages.push(Stage {
            start: f32x8::ONE,
            mean,
        });
    }

    #[inline]
    fn descend(&mut self, mean: f32x8) {
        self.stages.push(Stage {
            start: f32x8::ZERO,
            mean,
        });
    }

    /// Goes up to the next collision at `rate` in the lanes of `up`; returns the
    /// probability that there is one, and 1 in the others.
    #[inline]
    fn climb(&mut self, up: f32x8, rate: f32x8) -> f32x8 {
        // Nothing moves at a rate of 0 but by the mask.
        let rate = up.blend(rate, f32x8::ZERO);
        let mut passing = f32x8::ZERO;
        let mut collided = f32x8::ZERO;
        for stage in &mut self.stages {
            let here = stage.start + passing;
            let steps = rate * stage.mean;
            passing = here / (f32x8::ONE + steps);
            let stays = passing * steps;
            collided += stays;
            stage.start = up.blend(stays, stage.start);
        }
        let norm = f32x8::ONE / up.blend(collided, f32x8::ONE);
        for stage in &mut self.stages {
            stage.start *= norm;
        }
        up.blend(collided, f32x8::ONE)
    }

    /// The chance to escape at the rate `lambda`.
    #[inline]
    fn escape(&self, lambda: f32x8) -> f32x8 {
        self.stages.iter().fold(f32x8::ZERO, |passing, stage| {
            (passing + stage.start) / (f32x8::ONE + lambda * stage.mean)
        })
    }
}

/// The directions in which paths leave the surface, at either end.
struct End {
    w: Directions,
    /// σ(w)
    sigma: f32x8,
    /// σ(−w)
    below: f32x8,
}

impl End {
    #[inline]
    fn new(ndf: &impl NdfLanes, w: Directions) -> Self {
        let [sigma, below] = ndf.projected_areas(w);
        Self { w, sigma, below }
    }
}

/// What half a pair of walks needs to know.
struct Walks<'a, N, T> {
    ndf: N,
    fresnel: &'a ConductorFresnel<f32>,
    depth: Depth,
    /// Takes what each order ≥ 2 adds.
    add: T,
}

impl<N: NdfInLanes> Microsurface<N, Conductor<f32>> {
    /// f(ω_i, ω_o) |cosθ_o| (sr⁻¹) by [`crate::Estimator::PositionFree`], for
    /// each of `wo`. Orders above the first are evaluated with the `chance` of
    /// their lane, and weighted accordingly.
    ///
    /// It is for surfaces that [suit](Microsurface::suits_position_free) it: there is
    /// no other estimator to fall back on.
    pub fn eval_lanes(
        &self,
        wi: Vector3<f32>,
        wo: &[Vector3<f32>; LANES],
        chance: [f32; LANES],
        rng: &mut impl Draw<f32x8>,
    ) -> [Split<f32>; LANES] {
        let linked = wo.map(|wo| if self.links(wi, wo) { 1.0 } else { 0.0 });
        let linked = f32x8::from(linked).cmp_gt(f32x8::ZERO);
        let ndf = self.ndf.in_lanes();
        let ends = [Directions::splat(wi), Directions::of(wo)].map(|w| End::new(&ndf, w));
        let [from, to] = &ends;
        let (density, length) = phase(&ndf, from.w, from.sigma, to.w);
        let tint = reflectance(&self.facets.fresnel, f32x8::HALF * length);
        // As in super::super::first_order::escape_reflected.
        let entry = from.sigma * to.w.z;
        let first = density * entry / (entry + from.w.z * to.below);
        let single = tint.map(|tint| linked.blend(tint * first, f32x8::ZERO));

        let chance = f32x8::from(chance);
        let mut live = linked;
        if chance.cmp_lt(f32x8::ONE).any() {
            live &= rng.draw().cmp_lt(chance);
        }
        let mut multiple = [f32x8::ZERO; 3];
        if live.any() {
            self.add_multiple(ndf, &ends, live, rng, |_, value| {
                for (sum, value) in multiple.iter_mut().zip(value) {
                    *sum += value;
                }
            });
        }
        let single = single.map(|channel| channel.to_array());
        let multiple = multiple.map(|sum| (sum / chance).to_array());
        std::array::from_fn(|lane| Split {
            single: Rgb(single.map(|channel| channel[lane])),
            multiple: Rgb(multiple.map(|channel| channel[lane])),
        })
    }

    /// Orders above the first of f(ω_i, ω_o) |cosθ_o| (sr⁻¹), the mean of eight
    /// evaluations. As [`Self::eval_lanes`], it is for surfaces that suit it.
    pub fn eval_multiple_in_lanes(
        &self,
        wi: Vector3<f32>,
        wo: Vector3<f32>,
        rng: &mut impl Draw<f32>,
        tally: &mut impl Tally<f32>,
    ) {
        if !self.links(wi, wo) {
            return;
        }
        let ndf = self.ndf.in_lanes();
        let ends = [wi, wo].map(|w| End::new(&ndf, Directions::splat(w)));
        let all = f32x8::ZERO.cmp_ge(f32x8::ZERO);
        self.add_multiple(ndf, &ends, all, &mut Rotated::new(rng), |order, value| {
            let mean = value.map(|channel| channel.reduce_add() * (1.0 / LANES as f32));
            tally.add(order, Rgb(mean));
        });
    }

    /// Gives what orders ≥ 2 add in the lanes of `live` to `add`, order by order.
    #[inline]
    fn add_multiple(
        &self,
        ndf: N::Lanes,
        [from, to]: &[End; 2],
        live: f32x8,
        rng: &mut impl Draw<f32x8>,
        add: impl FnMut(u32, [f32x8; 3]),
    ) {
        let mut walks = Walks {
            ndf,
            fresnel: &self.facets.fresnel,
            depth: Depth {
                stages: SmallVec::new(),
            },
            add,
        };
        rng.next_walk();
        walks.add_half(from, to, live, f32x8::ONE, rng);
        rng.next_walk();
        walks.add_half(to, from, live, to.w.z / from.w.z, rng);
    }
}

impl<N: NdfLanes, T: FnMut(u32, [f32x8; 3])> Walks<'_, N, T> {
    /// The part of orders ≥ 2 that walks from `from` find in the lanes of `live`,
    /// times `scale`.
    #[inline]
    fn add_half(
        &mut self,
        from: &End,
        to: &End,
        mut live: f32x8,
        scale: f32x8,
        rng: &mut impl Draw<f32x8>,
    ) {
        let (zero, one) = (f32x8::ZERO, f32x8::ONE);
        let lambda = to.below / to.w.z;
        let mut w = from.w;
        let mut sigma = from.sigma;
        self.depth.enter(from.w.z / sigma);
        let mut weight = [scale; 3];
        let mut order = 1;
        let mut ratio = zero;
        loop {
            // Play before the dear part, for all that the next facet may absorb.
            live &= survivors(Roulette::OF_CHANCE, &mut weight, scale, order, rng);
            if live.none() {
                return;
            }
            // Pick the next direction.
            let m = self.ndf.sample_visible(w, [rng.draw(), rng.draw()]);
            let (d, cos) = w.mirrored(m);
            for (weight, tint) in weight.iter_mut().zip(reflectance(self.fresnel, cos)) {
                *weight *= tint;
            }
            let [forth, back] = self.ndf.projected_areas(d);
            ratio = bounded(if order == 1 {
                sigma / self.ndf.density(m)
            } else {
                ratio * (sigma / forth)
            });
            // Move the depth to the next facet.
            w = d.reversed();
            sigma = back;
            let rate = sigma / d.z.abs();
            let moves = rate.is_finite();
            let down = d.z.cmp_lt(zero) & moves;
            let up = d.z.cmp_ge(zero) & moves;
            if (down & live).any() {
                self.depth.descend(down.blend(one / rate, zero));
            }
            if (up & live).any() {
                let chance = self.depth.climb(up, rate);
                live &= chance.cmp_ge(f32x8::from(NEVER as f32));
                weight = weight.map(|weight| weight * chance);
                if live.none() {
                    return;
                }
            }
            order += 1;
            // Connect to the far end.
            let (density, length) = phase(&self.ndf, w, sigma, to.w);
            let none = unseen(d, to.w) | !density.is_finite();
            let density = none.blend(zero, density);
            let tint = reflectance(self.fresnel, f32x8::HALF * length);
            let other = ratio * (f32x8::from(4.0) * sigma * density / to.sigma);
            let value = density * self.depth.escape(lambda) / (one + other);
            let seen = [0, 1, 2].map(|c| live.blend(weight[c] * tint[c] * value, zero));
            (self.add)(order, seen);
        }
    }
}

/// Whether a half vector is rounding alone, as for the scalar estimator.
#[inline]
fn unseen(d: Directions, wo: Directions) -> f32x8 {
    let h = wo.plus(d.reversed());
    let rise = h.z * d.z;
    let across = (h.x * h.x + h.y * h.y) * (d.x * d.x + d.y * d.y);
    let slack = f32x8::from((SLACK * SLACK) as f32);
    d.z.cmp_gt(f32x8::ZERO) & (rise * rise).cmp_gt(slack * across)
}

/// Keeps a product of many factors away from 0 and ∞, as the scalar estimator does.
#[inline]
fn bounded(x: f32x8) -> f32x8 {
    x.max(f32x8::from(RATIOS[0] as f32))
        .min(f32x8::from(RATIOS[1] as f32))
}

//! Estimator 3: the two walks in directions alone, the depth integrated out.
//!
//! For mirrors, the phase function does not depend on depth, and the depth
//! enters by exponentials only. Its distribution at a facet, given all
//! directions so far, stays a mixture of sums of exponential variables, on
//! which descending, climbing and escaping act in closed form. A step costs
//! time in proportion to the steps down so far.

use smallvec::SmallVec;

use super::walk::Roulette;
use super::{At, Draw, Facets, Microsurface, Ndf, Real, Rgb, Side, Tally, Vector3};

/// The distribution of the depth of a facet.
///
/// A chain of stages, each an exponential variable of its own rate: with
/// probability `start` the depth is the sum of the stages from this one on.
/// Its Laplace transform is L(s) = Σ_i start_i Π_{j ≥ i} rate_j/(s + rate_j):
/// every term is positive, so nothing cancels.
struct Depth<F> {
    stages: SmallVec<[Stage<F>; COMMON]>,
}

/// Stages that are kept without an allocation: steps down of most walks.
pub(super) const COMMON: usize = 12;

/// A ray that goes up stays inside with no smaller chance than this: straight
/// up, where no facet faces it, the phase function of the next one overflows.
pub(super) const NEVER: f64 = 1e-30;

struct Stage<F> {
    start: F,
    rate: F,
}

impl<F: Real> Depth<F> {
    fn new() -> Self {
        Self {
            stages: SmallVec::new(),
        }
    }

    /// The depth of the first collision, for light that enters at `rate`.
    fn enter(&mut self, rate: F) {
        self.stages.clear();
        self.stages.push(Stage {
            start: F::one(),
            rate,
        });
    }

    /// Goes down to the next collision at `rate`.
    #[inline]
    fn descend(&mut self, rate: F) {
        self.stages.push(Stage {
            start: F::zero(),
            rate,
        });
    }

    /// Goes up to the next collision at `rate`, given that there is one, and
    /// returns its probability, 0 for none: climbing through the stages in
    /// order, each is passed or collided in, whichever exponential is first.
    #[inline]
    fn climb(&mut self, rate: F) -> F {
        let mut passing = F::zero();
        let mut collided = F::zero();
        for stage in &mut self.stages {
            let here = stage.start + passing;
            let split = (rate + stage.rate).recip();
            stage.start = here * (rate * split);
            passing = here * (stage.rate * split);
            collided += stage.start;
        }
        if collided < F::of(NEVER) {
            return F::zero();
        }
        let norm = collided.recip();
        for stage in &mut self.stages {
            stage.start *= norm;
        }
        collided
    }

    /// The mean of e^{−λ·depth}: the chance to escape at the rate `lambda`.
    #[inline]
    fn escape(&self, lambda: F) -> F {
        self.stages.iter().fold(F::zero(), |passing, stage| {
            (passing + stage.start) * (stage.rate / (lambda + stage.rate))
        })
    }
}

/// A direction in which the path leaves the surface, at either end.
struct End<F> {
    w: Vector3<F>,
    /// σ(w)
    sigma: F,
    /// σ(−w)
    below: F,
}

impl<F: Real> End<F> {
    #[inline]
    fn new<N: Ndf<Scalar = F>>(ndf: &N, w: Vector3<F>) -> Self {
        let [sigma, below] = ndf.projected_areas(w);
        Self { w, sigma, below }
    }

    /// Light that comes in from here, at its first facet.
    #[inline]
    fn at(&self) -> At<F> {
        At {
            side: Side::Above,
            w: self.w,
            sigma: self.sigma,
        }
    }
}

impl<F, N, I> Microsurface<N, I>
where
    F: Real,
    N: Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    /// Estimates the value by both walks; `wi` and `wo` are known to link,
    /// and the facets to be mirrors.
    pub(super) fn eval_position_free(
        &self,
        wi: Vector3<F>,
        wo: Vector3<F>,
        rng: &mut impl Draw<F>,
        tally: &mut impl Tally<F>,
    ) {
        let ends = [wi, wo].map(|w| End::new(&self.ndf, w));
        tally.add(1, self.first_order(ends[0].at(), wo, wi));
        let mut depth = Depth::new();
        self.eval_directions(&ends[0], &ends[1], F::one(), &mut depth, rng, tally);
        rng.next_walk();
        self.eval_directions(&ends[1], &ends[0], wo.z / wi.z, &mut depth, rng, tally);
    }

    /// The part of orders ≥ 2 that a walk from `from` finds, times `scale`.
    fn eval_directions(
        &self,
        from: &End<F>,
        to: &End<F>,
        scale: F,
        depth: &mut Depth<F>,
        rng: &mut impl Draw<F>,
        tally: &mut impl Tally<F>,
    ) {
        let ndf = &self.ndf;
        let lambda = to.below / to.w.z;
        let mut at = from.at();
        depth.enter(at.sigma / from.w.z);
        let mut weight = Rgb::splat(scale);
        let mut order = 1;
        // The density of the path as the other walk would find it, over that
        // of this one, but for the normal of the connection and σ(ω_o):
        // Π_{j=0}^{k−2} σ(−d_j) / (D(m_1) Π_{j=2}^{k−1} σ(d_j)).
        let mut ratio = F::zero();
        loop {
            // Pick the next direction.
            let m = ndf.sample_visible(at.w, [rng.draw(), rng.draw()]);
            let bounce = self.facets.scatter(Side::Above, at.w, m, rng);
            weight *= bounce.weight;
            let d = bounce.direction;
            let [sigma, sigma_back] = ndf.projected_areas(d);
            ratio = bounded(if order == 1 {
                at.sigma / ndf.density(m)
            } else {
                ratio * (at.sigma / sigma)
            });
            if !Roulette::OF_CHANCE.survives(&mut weight, scale, order, rng) {
                return;
            }
            // Move the depth to the next facet.
            at = At {
                side: Side::Above,
                w: -d,
                sigma: sigma_back,
            };
            let rate = at.sigma / d.z.abs();
            // A level ray collides where it is.
            if rate.is_finite() {
                if d.z < F::zero() {
                    depth.descend(rate);
                } else {
                    // No dice for the chance to stay inside, which the other
                    // walk's weight could not know of: weighted by it, no
                    // connection outgrows the value.
                    let chance = depth.climb(rate);
                    if chance == F::zero() {
                        return;
                    }
                    weight = weight * chance;
                }
            }
            order += 1;
            // Connect to the far end.
            if is_unseen(d, to.w) {
                continue;
            }
            let phase = self.facets.phase(ndf, at, to.w, false, m);
            // Facets unevenly rough may leave an overflow still.
            if phase.density > F::zero() && phase.density.is_finite() {
                // σ(w) p is D(h)/4 without Fresnel.
                let other = ratio * (F::of(4.0) * at.sigma * phase.density / to.sigma);
                let value = phase.density * depth.escape(lambda) / (F::one() + other);
                tally.add(order, weight * phase.weight * value);
            }
        }
    }
}

/// How much less steep than it must be a normal is before it is taken for rounding.
pub(super) const SLACK: f64 = 1.25;

/// Whether the half vector of −`d` and `wo` is rounding alone. A ray that goes up sees
/// facets that are steeper than it. Where `d` and `wo` are so near that their difference
/// has no digits, it is none of them, and D may be anything beside a σ(−d) of nearly 0.
#[inline]
fn is_unseen<F: Real>(d: Vector3<F>, wo: Vector3<F>) -> bool {
    let h = wo - d;
    let rise = h.z * d.z;
    let across = (h.x * h.x + h.y * h.y) * (d.x * d.x + d.y * d.y);
    d.z > F::zero() && rise * rise > F::of(SLACK * SLACK) * across
}

/// Ratios of densities that are as good as 0 and ∞.
pub(super) const RATIOS: [f64; 2] = [1e-30, 1e30];

/// Keeps a product of many factors away from 0 and ∞. Weights that are this
/// unequal are 0 and 1.
#[inline]
fn bounded<F: Real>(x: F) -> F {
    x.max(F::of(RATIOS[0])).min(F::of(RATIOS[1]))
}

//! The walk among the micro-facets.

use super::first_order::escape_reflected;
use super::{
    At, Bounce, Draw, Exit, Facets, Microsurface, Ndf, Real, Rgb, Side, Tally, Vector3, enters,
};

/// Russian roulette for walks that have lost weight: to continue costs more than
/// it can bring.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roulette {
    /// Applies to weights below this share of the first,
    pub weight: f64,
    /// and from this order on.
    pub from: u32,
}

impl Roulette {
    /// Of walks whose weight is the light that is not absorbed: late, so that
    /// dark surfaces keep a clean first order.
    pub const OF_LIGHT: Self = Self {
        weight: 1.0 / 16.0,
        from: 3,
    };
    /// Of walks whose weight is the chance to have come this far as well.
    pub const OF_CHANCE: Self = Self {
        weight: 1.0 / 2.0,
        from: 2,
    };
}

/// From this order on a walk plays whatever its weight, and reaches order n with
/// probability (LONG/n)²: the expected number of steps of any walk is below 2·LONG, and
/// the mean is kept. Orders are exponentially distributed, so a chance that falls by a
/// power leaves the weights a finite variance; the lower the power and the later it
/// begins, the lighter their tail. Of diffuse facets with α = 300, which walks leave
/// after 2·10⁴ orders on average, the mean weight has a relative standard error of
/// 5/√walks. Walks get here at α ≥ 50 alone.
const LONG: u32 = 1 << 14;

/// The chance with which a walk goes on from `order`, if it is that long.
#[inline]
pub(super) fn chance_of_long(order: u32) -> Option<f64> {
    let n = f64::from(order);
    (order >= LONG).then(|| (n / (n + 1.0)).powi(2))
}

/// Light on its way.
pub(super) struct Ray<F> {
    /// Direction of travel in the frame of `side`.
    pub direction: Vector3<F>,
    /// Optical depth below the top of `side`.
    pub depth: F,
    pub side: Side,
}

impl<F: Real> Ray<F> {
    /// Light that enters from `wi`, before its first collision.
    #[inline]
    pub fn entering(wi: Vector3<F>) -> Self {
        Self {
            direction: -wi,
            depth: F::zero(),
            side: Side::Above,
        }
    }

    /// Moves to the next collision, and returns it; `None` means that the
    /// light left. `u` is uniform in [0, 1).
    ///
    /// The collision rate per unit of τ is σ(−d)/|d_z|, for d going down
    /// (1 + Λ(−d)) and up (Λ(d)).
    #[inline]
    pub fn advance<N: Ndf<Scalar = F>>(&mut self, ndf: &N, u: F) -> Option<At<F>> {
        let w = -self.direction;
        let sigma = ndf.projected_area(w);
        // |d_z| times an exponential free path; all tests are multiplied
        // through by |d_z|, which may be 0.
        let climb = -(F::one() - u).ln() * w.z.abs();
        if w.z >= F::zero() {
            self.depth += climb / sigma;
        } else if climb >= self.depth * sigma {
            return None;
        } else {
            self.depth = (self.depth - climb / sigma).max(F::zero());
        }
        Some(At {
            side: self.side,
            w,
            sigma,
        })
    }

    /// Goes on as `bounce` says.
    #[inline]
    pub fn follow(&mut self, bounce: &Bounce<F>) {
        if bounce.crosses {
            self.direction = -bounce.direction;
            self.depth = depth_from_other_side(self.depth);
            self.side = self.side.other();
        } else {
            self.direction = bounce.direction;
        }
    }

    /// A direction of the frame of [`Side::Above`] in the ray's frame, and
    /// back.
    #[inline]
    pub fn localized(&self, w: Vector3<F>) -> Vector3<F> {
        match self.side {
            Side::Above => w,
            Side::Below => -w,
        }
    }
}

/// The depth of the same height seen from the other side: C1 ↔ 1 − C1, so
/// τ ↦ −ln(1 − e^{−τ}), its own inverse.
#[inline]
pub(super) fn depth_from_other_side<F: Real>(tau: F) -> F {
    if tau > F::LN_2() {
        -(-(-tau).exp()).ln_1p()
    } else {
        // A depth of 0 has an infinite counterpart; the smallest positive
        // number has one that is finite and as unlikely.
        -(-(-tau.max(F::min_positive_value())).exp_m1()).ln()
    }
}

impl Roulette {
    /// Plays after `order` interactions of a walk that began with the weight
    /// `scale`; false ends the walk.
    #[inline]
    pub fn survives<F: Real>(
        self,
        weight: &mut Rgb<F>,
        scale: F,
        order: u32,
        rng: &mut impl Draw<F>,
    ) -> bool {
        if order < self.from {
            return weight.max_channel() > F::zero();
        }
        let mut chance = F::one();
        let (brightest, least) = (weight.max_channel(), F::of(self.weight) * scale);
        if brightest < least {
            chance = brightest / least;
        }
        if let Some(long) = chance_of_long(order) {
            chance *= F::of(long);
        }
        if chance < F::one() {
            if rng.draw() >= chance {
                return false;
            }
            *weight = *weight * chance.recip();
        }
        true
    }
}

impl<F, N, I> Microsurface<N, I>
where
    F: Real,
    N: Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    /// One walk that enters from `wi` (unit, z > 0): where it leaves, with
    /// density ∝ f |cosθ_o| if nothing is absorbed. `None` if it was absorbed,
    /// or if `wi` is not above the surface.
    pub fn sample(&self, wi: Vector3<F>, rng: &mut impl Draw<F>) -> Option<Exit<F>> {
        if !enters(wi) {
            return None;
        }
        if let Some(tint) = self.facets.invisible() {
            return Some(Exit {
                direction: -wi,
                weight: tint,
                order: 1,
            });
        }
        let entrance = self.entrance(wi);
        let mut at = entrance;
        let mut ray = Ray::entering(wi);
        let mut weight = Rgb::white();
        let mut order = 0;
        // The depth of the first facet is exponential, of rate σ(ω_i)/cosθ_i. Of
        // light that goes up from there and does not leave, so is the depth of
        // the next one: it need not be known before light goes down or across.
        let mut known = false;
        loop {
            let m = self.ndf.sample_visible(at.w, [rng.draw(), rng.draw()]);
            let bounce = self.facets.scatter(at.side, at.w, m, rng);
            weight *= bounce.weight;
            order += 1;
            let d = bounce.direction;
            if !known && !bounce.crosses && d.z > F::zero() {
                ray.direction = d;
                at = self.entrance(-d);
                if rng.draw() < escape_reflected(entrance, d.z, at.sigma) {
                    break;
                }
                if !Roulette::OF_LIGHT.survives(&mut weight, F::one(), order, rng) {
                    return None;
                }
                continue;
            }
            if !known {
                known = true;
                ray.depth = -(F::one() - rng.draw()).ln() * (wi.z / entrance.sigma);
            }
            ray.follow(&bounce);
            if !Roulette::OF_LIGHT.survives(&mut weight, F::one(), order, rng) {
                return None;
            }
            match ray.advance(&self.ndf, rng.draw()) {
                Some(next) => at = next,
                None => break,
            }
        }
        Some(Exit {
            direction: ray.localized(ray.direction),
            weight,
            order,
        })
    }

    /// Estimator 1, the paper's: at every facet the phase function towards
    /// `wo`, times the chance e^{−Λ(ω_o) τ} to get out unhindered.
    pub(super) fn eval_walk(
        &self,
        wi: Vector3<F>,
        wo: Vector3<F>,
        rng: &mut impl Draw<F>,
        tally: &mut impl Tally<F>,
    ) {
        let lambda = self.ndf.lambda(if wo.z > F::zero() { wo } else { -wo });
        let mut ray = Ray::entering(wi);
        let mut weight = Rgb::white();
        let mut order = 0;
        while let Some(at) = ray.advance(&self.ndf, rng.draw()) {
            let m = self.ndf.sample_visible(at.w, [rng.draw(), rng.draw()]);
            order += 1;
            // Connect to the outgoing direction.
            let o = ray.localized(wo);
            let crosses = o.z < F::zero();
            let phase = self.facets.phase(&self.ndf, at, o, crosses, m);
            if phase.density > F::zero() {
                let depth = if crosses {
                    depth_from_other_side(ray.depth)
                } else {
                    ray.depth
                };
                tally.add(
                    order,
                    weight * phase.weight * (phase.density * (-lambda * depth).exp()),
                );
            }
            // Walk on.
            let bounce = self.facets.scatter(at.side, at.w, m, rng);
            weight *= bounce.weight;
            ray.follow(&bounce);
            if !Roulette::OF_LIGHT.survives(&mut weight, F::one(), order, rng) {
                return;
            }
        }
    }
}

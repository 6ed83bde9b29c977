//! Estimator 2: a walk from either end of the path.
//!
//! A path of order k ≥ 2 from ω_i to ω_o is found by a walk from ω_i, whose
//! last facet is connected to ω_o, and by a walk from ω_o connected to ω_i.
//! The balance heuristic (Veach and Guibas 1995) weights the two. As the
//! product of all phase functions and free paths is the same in both
//! directions, the ratio of the two densities depends on the two connections
//! alone, and a path's value is c_f c_b / (c_f + c_b): no larger than the
//! smaller connection, however sharp the other is.

use super::walk::{Ray, Roulette, depth_from_other_side};
use super::{At, Draw, Facets, Microsurface, Ndf, Real, Rgb, Tally, Vector3};

/// How many times more often than chance an upward ray is kept inside. Both
/// walks exist for orders ≥ 2; leaving early is a wasted one.
const KEEP_INSIDE: f64 = 4.0;

/// The chance with which a ray that would collide with probability `collides`
/// is kept inside.
#[inline]
fn kept_inside<F: Real>(collides: F) -> F {
    (F::of(KEEP_INSIDE) * collides).min(F::one())
}

/// `a b / (a + b)` without intermediate overflow.
#[inline]
fn combined<F: Real>(a: F, b: F) -> F {
    let (low, high) = (a.min(b), a.max(b));
    if low > F::zero() {
        low / (F::one() + low / high)
    } else {
        F::zero()
    }
}

impl<F: Real> Ray<F> {
    /// [`Ray::advance`], but staying inside more often than the model does;
    /// with the weight that makes up for it.
    #[inline]
    fn advance_inside<N: Ndf<Scalar = F>>(&mut self, ndf: &N, u: F) -> Option<(At<F>, F)> {
        if self.direction.z <= F::zero() {
            return self.advance(ndf, u).map(|at| (at, F::one()));
        }
        let w = -self.direction;
        let sigma = ndf.projected_area(w);
        let rate = sigma / self.direction.z;
        let collides = -(-rate * self.depth).exp_m1();
        let kept = kept_inside(collides);
        if u >= kept {
            return None;
        }
        let climb = -(-(u / kept) * collides).ln_1p() / rate;
        self.depth = (self.depth - climb).max(F::zero());
        Some((
            At {
                side: self.side,
                w,
                sigma,
            },
            collides / kept,
        ))
    }
}

impl<F, N, I> Microsurface<N, I>
where
    F: Real,
    N: Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    /// Estimates the value by both walks; `wi` and `wo` are known to link.
    pub(super) fn eval_two_walk(
        &self,
        wi: Vector3<F>,
        wo: Vector3<F>,
        rng: &mut impl Draw<F>,
        tally: &mut impl Tally<F>,
    ) {
        let crosses = wo.z < F::zero();
        let index = if crosses {
            self.facets.relative_index()
        } else {
            F::one()
        };
        // f(ω_i, ω_o) |cosθ_o| over f(ω_o, ω_i) |cosθ_i|
        let swap = index * index * wo.z.abs() / wi.z;
        self.eval_half(wi, wo, swap, None, rng, tally);
        rng.next_walk();
        if crosses {
            let other = Self {
                ndf: self.ndf,
                facets: self.facets.inverted(),
            };
            other.eval_half(-wo, -wi, swap.recip(), Some(swap), rng, tally);
        } else {
            self.eval_half(wo, wi, swap.recip(), Some(swap), rng, tally);
        }
    }

    /// The part of the value that a walk from `from` finds. `swap` is the
    /// value towards `to` over that of the reversed path. The walk from ω_o
    /// is `mirrored`, by the factor that turns its value into that of ω_i;
    /// the other also gives the first order, in closed form.
    fn eval_half(
        &self,
        from: Vector3<F>,
        to: Vector3<F>,
        swap: F,
        mirrored: Option<F>,
        rng: &mut impl Draw<F>,
        tally: &mut impl Tally<F>,
    ) {
        let lambda = self.ndf.lambda(if to.z > F::zero() { to } else { -to });
        let mut ray = Ray::entering(from);
        let mut weight = Rgb::splat(mirrored.unwrap_or(F::one()));
        let scale = weight.max_channel();
        let mut order = 0;
        let mut back = F::zero();
        while let Some((at, correction)) = ray.advance_inside(&self.ndf, rng.draw()) {
            weight = weight * correction;
            let m = self.ndf.sample_visible(at.w, [rng.draw(), rng.draw()]);
            order += 1;
            // Connect to the far end.
            if order > 1 {
                let o = ray.localized(to);
                let crosses = o.z < F::zero();
                let phase = self.facets.phase(&self.ndf, at, o, crosses, m);
                if phase.density > F::zero() {
                    let depth = if crosses {
                        depth_from_other_side(ray.depth)
                    } else {
                        ray.depth
                    };
                    let forth = phase.density * (-lambda * depth).exp();
                    tally.add(order, weight * phase.weight * combined(forth, back));
                }
            } else if mirrored.is_none() {
                tally.add(1, self.first_order(at, to, m));
            }
            // Walk on.
            let depth = ray.depth;
            let bounce = self.facets.scatter(at.side, at.w, m, rng);
            weight *= bounce.weight;
            ray.follow(&bounce);
            if order == 1 {
                // The connection that the walk from the far end would make.
                let w = ray.direction;
                let at = At {
                    side: ray.side,
                    w,
                    sigma: self.ndf.projected_area(w),
                };
                let phase =
                    self.facets
                        .phase(&self.ndf, at, ray.localized(from), bounce.crosses, m);
                back = swap * phase.density * (-self.ndf.lambda(from) * depth).exp();
                if back <= F::zero() {
                    return;
                }
            }
            if !Roulette::OF_LIGHT.survives(&mut weight, scale, order, rng) {
                return;
            }
        }
    }
}

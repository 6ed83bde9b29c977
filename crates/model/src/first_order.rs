//! Single scattering, with the depth integrated out.

use super::{
    At, Draw, Exit, Facets, Microsurface, Ndf, Phase, Real, Rgb, Side, Vector3, enters, ln_beta,
};

impl<F, N, I> Microsurface<N, I>
where
    F: Real,
    N: Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    /// The first order of f(ω_i, ω_o) |cosθ_o| (sr⁻¹). Exact for conductors
    /// and dielectrics; for diffuse facets an estimate from one normal.
    pub fn eval_single(&self, wi: Vector3<F>, wo: Vector3<F>, rng: &mut impl Draw<F>) -> Rgb<F> {
        if !self.links(wi, wo) {
            return Rgb::black();
        }
        let at = self.entrance(wi);
        let m = if I::CLOSED_PHASE {
            wi
        } else {
            self.ndf.sample_visible(wi, [rng.draw(), rng.draw()])
        };
        self.first_order(at, wo, m)
    }

    /// Samples single scattering: the first bounce of a walk, weighted with
    /// the chance that it leaves from there. `None` if it can't.
    pub fn sample_single(&self, wi: Vector3<F>, rng: &mut impl Draw<F>) -> Option<Exit<F>> {
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
        let at = self.entrance(wi);
        let m = self.ndf.sample_visible(wi, [rng.draw(), rng.draw()]);
        let bounce = self.facets.scatter(Side::Above, wi, m, rng);
        let wo = bounce.direction;
        if bounce.crosses != (wo.z < F::zero()) || wo.z == F::zero() {
            return None;
        }
        let weight = bounce.weight * self.escape(at, wo);
        (weight.max_channel() > F::zero()).then_some(Exit {
            direction: wo,
            weight,
            order: 1,
        })
    }

    /// Light from `wi` at its first facet.
    #[inline]
    pub(super) fn entrance(&self, wi: Vector3<F>) -> At<F> {
        At {
            side: Side::Above,
            w: wi,
            sigma: self.ndf.projected_area(wi),
        }
    }

    /// The first order towards `wo`, with the normal `m` where one is needed.
    #[inline]
    pub(super) fn first_order(&self, at: At<F>, wo: Vector3<F>, m: Vector3<F>) -> Rgb<F> {
        let Phase { density, weight } = self.facets.phase(&self.ndf, at, wo, wo.z < F::zero(), m);
        if density > F::zero() {
            weight * (density * self.escape(at, wo))
        } else {
            Rgb::black()
        }
    }

    /// The chance that light from `at.w` leaves along `wo` after its first
    /// interaction: the mean of e^{−Λ_o τ} over the depth τ of that.
    ///
    /// Reflection (Ross et al. 2005; Heitz 2014, eq. 99):
    /// (1 + Λ_i)/(1 + Λ_i + Λ_o). Transmission, where the depth is that of the
    /// other side (Heitz et al. 2016, § 5.2): (1 + Λ_i) B(1 + Λ_i, 1 + Λ_o).
    #[inline]
    pub(super) fn escape(&self, at: At<F>, wo: Vector3<F>) -> F {
        let cos_i = at.w.z;
        if wo.z > F::zero() {
            return escape_reflected(at, wo.z, self.ndf.projected_area(-wo));
        }
        let (rate_in, rate_out) = (at.sigma / cos_i, self.ndf.projected_area(-wo) / -wo.z);
        let chance = rate_in * ln_beta(rate_in.max(F::one()), rate_out.max(F::one())).exp();
        if chance.is_finite() {
            chance.min(F::one())
        } else {
            F::zero()
        }
    }
}

/// The chance that light from `at.w` leaves by reflection towards ω_o after its
/// first interaction, given cosθ_o and σ(−ω_o).
#[inline]
pub(super) fn escape_reflected<F: Real>(at: At<F>, cos_o: F, sigma_back: F) -> F {
    // Multiplied through by both cosines, so that neither divides.
    let entry = at.sigma * cos_o;
    entry / (entry + at.w.z * sigma_back)
}

//! A density in closed form that follows the BSDF, for multiple importance
//! sampling. The walk's own density is not known.

use super::{Facets, Microsurface, Ndf, Real, Vector3};

/// The least share of the cosine lobe: it keeps the density positive where
/// that of the first bounce underflows.
const LEAST_SHARE: f64 = 1e-3;

impl<F, N, I> Microsurface<N, I>
where
    F: Real,
    N: Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    /// A density (sr⁻¹, no cosine) that is positive wherever the BSDF is and
    /// integrates to 1 over the directions in which light can leave.
    ///
    /// It is a mixture. One part is the density of the first bounce, with the
    /// directions that go on into the surface folded back at the horizon; the
    /// other a cosine lobe, with a share that follows the roughness. Diffuse
    /// facets have the lobe alone.
    ///
    /// Weighting two strategies by it is unbiased, as long as both use it;
    /// [`Microsurface::sample`] has a weight of its own.
    pub fn pdf(&self, wi: Vector3<F>, wo: Vector3<F>) -> F {
        if !self.links(wi, wo) {
            return F::zero();
        }
        let sides = if I::TRANSMITS { F::of(0.5) } else { F::one() };
        let lobe = sides * wo.z.abs() * F::FRAC_1_PI();
        if !I::CLOSED_PHASE {
            return lobe;
        }
        let share = self.multiple_share();
        let mirrored = Vector3::new(wo.x, wo.y, -wo.z);
        let crosses = wo.z < F::zero();
        let at = self.entrance(wi);
        let first = |o| self.facets.phase(&self.ndf, at, o, crosses, wi).density;
        (F::one() - share) * (first(wo) + first(mirrored)) + share * lobe
    }

    /// The density of [`Microsurface::sample_single`] (sr⁻¹, no cosine), for
    /// facets where it is closed; for diffuse ones [`Microsurface::pdf`]. Its
    /// integral falls short of 1 by the chance that sampling gives `None`
    /// because the light goes on into the surface.
    pub fn pdf_single(&self, wi: Vector3<F>, wo: Vector3<F>) -> F {
        if !I::CLOSED_PHASE {
            return self.pdf(wi, wo);
        }
        if !self.links(wi, wo) {
            return F::zero();
        }
        let at = self.entrance(wi);
        self.facets
            .phase(&self.ndf, at, wo, wo.z < F::zero(), wi)
            .density
    }

    /// A cheap guess of the share of orders ≥ 2: 1 − e^{−x} with x = 3Λ/2, the
    /// exponential by its series, is near that of white GGX mirrors for α ≤ 1.
    #[inline]
    pub(super) fn multiple_share(&self) -> F {
        let x = F::of(1.5) * self.steep_lambda();
        let falls = (F::one() + x * (F::one() + F::of(0.5) * x)).recip();
        (F::one() - falls).max(F::of(LEAST_SHARE))
    }
}

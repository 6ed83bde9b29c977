use super::{At, Bounce, Draw, Facets, Ndf, Phase, Real, Side, Vector3};
use crate::ConductorFresnel;

/// Mirror facets that reflect by a Fresnel curve and absorb the rest.
///
/// p(d → ω) = F D(h) / (4 σ(−d)) with h the half vector of −d and ω
/// (Heitz et al. 2016, eq. 17, with ⟨ω, h⟩ cancelled).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor<F> {
    /// Reflectance of the facets.
    pub fresnel: ConductorFresnel<F>,
}

impl<F: Real> Facets for Conductor<F> {
    type Scalar = F;

    const TRANSMITS: bool = false;
    const CLOSED_PHASE: bool = true;
    const MIRRORS: bool = true;

    #[inline]
    fn scatter(&self, _: Side, w: Vector3<F>, m: Vector3<F>, _: &mut impl Draw<F>) -> Bounce<F> {
        let cos = w.dot(m).max(F::zero());
        Bounce {
            direction: (m * (cos + cos) - w).polished(),
            crosses: false,
            weight: self.fresnel.reflectance(cos),
        }
    }

    #[inline]
    fn phase<N: Ndf<Scalar = F>>(
        &self,
        ndf: &N,
        at: At<F>,
        o: Vector3<F>,
        crosses: bool,
        _: Vector3<F>,
    ) -> Phase<F> {
        let h = at.w + o;
        let length = h.length();
        if crosses || h.z <= F::zero() || length == F::zero() || at.sigma == F::zero() {
            return Phase::none();
        }
        let density = ndf.density(h * length.recip()) / (F::of(4.0) * at.sigma);
        // |w + o| = 2 w·h
        Phase {
            density,
            weight: self.fresnel.reflectance(F::of(0.5) * length),
        }
    }

    #[inline]
    fn inverted(&self) -> Self {
        *self
    }
}

use super::{At, Bounce, Draw, Facets, Ndf, Phase, Real, Rgb, Side, Vector3};
use crate::fresnel;

/// Smooth dielectric facets, which reflect and refract.
///
/// Reflection as by a conductor with the reflectance F; transmission with the
/// half-vector Jacobian of Walter et al. 2007, eq. 17 (Heitz et al. 2016,
/// § 5.2): p_T(d → ω) = (1 − F) ⟨w·m⟩ D(m) η² |ω·m| / (σ(w) |w + ηω|²), where
/// w = −d and m is parallel to w + ηω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric<F> {
    /// Relative index of refraction, n(below) / n(above).
    pub eta: F,
    /// Colour by which every facet multiplies, on reflection and on
    /// transmission alike; so a path and its reverse have the same colour.
    /// Cycles up to 3.6 does the same with the colour of its glass.
    pub tint: Rgb<F>,
}

impl<F: Real> Dielectric<F> {
    /// Relative index of the far side, seen from `side`.
    #[inline]
    fn eta_from(&self, side: Side) -> F {
        match side {
            Side::Above => self.eta,
            Side::Below => self.eta.recip(),
        }
    }
}

impl<F: Real> Facets for Dielectric<F> {
    type Scalar = F;

    const TRANSMITS: bool = true;
    const CLOSED_PHASE: bool = true;

    #[inline]
    fn scatter(
        &self,
        side: Side,
        w: Vector3<F>,
        m: Vector3<F>,
        rng: &mut impl Draw<F>,
    ) -> Bounce<F> {
        let eta = self.eta_from(side);
        let cos = w.dot(m).max(F::zero()).min(F::one());
        let (reflectance, cos_t) = fresnel::dielectric(cos, eta);
        let crosses = rng.draw() >= reflectance;
        let direction = if crosses {
            m * (cos / eta - cos_t) - w * eta.recip()
        } else {
            m * (cos + cos) - w
        };
        Bounce {
            direction: direction.normalized(),
            crosses,
            weight: self.tint,
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
        let eta = self.eta_from(at.side);
        let h = if crosses { at.w + o * eta } else { at.w + o };
        let length = h.length();
        if length == F::zero() || at.sigma == F::zero() {
            return Phase::none();
        }
        // Micro-normals point up.
        let m = h * (if h.z < F::zero() { -length } else { length }).recip();
        // By reflection |w + o| = 2 w·m, which rounding at grazing angles can't
        // make zero or negative, as it can the scalar product.
        let cos = if crosses {
            at.w.dot(m)
        } else {
            F::of(0.5) * length
        };
        if cos <= F::zero() || m.z <= F::zero() {
            return Phase::none();
        }
        let density = if crosses {
            let cos_o = -o.dot(m);
            if cos_o <= F::zero() {
                return Phase::none();
            }
            // In this order no intermediate overflows in f32 near η = 1.
            let jacobian = (eta / length) * (cos_o / length) * eta;
            fresnel::transmittance(cos, cos_o, eta) * (ndf.density(m) * (cos / at.sigma)) * jacobian
        } else if h.z > F::zero() {
            fresnel::dielectric(cos.min(F::one()), eta).0 * ndf.density(m) / (F::of(4.0) * at.sigma)
        } else {
            return Phase::none();
        };
        Phase {
            density,
            weight: self.tint,
        }
    }

    #[inline]
    fn inverted(&self) -> Self {
        Self {
            eta: self.eta.recip(),
            ..*self
        }
    }

    #[inline]
    fn relative_index(&self) -> F {
        self.eta
    }

    /// Within rounding of η = 1, where half vectors carry no digits.
    #[inline]
    fn invisible(&self) -> Option<Rgb<F>> {
        ((self.eta - F::one()).abs() <= F::of(16.0) * F::epsilon()).then_some(self.tint)
    }
}

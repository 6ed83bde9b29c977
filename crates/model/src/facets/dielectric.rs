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

/// A facet that refracts `at` into `o`: the cosines of both to its normal, and
/// the two factors of the density of `o`, sr⁻¹, without the transmittance.
pub(super) struct Refracted<F> {
    pub(super) cos: F,
    pub(super) cos_o: F,
    /// D(m) ⟨w·m⟩ / σ(w).
    pub(super) visible: F,
    /// η² |ω·m| / |w + ηω|².
    pub(super) jacobian: F,
}

/// The facet that refracts `at` into `o`, with n(far) / n(near) = `eta`; `None`
/// if there is none.
#[inline]
pub(super) fn refracted<F: Real, N: Ndf<Scalar = F>>(
    ndf: &N,
    at: At<F>,
    o: Vector3<F>,
    eta: F,
) -> Option<Refracted<F>> {
    let zero = F::zero();
    let h = at.w + o * eta;
    let length = h.length();
    if length == zero || at.sigma == zero {
        return None;
    }
    // Micro-normals point up.
    let m = h * (if h.z < zero { -length } else { length }).recip();
    let (cos, cos_o) = (at.w.dot(m), -o.dot(m));
    (cos > zero && m.z > zero && cos_o > zero).then(|| Refracted {
        cos,
        cos_o,
        visible: ndf.density(m) * (cos / at.sigma),
        // In this order no intermediate overflows in f32 near η = 1.
        jacobian: (eta / length) * (cos_o / length) * eta,
    })
}

/// The cosine of `at` to the facet that reflects it into `o`, and D(m), sr⁻¹, of its normal:
/// the density of `o` is F D / 4σ. `None` if there is none.
#[inline]
pub(super) fn reflected<F: Real, N: Ndf<Scalar = F>>(
    ndf: &N,
    at: At<F>,
    o: Vector3<F>,
) -> Option<(F, F)> {
    let h = at.w + o;
    let length = h.length();
    if h.z <= F::zero() || length == F::zero() || at.sigma == F::zero() {
        return None;
    }
    // |w + o| = 2 w·m, which rounding at grazing angles can't make zero
    // or negative, as it can the scalar product.
    let cos = (F::of(0.5) * length).min(F::one());
    let m = h * length.recip();
    Some((cos, ndf.density(m)))
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
        let eta = side.eta(self.eta);
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
        let eta = at.side.eta(self.eta);
        let density = if crosses {
            let Some(facet) = refracted(ndf, at, o, eta) else {
                return Phase::none();
            };
            fresnel::transmittance(facet.cos, facet.cos_o, eta) * facet.visible * facet.jacobian
        } else {
            let Some((cos, normals)) = reflected(ndf, at, o) else {
                return Phase::none();
            };
            fresnel::dielectric(cos, eta).0 * normals / (F::of(4.0) * at.sigma)
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

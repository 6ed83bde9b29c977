use super::dielectric::refracted;
use super::{At, Bounce, Dielectric, Draw, Facets, Ndf, Phase, Real, Rgb, Side, Vector3};
use crate::fresnel;

/// What smooth dielectric facets let through, without Fresnel's factor: light
/// is refracted at every facet, and lost under total reflection.
///
/// The density is that of [`Dielectric`] without its transmittance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refraction<F> {
    /// Relative index of refraction, n(below) / n(above).
    pub eta: F,
    /// Colour by which every facet multiplies.
    pub tint: Rgb<F>,
}

impl<F: Real> Facets for Refraction<F> {
    type Scalar = F;

    const TRANSMITS: bool = true;
    const CLOSED_PHASE: bool = true;

    #[inline]
    fn scatter(&self, side: Side, w: Vector3<F>, m: Vector3<F>, _: &mut impl Draw<F>) -> Bounce<F> {
        let eta = side.eta(self.eta);
        let cos = w.dot(m).max(F::zero()).min(F::one());
        let (reflectance, cos_t) = fresnel::dielectric(cos, eta);
        let passes = reflectance < F::one();
        let direction = m * (cos / eta - cos_t) - w * eta.recip();
        Bounce {
            direction: if passes { direction.normalized() } else { -w },
            crosses: true,
            weight: if passes { self.tint } else { Rgb::black() },
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
        if !crosses {
            return Phase::none();
        }
        let eta = at.side.eta(self.eta);
        match refracted(ndf, at, o, eta) {
            Some(facet) => Phase {
                density: facet.visible * facet.jacobian,
                weight: self.tint,
            },
            None => Phase::none(),
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

    #[inline]
    fn invisible(&self) -> Option<Rgb<F>> {
        let Self { eta, tint } = *self;
        Dielectric { eta, tint }.invisible()
    }
}

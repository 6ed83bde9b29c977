use super::{At, Bounce, Dielectric, Draw, Facets, Ndf, Phase, Real, Rgb, Side, Vector3};
use crate::fresnel;

/// [`Dielectric`] facets whose reflection and transmission are coloured apart.
///
/// Light is reflected by chance as by the dielectric; what a facet multiplies it
/// by makes F into F_c = (1 − s) F₀ c + s, where s is how far F has risen from
/// F₀ at normal incidence to 1, and 1 − F into (1 − F_c) times a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass<F> {
    /// Relative index of refraction, n(below) / n(above).
    pub eta: F,
    /// The factor c on the reflectance at normal incidence.
    pub reflection: Rgb<F>,
    /// The factor on what is transmitted.
    pub transmission: Rgb<F>,
}

impl<F: Real> Glass<F> {
    /// The same without colours.
    #[inline]
    fn white(&self) -> Dielectric<F> {
        Dielectric {
            eta: self.eta,
            tint: Rgb::white(),
        }
    }

    /// F_c / F at the cosine `cos` of incidence, with n(far) / n(near) = `eta`.
    #[inline]
    pub fn reflected(&self, cos: F, eta: F) -> Rgb<F> {
        let f0 = fresnel::normal_reflectance(eta);
        let rise = fresnel::rise(cos, eta);
        let plain = f0 + (F::one() - f0) * rise;
        if plain <= F::zero() {
            return self.reflection;
        }
        self.reflection
            .map(|c| (f0 * c * (F::one() - rise) + rise) / plain)
    }

    /// (1 − F_c) / (1 − F) times the colour; the angle cancels.
    #[inline]
    pub fn transmitted(&self) -> Rgb<F> {
        let f0 = fresnel::normal_reflectance(self.eta);
        self.reflection
            .map(|c| (F::one() - f0 * c) / (F::one() - f0))
            * self.transmission
    }
}

impl<F: Real> Facets for Glass<F> {
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
        let bounce = self.white().scatter(side, w, m, rng);
        let weight = if bounce.crosses {
            self.transmitted()
        } else {
            self.reflected(w.dot(m).max(F::zero()).min(F::one()), side.eta(self.eta))
        };
        Bounce { weight, ..bounce }
    }

    #[inline]
    fn phase<N: Ndf<Scalar = F>>(
        &self,
        ndf: &N,
        at: At<F>,
        o: Vector3<F>,
        crosses: bool,
        m: Vector3<F>,
    ) -> Phase<F> {
        let phase = self.white().phase(ndf, at, o, crosses, m);
        let weight = if crosses {
            self.transmitted()
        } else {
            // |w + o| = 2 w·m
            let cos = (F::of(0.5) * (at.w + o).length()).min(F::one());
            self.reflected(cos, at.side.eta(self.eta))
        };
        Phase { weight, ..phase }
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
        self.white().invisible().map(|_| self.transmitted())
    }
}

use super::dielectric::{reflected, refracted};
use super::{At, Bounce, Dielectric, Draw, Facets, Ndf, Phase, Real, Rgb, Side, Vector3};
use crate::Film;
use crate::fresnel;

/// [`Dielectric`] facets whose reflection and transmission are coloured apart.
///
/// Light is reflected by chance as by the dielectric, below a film by the mean of its
/// reflectances; what a facet multiplies it
/// by makes F into F_c = (1 − s) F₀ c + s, where s is how far F has risen from
/// F₀ at normal incidence to 1, and 1 − F into (1 − F_c) times a colour. Below a thin
/// film F_c is the film's reflectance instead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass<F> {
    /// Relative index of refraction, n(below) / n(above).
    pub eta: F,
    /// The factor c on the reflectance at normal incidence; without a film.
    pub reflection: Rgb<F>,
    /// The factor on what is transmitted.
    pub transmission: Rgb<F>,
    /// A film between the media, relative to the medium above. On facets that are none,
    /// for the media are as dense, it is none either.
    pub film: Option<Film<F>>,
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

    /// F_c / F at the cosine `cos` of incidence from `side`.
    #[inline]
    pub fn reflected(&self, side: Side, cos: F) -> Rgb<F> {
        let eta = side.eta(self.eta);
        if let Some(film) = self.film {
            let plain = fresnel::dielectric(cos, eta).0;
            return self.filmed(&film, side, cos).0 * plain.max(F::epsilon()).recip();
        }
        let f0 = fresnel::normal_reflectance(eta);
        let rise = fresnel::rise(cos, eta);
        let plain = f0 + (F::one() - f0) * rise;
        if plain <= F::zero() {
            return self.reflection;
        }
        self.reflection
            .map(|c| (f0 * c * (F::one() - rise) + rise) / plain)
    }

    /// (1 − F_c) / (1 − F) times the colour, at the cosine `cos` of incidence from `side`;
    /// without a film the angle cancels.
    #[inline]
    pub fn transmitted(&self, side: Side, cos: F) -> Rgb<F> {
        let one = F::one();
        if let Some(film) = self.film {
            let plain = fresnel::dielectric(cos, side.eta(self.eta)).0;
            let rest = (one - plain).max(F::epsilon());
            let reflectance = self.filmed(&film, side, cos).0;
            return reflectance.map(|f| (one - f) / rest) * self.transmission;
        }
        let f0 = fresnel::normal_reflectance(self.eta);
        self.reflection.map(|c| (one - f0 * c) / (one - f0)) * self.transmission
    }

    /// The reflectance of the film, and the chance of reflection that goes with it.
    #[inline(never)]
    pub(crate) fn filmed(&self, film: &Film<F>, side: Side, cos: F) -> (Rgb<F>, F) {
        let reflectance = match side {
            Side::Above => film.on_dielectric(cos, self.eta),
            Side::Below => film.inverted(self.eta).on_dielectric(cos, self.eta.recip()),
        };
        let [r, g, b] = reflectance.0;
        (reflectance, (r + g + b) / F::of(3.0))
    }

    /// [`Facets::scatter`] below a film.
    fn scatter_below(
        &self,
        film: &Film<F>,
        side: Side,
        w: Vector3<F>,
        m: Vector3<F>,
        rng: &mut impl Draw<F>,
    ) -> Bounce<F> {
        let eta = side.eta(self.eta);
        let cos = w.dot(m).max(F::zero()).min(F::one());
        let cos_t = fresnel::dielectric(cos, eta).1;
        let (reflectance, chance) = self.filmed(film, side, cos);
        let crosses = rng.draw() >= chance && cos_t > F::zero();
        let (direction, weight) = if crosses {
            let direction = m * (cos / eta - cos_t) - w * eta.recip();
            let rest = (F::one() - chance).recip();
            let weight = reflectance.map(|f| (F::one() - f) * rest) * self.transmission;
            (direction, weight)
        } else if cos_t > F::zero() {
            (m * (cos + cos) - w, reflectance * chance.recip())
        } else {
            (m * (cos + cos) - w, Rgb::white())
        };
        Bounce {
            direction: direction.normalized(),
            crosses,
            weight,
        }
    }

    /// [`Facets::phase`] below a film.
    fn phase_below<N: Ndf<Scalar = F>>(
        &self,
        film: &Film<F>,
        ndf: &N,
        at: At<F>,
        o: Vector3<F>,
        crosses: bool,
    ) -> Phase<F> {
        if crosses {
            let Some(facet) = refracted(ndf, at, o, at.side.eta(self.eta)) else {
                return Phase::none();
            };
            let (reflectance, chance) = self.filmed(film, at.side, facet.cos);
            let rest = F::one() - chance;
            if rest <= F::zero() {
                return Phase::none();
            }
            return Phase {
                density: rest * facet.visible * facet.jacobian,
                weight: reflectance.map(|f| (F::one() - f) / rest) * self.transmission,
            };
        }
        let Some((cos, normals)) = reflected(ndf, at, o) else {
            return Phase::none();
        };
        let (reflectance, chance) = self.filmed(film, at.side, cos);
        if chance <= F::zero() {
            return Phase::none();
        }
        Phase {
            density: chance * normals / (F::of(4.0) * at.sigma),
            weight: reflectance * chance.recip(),
        }
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
        if let Some(film) = &self.film {
            return self.scatter_below(film, side, w, m, rng);
        }
        let bounce = self.white().scatter(side, w, m, rng);
        let cos = w.dot(m).max(F::zero()).min(F::one());
        let weight = if bounce.crosses {
            self.transmitted(side, cos)
        } else {
            self.reflected(side, cos)
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
        if let Some(film) = &self.film {
            return self.phase_below(film, ndf, at, o, crosses);
        }
        let phase = self.white().phase(ndf, at, o, crosses, m);
        let weight = if crosses {
            self.transmitted(at.side, F::one())
        } else {
            // |w + o| = 2 w·m
            let cos = (F::of(0.5) * (at.w + o).length()).min(F::one());
            self.reflected(at.side, cos)
        };
        Phase { weight, ..phase }
    }

    #[inline]
    fn inverted(&self) -> Self {
        Self {
            eta: self.eta.recip(),
            film: self.film.map(|film| film.inverted(self.eta)),
            ..*self
        }
    }

    #[inline]
    fn relative_index(&self) -> F {
        self.eta
    }

    #[inline]
    fn invisible(&self) -> Option<Rgb<F>> {
        let invisible = self.white().invisible();
        invisible.map(|_| {
            Self {
                film: None,
                ..*self
            }
            .transmitted(Side::Above, F::one())
        })
    }
}

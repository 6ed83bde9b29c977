use super::{At, Bounce, Draw, Facets, Ndf, Phase, Real, Rgb, Side, Vector3};

/// Lambertian facets.
///
/// p(d → ω) = (1/π) ∫ ⟨m·ω⟩ D_{−d}(m) dm (Heitz et al. 2016, § 5.3) is not
/// closed; the normal of the walk's own facet estimates it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse<F> {
    /// Reflectance of the facets, in [0, 1].
    pub albedo: Rgb<F>,
}

impl<F: Real> Facets for Diffuse<F> {
    type Scalar = F;

    const TRANSMITS: bool = false;
    const CLOSED_PHASE: bool = false;

    #[inline]
    fn scatter(&self, _: Side, _: Vector3<F>, m: Vector3<F>, rng: &mut impl Draw<F>) -> Bounce<F> {
        Bounce {
            direction: cosine_lobe(m, [rng.draw(), rng.draw()]),
            crosses: false,
            weight: self.albedo,
        }
    }

    #[inline]
    fn phase<N: Ndf<Scalar = F>>(
        &self,
        _: &N,
        _: At<F>,
        o: Vector3<F>,
        crosses: bool,
        m: Vector3<F>,
    ) -> Phase<F> {
        if crosses {
            return Phase::none();
        }
        Phase {
            density: m.dot(o).max(F::zero()) * F::FRAC_1_PI(),
            weight: self.albedo,
        }
    }

    #[inline]
    fn inverted(&self) -> Self {
        *self
    }
}

/// A direction with density ⟨m·ω⟩/π: a uniform point on the unit sphere
/// around m's tip, seen from the origin.
#[inline]
fn cosine_lobe<F: Real>(m: Vector3<F>, u: [F; 2]) -> Vector3<F> {
    let one = F::one();
    let on_sphere = Vector3::spherical(one - (u[0] + u[0]), F::TAU() * u[1]);
    let sum = m + on_sphere;
    let length = sum.length();
    // The two are opposite with probability zero: any tangent will do.
    if length > F::epsilon() {
        sum * length.recip()
    } else {
        m
    }
}

//! What is validated: the model's parts, each replaceable by a faulty one.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use smithwalk_model::{
    Beckmann, Conductor, ConductorFresnel, Dielectric, Diffuse, Draw, Estimator, Exit, Facets, Ggx,
    Microsurface, Ndf, Quadratic, Rgb, Stream, StudentT, Tally, Vector3,
};

/// The random numbers of a check.
pub type Rng = Stream<Pcg64Mcg>;

/// The random numbers of case `index` of the check `check`: fixed, so that a
/// verdict can be repeated, and independent of the order of the cases.
pub fn stream(check: u64, index: usize) -> Rng {
    Stream(Pcg64Mcg::seed_from_u64(check << 32 | index as u64))
}

/// A number in [0, 1).
pub fn uniform(rng: &mut Rng) -> f64 {
    rng.draw()
}

/// A distribution of normals of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Trowbridge–Reitz.
    Ggx(Ggx<f64>),
    /// Gaussian slopes.
    Beckmann(Beckmann<f64>),
    /// Slopes of Student's distribution.
    StudentT(StudentT<f64>),
    /// The one with closed-form mirrors.
    Quadratic,
}

impl Distribution {
    /// Those that have a roughness, of this one: slope roughness α along x and y.
    pub fn of_roughness(alpha_x: f64, alpha_y: f64) -> impl IntoIterator<Item = Self> {
        [
            Self::Ggx(Ggx { alpha_x, alpha_y }),
            Self::Beckmann(Beckmann { alpha_x, alpha_y }),
        ]
    }

    /// The slope roughness α along x and y; that of slopes ∼ 1 for the
    /// quadratic distribution.
    pub fn alpha(self) -> (f64, f64) {
        match self {
            Self::Ggx(d) => (d.alpha_x, d.alpha_y),
            Self::Beckmann(d) => (d.alpha_x, d.alpha_y),
            Self::StudentT(d) => (d.alpha_x, d.alpha_y),
            Self::Quadratic => (1.0, 1.0),
        }
    }

    /// Its name and roughness.
    pub fn name(self) -> String {
        let name = match self {
            Self::Ggx(_) => "GGX".to_owned(),
            Self::Beckmann(_) => "Beckmann".to_owned(),
            Self::StudentT(d) => format!("Student t γ {},", d.gamma),
            Self::Quadratic => return "quadratic".into(),
        };
        let (x, y) = self.alpha();
        if x == y {
            format!("{name} α {x}")
        } else {
            format!("{name} α {x}, {y}")
        }
    }
}

impl Ndf for Distribution {
    type Scalar = f64;

    fn density(&self, m: Vector3<f64>) -> f64 {
        match self {
            Self::Ggx(d) => d.density(m),
            Self::Beckmann(d) => d.density(m),
            Self::StudentT(d) => d.density(m),
            Self::Quadratic => Quadratic::new().density(m),
        }
    }

    fn projected_area(&self, w: Vector3<f64>) -> f64 {
        match self {
            Self::Ggx(d) => d.projected_area(w),
            Self::Beckmann(d) => d.projected_area(w),
            Self::StudentT(d) => d.projected_area(w),
            Self::Quadratic => Quadratic::new().projected_area(w),
        }
    }

    fn sample_visible(&self, w: Vector3<f64>, u: [f64; 2]) -> Vector3<f64> {
        match self {
            Self::Ggx(d) => d.sample_visible(w, u),
            Self::Beckmann(d) => d.sample_visible(w, u),
            Self::StudentT(d) => d.sample_visible(w, u),
            Self::Quadratic => Quadratic::new().sample_visible(w, u),
        }
    }
}

/// An implementation of the microsurface model. [`Smithwalk`] is the one
/// of [`smithwalk_model`];
/// tests give others, with a part that is wrong, to see it found.
pub trait Model: Copy + Send + Sync {
    /// Its distributions of normals.
    type Ndf: Ndf<Scalar = f64> + Send + Sync;
    /// Its mirrors.
    type Conductor: Facets<Scalar = f64> + Send + Sync;
    /// Its dielectric facets.
    type Dielectric: Facets<Scalar = f64> + Send + Sync;
    /// Its Lambertian facets.
    type Diffuse: Facets<Scalar = f64> + Send + Sync;

    /// The distribution `d`.
    fn ndf(self, d: Distribution) -> Self::Ndf;

    /// Mirrors of this reflectance.
    fn metal(self, fresnel: ConductorFresnel<f64>) -> Self::Conductor;

    /// Mirrors that absorb nothing.
    fn conductor(self) -> Self::Conductor {
        self.metal(ConductorFresnel::Constant(Rgb::white()))
    }

    /// Clear facets with the relative index n(below)/n(above) = `eta`.
    fn dielectric(self, eta: f64) -> Self::Dielectric;

    /// Lambertian facets that absorb nothing.
    fn diffuse(self) -> Self::Diffuse;

    /// One walk, as [`Microsurface::sample`].
    fn sample<I: Facets<Scalar = f64>>(
        self,
        surface: &Microsurface<Self::Ndf, I>,
        wi: Vector3<f64>,
        rng: &mut impl Draw<f64>,
    ) -> Option<Exit<f64>> {
        surface.sample(wi, rng)
    }

    /// One estimate, as [`Microsurface::eval`].
    fn eval<I: Facets<Scalar = f64>>(
        self,
        surface: &Microsurface<Self::Ndf, I>,
        estimator: Estimator,
        wi: Vector3<f64>,
        wo: Vector3<f64>,
        rng: &mut impl Draw<f64>,
        tally: &mut impl Tally<f64>,
    ) {
        surface.eval(estimator, wi, wo, rng, tally);
    }
}

/// The model of [`smithwalk_model`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Smithwalk;

impl Model for Smithwalk {
    type Ndf = Distribution;
    type Conductor = Conductor<f64>;
    type Dielectric = Dielectric<f64>;
    type Diffuse = Diffuse<f64>;

    fn ndf(self, d: Distribution) -> Distribution {
        d
    }

    fn metal(self, fresnel: ConductorFresnel<f64>) -> Conductor<f64> {
        Conductor { fresnel }
    }

    fn dielectric(self, eta: f64) -> Dielectric<f64> {
        Dielectric {
            eta,
            tint: Rgb::white(),
        }
    }

    fn diffuse(self) -> Diffuse<f64> {
        Diffuse {
            albedo: Rgb::white(),
        }
    }
}

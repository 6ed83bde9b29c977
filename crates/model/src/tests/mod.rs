//! What is true of this crate's own ways to the model: its estimators, densities and
//! lanes. What any model must satisfy is tested by the crate of the validation.

mod estimators;
mod lanes;
mod layered;
mod normals;
mod tabulated;

use super::*;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use smithwalk_validation::statistics::{Mean, gauss, sidak, worst_score};

fn stream(seed: u64) -> Stream<Pcg64Mcg> {
    Stream(Pcg64Mcg::seed_from_u64(seed))
}

/// ∫ g(ω) dω over cosθ in [from, to], by `n` × 2`n` points.
fn over_sphere(n: usize, from: f64, to: f64, mut g: impl FnMut(Vector3<f64>) -> f64) -> f64 {
    let mut sum = 0.0;
    for (x, weight) in gauss(n) {
        for j in 0..2 * n {
            let phi = std::f64::consts::PI * (j as f64 + 0.5) / n as f64;
            sum += weight * g(Vector3::spherical(from + (to - from) * x, phi));
        }
    }
    sum * (to - from) * std::f64::consts::PI / n as f64
}

/// A distribution, by a name, with the slope roughness along x and y that
/// spreads its normals evenly enough for quadrature and bins.
#[derive(Clone, Copy)]
enum Case {
    Ggx(Ggx<f64>),
    Beckmann(Beckmann<f64>),
    Quadratic,
}

impl Case {
    /// GGX and Beckmann over roughness and anisotropy, and the quadratic one.
    fn all() -> Vec<Self> {
        let mut cases = vec![Self::Quadratic];
        for (alpha_x, alpha_y) in [
            (0.1, 0.1),
            (0.5, 0.5),
            (1.0, 1.0),
            (2.0, 2.0),
            (0.1, 1.0),
            (0.8, 0.05),
        ] {
            cases.push(Self::Ggx(Ggx { alpha_x, alpha_y }));
            cases.push(Self::Beckmann(Beckmann { alpha_x, alpha_y }));
        }
        cases
    }

    /// Those rough enough in all directions for plain quadrature, and for a
    /// walk's estimates to have light tails.
    fn wide() -> Vec<Self> {
        Self::all()
            .into_iter()
            .filter(|c| c.stretch().0.min(c.stretch().1) >= 0.5)
            .collect()
    }

    fn stretch(self) -> (f64, f64) {
        match self {
            Self::Ggx(d) => (d.alpha_x, d.alpha_y),
            Self::Beckmann(d) => (d.alpha_x, d.alpha_y),
            Self::Quadratic => (1.0, 1.0),
        }
    }

    fn name(self) -> String {
        match self {
            Self::Ggx(d) => format!("{d:?}"),
            Self::Beckmann(d) => format!("{d:?}"),
            Self::Quadratic => "Quadratic".into(),
        }
    }
}

impl Ndf for Case {
    type Scalar = f64;

    fn density(&self, m: Vector3<f64>) -> f64 {
        match self {
            Self::Ggx(d) => d.density(m),
            Self::Beckmann(d) => d.density(m),
            Self::Quadratic => Quadratic::new().density(m),
        }
    }

    fn projected_area(&self, w: Vector3<f64>) -> f64 {
        match self {
            Self::Ggx(d) => d.projected_area(w),
            Self::Beckmann(d) => d.projected_area(w),
            Self::Quadratic => Quadratic::new().projected_area(w),
        }
    }

    fn sample_visible(&self, w: Vector3<f64>, u: [f64; 2]) -> Vector3<f64> {
        match self {
            Self::Ggx(d) => d.sample_visible(w, u),
            Self::Beckmann(d) => d.sample_visible(w, u),
            Self::Quadratic => Quadratic::new().sample_visible(w, u),
        }
    }
}

fn mirror(value: f64) -> Conductor<f64> {
    Conductor {
        fresnel: ConductorFresnel::Constant(Rgb::splat(value)),
    }
}

fn glass(eta: f64) -> Dielectric<f64> {
    Dielectric {
        eta,
        tint: Rgb::white(),
    }
}

fn chalk() -> Diffuse<f64> {
    Diffuse {
        albedo: Rgb::white(),
    }
}

//! The statements that the model must satisfy, and what they are tested with.

mod lanes;
mod model;
mod normals;
mod phases;

use super::*;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// The chance that a correct family of comparisons fails. Seeds are fixed, so
/// a pass stays a pass; the bound says how likely the choice of seed was.
const FALSE_ALARM: f64 = 1e-4;

fn stream(seed: u64) -> Stream<Pcg64Mcg> {
    Stream(Pcg64Mcg::seed_from_u64(seed))
}

/// A number in [0, 1).
fn uniform(rng: &mut Stream<Pcg64Mcg>) -> f64 {
    rng.draw()
}

/// The chance of one comparison of `count` independent ones such that the
/// family has [`FALSE_ALARM`] (Šidák).
fn sidak(count: usize) -> f64 {
    -((-FALSE_ALARM).ln_1p() / count as f64).exp_m1()
}

/// The largest |z| that `count` independent normal scores may reach.
fn worst_score(count: usize) -> f64 {
    Normal::standard().inverse_cdf(1.0 - 0.5 * sidak(count))
}

/// Running mean and its standard error.
#[derive(Clone, Copy, Default)]
struct Mean {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.count += 1.0;
        let d = x - self.mean;
        self.mean += d / self.count;
        self.squares += d * (x - self.mean);
    }

    /// The standard error; never below what rounding does to a constant.
    fn error(&self) -> f64 {
        (self.squares / (self.count - 1.0) / self.count)
            .sqrt()
            .max(1e-12 * self.mean.abs())
    }

    /// Standard scores between this and an exact value.
    fn score(&self, exact: f64) -> f64 {
        (self.mean - exact) / self.error()
    }

    /// Standard scores between two estimates.
    fn score_against(&self, other: &Self) -> f64 {
        (self.mean - other.mean) / self.error().hypot(other.error())
    }
}

/// p-value of Pearson's χ² of `seen` against `expected` counts; bins that
/// expect fewer than 10 are pooled.
fn chi_square(seen: &[f64], expected: &[f64]) -> f64 {
    let (mut sum, mut bins, mut pool) = (0.0, 0.0f64, (0.0, 0.0));
    for (&o, &e) in seen.iter().zip(expected) {
        if e < 10.0 {
            pool = (pool.0 + o, pool.1 + e);
        } else {
            sum += (o - e).powi(2) / e;
            bins += 1.0;
        }
    }
    if pool.1 >= 10.0 {
        sum += (pool.0 - pool.1).powi(2) / pool.1;
        bins += 1.0;
    } else {
        assert!(
            pool.0 <= pool.1 + 60.0,
            "{} samples where {} are expected",
            pool.0,
            pool.1
        );
    }
    1.0 - ChiSquared::new(bins - 1.0)
        .expect("at least two bins")
        .cdf(sum)
}

/// Nodes and weights of Gauss–Legendre quadrature on [0, 1].
fn gauss(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..50 {
                let (mut p, mut before) = (1.0, 0.0);
                for k in 0..n {
                    let k = k as f64;
                    (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 * (x + 1.0), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
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

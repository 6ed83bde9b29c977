//! The domain: roughness, angles, indices, reflectances and random numbers at
//! their extremes.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use smithwalk_model::{ConductorFresnel, Draw, Real, Rgb, Stream, Vector3};

/// Roughness pairs: tiny, huge, and 10⁶ : 1. Zero is no microsurface; the
/// renderer takes a mirror, an interface or Lambert's law there.
pub const ALPHAS: [(f64, f64); 13] = [
    (1e-8, 1e-8),
    (1e-5, 1e-5),
    (1e-3, 1e-3),
    (0.03, 0.03),
    (0.3, 0.3),
    (1.0, 1.0),
    (8.0, 8.0),
    (100.0, 100.0),
    (1e4, 1e4),
    (1e-6, 1.0),
    (1.0, 1e-6),
    (1e-3, 1e3),
    (1e4, 1e-2),
];

/// From exactly 1 to exactly 0; 1e-40 is no normal number in `f32`.
pub const COSINES: [f64; 12] = [
    1.0,
    1.0 - 1e-7,
    0.99995,
    0.7,
    0.1,
    1e-3,
    1e-5,
    1e-8,
    1e-12,
    1e-29,
    1e-40,
    0.0,
];

/// A surface and two directions near grazing.
///
/// Log-uniform over α 1e-8 to 1e4, cosθ 1e-12 to 1, cosθ/α 1e-3 to 1e6 as far as
/// these meet; a surface in four is anisotropic. Three pairs in four are about the
/// mirror direction: cosines within a factor of 3, azimuths within a few α, where
/// the half vector of two grazing directions may be rounding alone.
#[derive(Clone, Copy, Debug)]
pub struct Grazing {
    pub alpha: (f64, f64),
    /// Cosine and azimuth of the two directions.
    pub ends: [(f64, f64); 2],
}

impl Grazing {
    pub fn new(rng: &mut impl Draw<f64>) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * rng.draw();
        let alpha = 10f64.powf(between(-8.0, 4.0));
        let other = if between(0.0, 4.0) < 1.0 {
            10f64.powf(between(-8.0, 4.0))
        } else {
            alpha
        };
        let (low, high) = ((1e-3 * alpha).clamp(1e-12, 1e-3), (1e6 * alpha).min(1.0));
        let [here, there] = [0; 2].map(|_| 10f64.powf(between(low.log10(), high.log10())));
        let phi = between(0.0, 7.0);
        let mirrored = phi + std::f64::consts::PI;
        let near = (here * 3f64.powf(between(-1.0, 1.0))).min(1.0);
        let far = match between(0.0, 4.0) as u32 {
            0 => (there, between(0.0, 7.0)),
            1 => (here, mirrored),
            2 => (near, mirrored + alpha * between(-3.0, 3.0)),
            _ => (near, mirrored + here * between(-3.0, 3.0)),
        };
        Self {
            alpha: (alpha, other),
            ends: [(here, phi), far],
        }
    }
}

/// Relative indices of refraction.
pub const ETAS: [f64; 10] = [
    1e-3,
    0.5,
    1.0 - 1e-4,
    1.0 - 1e-7,
    1.0,
    1.0 + 1e-7,
    1.0 + 1e-5,
    1.5,
    10.0,
    1e3,
];

/// Metals: reflectances exactly 0 and 1, and complex indices up to 10³ + 10⁴ i.
pub fn metals<F: Real>() -> [ConductorFresnel<F>; 8] {
    let rgb = |v: [f64; 3]| Rgb(v.map(F::of));
    [
        ConductorFresnel::Constant(Rgb::white()),
        ConductorFresnel::Constant(Rgb::black()),
        ConductorFresnel::Constant(rgb([1.0, 0.5, 0.0])),
        ConductorFresnel::Complex {
            eta: rgb([1e-3, 1.0, 1e3]),
            k: rgb([1e4, 0.0, 1.0]),
        },
        ConductorFresnel::Complex {
            eta: rgb([1e3, 1.0 + 1e-7, 1e-3]),
            k: rgb([1e4, 1e-7, 0.0]),
        },
        ConductorFresnel::Schlick {
            f0: rgb([0.0, 0.04, 1.0]),
        },
        ConductorFresnel::F82 {
            f0: rgb([0.0, 1.0, 1.0]),
            f82: rgb([1.0, 0.0, 1.0]),
        },
        ConductorFresnel::Dielectric {
            eta: F::of(1.5),
            f0: rgb([0.0, 0.04, 1.0]),
            f90: rgb([1.0, 0.5, 0.0]),
        },
    ]
}

/// A direction at exactly this cosine, also where 1 − cos² rounds to 1 or 0.
pub fn direction<F: Real>(cos: f64, phi: f64) -> Vector3<F> {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    Vector3::new(F::of(sin * phi.cos()), F::of(sin * phi.sin()), F::of(cos))
}

pub fn stream(seed: u64) -> Stream<Pcg64Mcg> {
    Stream(Pcg64Mcg::seed_from_u64(seed))
}

/// The largest number below 1.
pub fn largest<F: Real>() -> F {
    F::one() - F::epsilon() / F::of(2.0)
}

/// Counts draws, and replaces the first of them.
pub struct Metered<'a, F> {
    pub first: &'a [F],
    pub rest: Stream<Pcg64Mcg>,
    pub drawn: usize,
}

impl<'a, F> Metered<'a, F> {
    pub fn new(first: &'a [F], seed: u64) -> Self {
        Self {
            first,
            rest: stream(seed),
            drawn: 0,
        }
    }
}

impl<F: Real> Draw<F> for Metered<'_, F>
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    fn draw(&mut self) -> F {
        self.drawn += 1;
        self.first
            .get(self.drawn - 1)
            .copied()
            .unwrap_or_else(|| self.rest.draw())
    }
}

//! Values of f, averaged.

use glam::Vec3;

use super::TableError;
use crate::bsdf::Bsdf;
use crate::color::Rgb;
use crate::scene::Material;
use rand::SeedableRng;
use smithwalk_model::Stream;

/// Mean, standard error and largest channels of colours, summed in f64.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    /// Σ x.
    pub sum: [f64; 3],
    /// Σ x².
    pub squares: [f64; 3],
    /// The largest x.
    pub largest: [f64; 3],
}

impl Moments {
    /// Adds one value.
    pub fn add(&mut self, value: Rgb) {
        for (channel, x) in value.to_array().into_iter().enumerate() {
            let x = f64::from(x);
            self.sum[channel] += x;
            self.squares[channel] += x * x;
            self.largest[channel] = self.largest[channel].max(x);
        }
    }

    /// Adds all values of another.
    pub fn merge(&mut self, other: &Self) {
        for channel in 0..3 {
            self.sum[channel] += other.sum[channel];
            self.squares[channel] += other.squares[channel];
            self.largest[channel] = self.largest[channel].max(other.largest[channel]);
        }
    }

    /// The mean of `n` values; those that were never added are 0.
    #[must_use]
    pub fn mean(&self, n: u64) -> [f64; 3] {
        self.sum.map(|sum| sum / n as f64)
    }

    /// Standard error of the mean.
    #[must_use]
    pub fn standard_error(&self, n: u64) -> [f64; 3] {
        let n = n as f64;
        [0, 1, 2].map(|c| {
            let mean = self.sum[c] / n;
            ((self.squares[c] / n - mean * mean).max(0.0) / (n - 1.0).max(1.0)).sqrt()
        })
    }
}

/// A mean with its standard error, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub value: [f64; 3],
    /// Its standard error.
    pub error: [f64; 3],
}

/// What tables are made from.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    material: &'a Material,
    samples: u32,
    seed: u64,
}

impl<'a> Source<'a> {
    /// A material, each of whose values is the mean of `samples` estimates (≥ 2).
    ///
    /// # Errors
    /// If it is anisotropic, or has nothing but lobes of no width.
    pub fn new(material: &'a Material, samples: u32, seed: u64) -> Result<Self, TableError> {
        if material.has_tangent() {
            return Err(TableError::Anisotropic);
        }
        if !material.horizontal(Vec3::Z).has_smooth() {
            return Err(TableError::Smooth);
        }
        Ok(Self {
            material,
            samples,
            seed,
        })
    }

    /// Whether light goes through.
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.material.transmits()
    }

    /// Random numbers that belong to this value of `table` alone.
    #[must_use]
    pub fn rng(&self, table: u64, index: u64) -> Stream<rand_pcg::Pcg64Mcg> {
        let seed = self
            .seed
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .wrapping_add(table << 48 | index);
        Stream(rand_pcg::Pcg64Mcg::seed_from_u64(seed))
    }

    /// The material seen from `wo`.
    #[must_use]
    pub fn seen_from(&self, wo: Vec3) -> Bsdf {
        self.material.horizontal(wo)
    }

    /// f(ω_o, ω_i)·|cosθ_i|, sr⁻¹: value `index` of `table`.
    #[must_use]
    pub fn scattered(&self, wo: Vec3, wi: Vec3, table: u64, index: u64) -> Estimate {
        let bsdf = self.seen_from(wo);
        let mut rng = self.rng(table, index);
        let mut moments = Moments::default();
        for _ in 0..self.samples {
            moments.add(bsdf.eval(wo, wi, &mut rng).total());
        }
        let n = u64::from(self.samples);
        Estimate {
            value: moments.mean(n),
            error: moments.standard_error(n),
        }
    }
}

/// The unit vector at polar angle `theta` and azimuth `phi`, radians.
pub(super) fn spherical(theta: f64, phi: f64) -> Vec3 {
    let (sin, cos) = theta.sin_cos();
    Vec3::new(
        (sin * phi.cos()) as f32,
        (sin * phi.sin()) as f32,
        cos as f32,
    )
}

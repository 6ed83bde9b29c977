//! Means of estimates from stratified points.

use super::model::{Rng, stream};
use super::statistics::Mean;
use smithwalk_model::Draw;

/// How many times a mean is taken with another scrambling, to know its error.
pub const REPLICATES: u32 = 32;

/// Dimensions that are stratified: the first orders of both walks.
const STRATIFIED: u32 = 16;

/// The length of the sampler's sequence; past it a new one begins.
const SEQUENCE: u32 = 1 << 16;

/// Owen-scrambled Sobol points (Burley 2020), and random numbers past their
/// first dimensions.
pub struct Sobol {
    index: u32,
    seed: u32,
    dimension: u32,
    block: [f32; 4],
    rest: Rng,
}

impl Sobol {
    /// The next stratified number, if there is one.
    fn stratified(&mut self) -> Option<f32> {
        let d = self.dimension;
        self.dimension += 1;
        if d >= STRATIFIED {
            return None;
        }
        if d % 4 == 0 {
            self.block = sobol_burley::sample_4d(self.index, d / 4, self.seed);
        }
        Some(self.block[(d % 4) as usize])
    }
}

impl Draw<f64> for Sobol {
    fn draw(&mut self) -> f64 {
        let number = self.stratified();
        number.map_or_else(|| self.rest.draw(), f64::from)
    }
}

impl Draw<f32> for Sobol {
    fn draw(&mut self) -> f32 {
        let number = self.stratified();
        number.unwrap_or_else(|| self.rest.draw())
    }
}

/// The means of `N` quantities over [`REPLICATES`] times `samples` points, with the
/// errors that the scramblings show.
pub fn replicated_many<const N: usize>(
    check: u64,
    first_seed: u32,
    samples: u32,
    mut estimate: impl FnMut(&mut Sobol) -> [f64; N],
) -> [Mean; N] {
    let mut means = [Mean::default(); N];
    for seed in first_seed..first_seed + REPLICATES {
        let mut points = Sobol {
            index: 0,
            seed,
            dimension: 0,
            block: [0.0; 4],
            rest: stream(check, seed as usize),
        };
        let mut sums = [0.0; N];
        for i in 0..samples {
            (points.index, points.dimension) = (i % SEQUENCE, 0);
            // The hash of seeds makes every sequence another scrambling.
            points.seed = seed ^ (i / SEQUENCE) << 26;
            for (sum, x) in sums.iter_mut().zip(estimate(&mut points)) {
                *sum += x;
            }
        }
        for (mean, sum) in means.iter_mut().zip(sums) {
            mean.add(sum / f64::from(samples));
        }
    }
    means
}

/// [`replicated_many`] of one quantity.
pub fn replicated(
    check: u64,
    first_seed: u32,
    samples: u32,
    mut estimate: impl FnMut(&mut Sobol) -> f64,
) -> Mean {
    let [mean] = replicated_many(check, first_seed, samples, |rng| [estimate(rng)]);
    mean
}

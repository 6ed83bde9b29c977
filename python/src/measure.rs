//! Monte Carlo over arrays of directions. Every batch of samples has a
//! generator of its own, addressed by seed, point and batch, and batches are
//! added in order: values are the same for any number of threads.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use smithwalk_model::{Estimator, PerOrder, Rgb, Stream, Vector3};

use crate::scatter::{Method, Rng, Sides};

/// Samples of one batch: enough to pay for its generator, few enough to share
/// one point among all cores.
const BATCH: u64 = 4096;

/// A mean per channel with its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Estimate {
    pub mean: [f64; 3],
    pub standard_error: [f64; 3],
}

/// Sums of values and of their squares.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    sum: [f64; 3],
    squares: [f64; 3],
}

impl Moments {
    fn add(&mut self, value: Rgb<f64>) {
        for (c, x) in value.0.into_iter().enumerate() {
            self.sum[c] += x;
            self.squares[c] += x * x;
        }
    }

    fn merge(&mut self, other: &Self) {
        for c in 0..3 {
            self.sum[c] += other.sum[c];
            self.squares[c] += other.squares[c];
        }
    }

    /// Of `n` values, those that were never added being 0.
    fn estimate(&self, n: u64) -> Estimate {
        let n = n as f64;
        let mean = self.sum.map(|sum| sum / n);
        Estimate {
            mean,
            standard_error: [0, 1, 2].map(|c| {
                let variance = (self.squares[c] / n - mean[c] * mean[c]).max(0.0);
                if n > 1.0 {
                    (variance / (n - 1.0)).sqrt()
                } else {
                    f64::NAN
                }
            }),
        }
    }
}

/// The generator of one batch of one point.
fn generator(seed: u64, point: usize, batch: u64) -> Rng {
    // SplitMix64's finaliser (Steele, Lea, Flood 2014) over each coordinate.
    let mix = |mut x: u64| {
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let golden = 0x9e37_79b9_7f4a_7c15_u64;
    let mut state = mix(seed.wrapping_add(golden));
    state = mix(state ^ (point as u64).wrapping_add(golden));
    state = mix(state ^ batch.wrapping_add(golden));
    Stream(Pcg64Mcg::seed_from_u64(state))
}

/// Runs `measure(point, samples, generator)` for every batch of every point,
/// and gives the batches of each point, in order.
fn batched<T: Send>(
    points: usize,
    samples: u64,
    seed: u64,
    measure: impl Fn(usize, u64, &mut Rng) -> T + Sync,
) -> Vec<Vec<T>> {
    let batches = samples.div_ceil(BATCH);
    (0..points)
        .into_par_iter()
        .map(|point| {
            (0..batches)
                .into_par_iter()
                .map(|batch| {
                    let count = BATCH.min(samples - batch * BATCH);
                    measure(point, count, &mut generator(seed, point, batch))
                })
                .collect()
        })
        .collect()
}

fn mirrored(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, v.y, -v.z)
}

fn total(batches: &[Moments]) -> Moments {
    let mut sum = Moments::default();
    batches.iter().for_each(|batch| sum.merge(batch));
    sum
}

/// f(ω_i, ω_o) |cosθ_o|, sr⁻¹, of each pair.
pub fn eval(
    surface: &Sides,
    method: Method,
    wi: &[Vector3<f64>],
    wo: &[Vector3<f64>],
    samples: u64,
    seed: u64,
) -> Vec<Estimate> {
    let batches = batched(wi.len(), samples, seed, |point, count, rng| {
        let mut moments = Moments::default();
        let Some((side, below)) = surface.seen_from(wi[point]) else {
            return moments;
        };
        let frame = if below { mirrored } else { |v| v };
        let (wi, wo) = (frame(wi[point]), frame(wo[point]));
        for _ in 0..count {
            moments.add(side.eval(method, wi, wo, rng));
        }
        moments
    });
    batches
        .iter()
        .map(|batches| total(batches).estimate(samples))
        .collect()
}

/// The same, order by order; the last element has all orders from there on.
pub fn eval_orders(
    surface: &Sides,
    estimator: Estimator,
    wi: &[Vector3<f64>],
    wo: &[Vector3<f64>],
    orders: usize,
    samples: u64,
    seed: u64,
) -> Vec<Vec<Estimate>> {
    let batches = batched(wi.len(), samples, seed, |point, count, rng| {
        let mut moments = vec![Moments::default(); orders];
        let Some((side, below)) = surface.seen_from(wi[point]) else {
            return moments;
        };
        let frame = if below { mirrored } else { |v| v };
        let (wi, wo) = (frame(wi[point]), frame(wo[point]));
        let mut found = PerOrder::default();
        for _ in 0..count {
            found.0.clear();
            side.eval_orders(estimator, wi, wo, rng, &mut found);
            if found.0.len() > orders {
                let rest = found.0.drain(orders..).fold(Rgb::black(), |a, b| a + b);
                found.0[orders - 1] += rest;
            }
            for (moments, value) in moments.iter_mut().zip(&found.0) {
                moments.add(*value);
            }
        }
        moments
    });
    batches
        .into_iter()
        .map(|batches| {
            (0..orders)
                .map(|order| {
                    let batches: Vec<_> = batches.iter().map(|batch| batch[order]).collect();
                    total(&batches).estimate(samples)
                })
                .collect()
        })
        .collect()
}

/// How one walk ended; weight and order are 0 where it was absorbed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    pub direction: [f64; 3],
    pub weight: [f64; 3],
    pub order: u32,
}

fn walk(surface: &Sides, wi: Vector3<f64>, rng: &mut Rng) -> Sample {
    let Some((side, below)) = surface.seen_from(wi) else {
        return Sample::default();
    };
    let frame = if below { mirrored } else { |v| v };
    match side.sample(frame(wi), rng) {
        None => Sample::default(),
        Some(exit) => {
            let direction = frame(exit.direction);
            Sample {
                direction: [direction.x, direction.y, direction.z],
                weight: exit.weight.0,
                order: exit.order,
            }
        }
    }
}

/// One walk from each direction.
pub fn sample(surface: &Sides, wi: &[Vector3<f64>], seed: u64) -> Vec<Sample> {
    wi.par_iter()
        .enumerate()
        .map(|(point, &wi)| walk(surface, wi, &mut generator(seed, point, 0)))
        .collect()
}

/// The proxy density of each pair, sr⁻¹.
pub fn pdf(surface: &Sides, wi: &[Vector3<f64>], wo: &[Vector3<f64>]) -> Vec<f64> {
    wi.par_iter()
        .zip(wo)
        .map(|(&wi, &wo)| match surface.seen_from(wi) {
            None => 0.0,
            Some((side, false)) => side.pdf(wi, wo),
            Some((side, true)) => side.pdf(mirrored(wi), mirrored(wo)),
        })
        .collect()
}

/// What becomes of the light from one direction.
#[derive(Clone, Debug, Default)]
pub struct Albedo {
    pub reflected: Estimate,
    pub transmitted: Estimate,
    /// Share of the light, mean of the channels, by order; the last has all
    /// orders from there on.
    pub orders: Vec<f64>,
    /// Mean number of facets met by a walk that left.
    pub mean_order: f64,
}

/// Directional albedos, by `samples` walks from each direction.
pub fn albedo(
    surface: &Sides,
    wi: &[Vector3<f64>],
    orders: usize,
    samples: u64,
    seed: u64,
) -> Vec<Albedo> {
    struct Sums {
        sides: [Moments; 2],
        orders: Vec<f64>,
        facets: u64,
        left: u64,
    }
    let none = || Sums {
        sides: [Moments::default(); 2],
        orders: vec![0.0; orders],
        facets: 0,
        left: 0,
    };
    let batches = batched(wi.len(), samples, seed, |point, count, rng| {
        let mut sums = none();
        for _ in 0..count {
            let end = walk(surface, wi[point], rng);
            if end.order == 0 {
                continue;
            }
            let transmitted = end.direction[2] * wi[point].z < 0.0;
            sums.sides[usize::from(transmitted)].add(Rgb(end.weight));
            sums.orders[(end.order as usize).min(orders) - 1] +=
                end.weight.iter().sum::<f64>() / 3.0;
            sums.facets += u64::from(end.order);
            sums.left += 1;
        }
        sums
    });
    let one = |batches: Vec<Sums>| {
        let mut all = none();
        for batch in batches {
            all.sides[0].merge(&batch.sides[0]);
            all.sides[1].merge(&batch.sides[1]);
            all.orders
                .iter_mut()
                .zip(batch.orders)
                .for_each(|(a, b)| *a += b);
            all.facets += batch.facets;
            all.left += batch.left;
        }
        Albedo {
            reflected: all.sides[0].estimate(samples),
            transmitted: all.sides[1].estimate(samples),
            orders: all.orders.iter().map(|sum| sum / samples as f64).collect(),
            mean_order: all.facets as f64 / all.left as f64,
        }
    };
    batches.into_iter().map(one).collect()
}

/// Weight that walks from `wi` carry into each of `bins` = [cosines, azimuths]
/// bins of equal solid angle over the whole sphere, divided by that solid
/// angle: the mean of f |cosθ_o| over the bin, sr⁻¹.
pub fn lobe(
    surface: &Sides,
    wi: Vector3<f64>,
    bins: [usize; 2],
    samples: u64,
    seed: u64,
) -> Vec<Estimate> {
    let [rows, columns] = bins;
    let count = rows * columns;
    let per_steradian = count as f64 / (4.0 * std::f64::consts::PI);
    let batches = batched(1, samples, seed, |_, walks, rng| {
        let mut moments = vec![Moments::default(); count];
        for _ in 0..walks {
            let end = walk(surface, wi, rng);
            if end.order == 0 {
                continue;
            }
            let [x, y, z] = end.direction;
            let turn = (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0);
            let row = (((1.0 - z) / 2.0 * rows as f64) as usize).min(rows - 1);
            let column = ((turn * columns as f64) as usize).min(columns - 1);
            moments[row * columns + column].add(Rgb(end.weight) * per_steradian);
        }
        moments
    });
    (0..count)
        .map(|bin| {
            let of_bin: Vec<_> = batches[0].iter().map(|batch| batch[bin]).collect();
            total(&of_bin).estimate(samples)
        })
        .collect()
}

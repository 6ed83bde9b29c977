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

/// Unit vectors as numpy holds them: three numbers each, in place.
#[derive(Clone, Copy)]
pub struct Directions<'a>(pub &'a [f64]);

impl Directions<'_> {
    pub fn len(self) -> usize {
        self.0.len() / 3
    }

    fn at(self, point: usize) -> Vector3<f64> {
        let at = &self.0[3 * point..3 * point + 3];
        Vector3::new(at[0], at[1], at[2])
    }
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

    /// Of `n` values, those that were never added being 0.
    fn estimate(&self, n: u64) -> Estimate {
        let mut found = Estimate {
            mean: self.sum,
            standard_error: [f64::NAN; 3],
        };
        if n > 1 {
            let n = n as f64;
            for c in 0..3 {
                let mean = self.sum[c] / n;
                let variance = (self.squares[c] / n - mean * mean).max(0.0);
                found.mean[c] = mean;
                found.standard_error[c] = (variance / (n - 1.0)).sqrt();
            }
        }
        found
    }
}

impl Merge for Moments {
    fn merge(&mut self, other: &Self) {
        for c in 0..3 {
            self.sum[c] += other.sum[c];
            self.squares[c] += other.squares[c];
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

/// What batches of samples add up to.
trait Merge: Send {
    fn merge(&mut self, other: &Self);
}

impl<T: Merge> Merge for Vec<T> {
    fn merge(&mut self, other: &Self) {
        self.iter_mut().zip(other).for_each(|(a, b)| a.merge(b));
    }
}

/// Batches of one point that are held at a time.
const HELD: u64 = 64;

/// Points of one task, at least: a point of few samples takes less than handing it over.
const POINTS: usize = 64;

/// Runs `measure(point, samples, generator)` for every batch of every point, and
/// gives what each point's batches add up to, in order.
fn batched<T: Merge>(
    points: usize,
    samples: u64,
    seed: u64,
    measure: impl Fn(usize, u64, &mut Rng) -> T + Send + Sync,
) -> impl IndexedParallelIterator<Item = T> {
    let batches = samples.div_ceil(BATCH);
    let whole = move |point| {
        let batch = |batch| {
            let count = BATCH.min(samples - batch * BATCH);
            measure(point, count, &mut generator(seed, point, batch))
        };
        let mut sum = batch(0);
        for first in (1..batches).step_by(HELD as usize) {
            let held = first..batches.min(first + HELD);
            let found: Vec<T> = held.into_par_iter().map(batch).collect();
            found.iter().for_each(|found| sum.merge(found));
        }
        sum
    };
    let least = if batches > 1 { 1 } else { POINTS };
    (0..points).into_par_iter().with_min_len(least).map(whole)
}

/// In the frame of the side that is looked at.
fn framed(below: bool, v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, v.y, if below { -v.z } else { v.z })
}

/// f(ω_i, ω_o) |cosθ_o|, sr⁻¹, of each pair: means and their standard errors, which
/// single samples have none of.
pub fn eval(
    surface: &Sides,
    method: Method,
    wi: Directions<'_>,
    wo: Directions<'_>,
    samples: u64,
    seed: u64,
) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let found = batched(wi.len(), samples, seed, |point, count, rng| {
        let mut moments = Moments::default();
        let Some((side, below)) = surface.seen_from(wi.at(point)) else {
            return moments;
        };
        let (wi, wo) = (framed(below, wi.at(point)), framed(below, wo.at(point)));
        for _ in 0..count {
            moments.add(side.eval(method, wi, wo, rng));
        }
        moments
    });
    if samples == 1 {
        return (found.map(|moments| moments.sum).collect(), Vec::new());
    }
    let estimates = found.map(|moments| {
        let found = moments.estimate(samples);
        (found.mean, found.standard_error)
    });
    estimates.unzip()
}

/// The same, order by order; the last element has all orders from there on.
pub fn eval_orders(
    surface: &Sides,
    estimator: Estimator,
    wi: Directions<'_>,
    wo: Directions<'_>,
    orders: usize,
    samples: u64,
    seed: u64,
) -> Vec<Vec<Estimate>> {
    batched(wi.len(), samples, seed, |point, count, rng| {
        let mut moments = vec![Moments::default(); orders];
        let Some((side, below)) = surface.seen_from(wi.at(point)) else {
            return moments;
        };
        let (wi, wo) = (framed(below, wi.at(point)), framed(below, wo.at(point)));
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
    })
    .map(|moments| moments.iter().map(|m| m.estimate(samples)).collect())
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
    match side.sample(framed(below, wi), rng) {
        None => Sample::default(),
        Some(exit) => {
            let direction = framed(below, exit.direction);
            Sample {
                direction: [direction.x, direction.y, direction.z],
                weight: exit.weight.0,
                order: exit.order,
            }
        }
    }
}

/// One walk from each direction.
pub fn sample(surface: &Sides, wi: Directions<'_>, seed: u64) -> Vec<Sample> {
    (0..wi.len())
        .into_par_iter()
        .map(|point| walk(surface, wi.at(point), &mut generator(seed, point, 0)))
        .collect()
}

/// The proxy density of each pair, sr⁻¹.
pub fn pdf(surface: &Sides, wi: Directions<'_>, wo: Directions<'_>) -> Vec<f64> {
    (0..wi.len())
        .into_par_iter()
        .map(|point| (wi.at(point), wo.at(point)))
        .map(|(wi, wo)| match surface.seen_from(wi) {
            None => 0.0,
            Some((side, below)) => side.pdf(framed(below, wi), framed(below, wo)),
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

/// Sums over walks from one direction.
struct Sums {
    sides: [Moments; 2],
    orders: Vec<f64>,
    facets: u64,
    left: u64,
}

impl Merge for Sums {
    fn merge(&mut self, other: &Self) {
        self.sides[0].merge(&other.sides[0]);
        self.sides[1].merge(&other.sides[1]);
        self.orders
            .iter_mut()
            .zip(&other.orders)
            .for_each(|(a, b)| *a += b);
        self.facets += other.facets;
        self.left += other.left;
    }
}

/// Directional albedos, by `samples` walks from each direction.
pub fn albedo(
    surface: &Sides,
    wi: Directions<'_>,
    orders: usize,
    samples: u64,
    seed: u64,
) -> Vec<Albedo> {
    batched(wi.len(), samples, seed, |point, count, rng| {
        let mut sums = Sums {
            sides: [Moments::default(); 2],
            orders: vec![0.0; orders],
            facets: 0,
            left: 0,
        };
        for _ in 0..count {
            let end = walk(surface, wi.at(point), rng);
            if end.order == 0 {
                continue;
            }
            let transmitted = end.direction[2] * wi.at(point).z < 0.0;
            sums.sides[usize::from(transmitted)].add(Rgb(end.weight));
            sums.orders[(end.order as usize).min(orders) - 1] +=
                end.weight.iter().sum::<f64>() / 3.0;
            sums.facets += u64::from(end.order);
            sums.left += 1;
        }
        sums
    })
    .map(|sums| Albedo {
        reflected: sums.sides[0].estimate(samples),
        transmitted: sums.sides[1].estimate(samples),
        orders: sums.orders.iter().map(|sum| sum / samples as f64).collect(),
        mean_order: sums.facets as f64 / sums.left as f64,
    })
    .collect()
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
    batched(1, samples, seed, |_, walks, rng| {
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
    })
    .flat_map_iter(|bins| bins.into_iter().map(|m| m.estimate(samples)))
    .collect()
}

//! How heavy the tail of estimates is: whether their standard error can be trusted.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Above this tail index a mean of so many estimates is not yet near normal, and its
/// standard error says little: rare ones that are larger still have likely not come. From
/// 1/2 on the variance is infinite as far as the estimates tell (Vehtari, Simpson, Gelman,
/// Yao and Gabry 2024, "Pareto Smoothed Importance Sampling", § 3).
pub const HEAVY: f64 = 0.7;

/// The fewest positive estimates from which a tail is known.
const FEWEST: usize = 25;

/// The most that are kept.
const MOST: usize = 1000;

/// The largest of many estimates.
pub struct Tail {
    /// Bits of positive numbers, which are in the order of the numbers.
    kept: BinaryHeap<Reverse<u64>>,
    capacity: usize,
}

impl Tail {
    /// For `samples` estimates, of which 3√samples are their tail.
    pub fn new(samples: u64) -> Self {
        let tail = (3.0 * (samples as f64).sqrt()).min(MOST as f64);
        Self {
            kept: BinaryHeap::new(),
            capacity: tail as usize + 1,
        }
    }

    /// Adds an estimate; those of 0 have no part in a tail.
    pub fn add(&mut self, value: f32) {
        if value <= 0.0 || value.is_nan() {
            return;
        }
        let bits = f64::from(value).to_bits();
        if self.kept.len() < self.capacity {
            self.kept.push(Reverse(bits));
        } else if self.kept.peek().is_some_and(|least| least.0 < bits) {
            self.kept.pop();
            self.kept.push(Reverse(bits));
        }
    }

    /// Hill's 1975 estimate of the tail index ξ: the chance of more than x falls as
    /// x^(−1/ξ), and the variance is finite for ξ < 1/2. `None` where too few estimates
    /// are positive to tell.
    pub fn index(&self) -> Option<f64> {
        if self.kept.len() < FEWEST {
            return None;
        }
        let least = f64::from_bits(self.kept.peek()?.0);
        let logs = self.kept.iter().map(|x| (f64::from_bits(x.0) / least).ln());
        Some(logs.sum::<f64>() / (self.kept.len() - 1) as f64)
    }

    /// Whether the standard error of the mean says little.
    pub fn is_heavy(&self) -> bool {
        self.index().is_none_or(|index| index > HEAVY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Estimates u^(−ξ) have the tail index ξ.
    fn index_of(exponent: f64) -> f64 {
        let mut tail = Tail::new(100_000);
        for i in 0..100_000 {
            let u = (f64::from(i) + 0.5) / 1e5;
            tail.add(u.powf(-exponent) as f32);
        }
        tail.index().unwrap()
    }

    #[test]
    fn the_index_is_that_of_the_tail() {
        for exponent in [0.0, 0.25, 0.5, 1.3] {
            let found = index_of(exponent);
            assert!((found - exponent).abs() < 0.02, "{exponent}: {found}");
        }
    }

    #[test]
    fn a_few_estimates_are_no_tail() {
        let mut tail = Tail::new(1000);
        for _ in 0..1000 {
            tail.add(0.0);
        }
        for _ in 0..24 {
            tail.add(1.0);
        }
        assert!(tail.index().is_none() && tail.is_heavy());
        tail.add(1.0);
        assert!(!tail.is_heavy());
    }
}

//! Sums that do not depend on the order of their terms, so that films can be merged
//! in any order and have the bits of one that was never apart.
//!
//! The number line of exponents is cut into bins of [`BITS`] bits. A term is cut at
//! the same places into integers, one for each bin that its significant bits reach, and
//! integers add up exactly. Of all bins a sum keeps the two highest that a term has
//! begun in (Demmel and Nguyen 2015, "Parallel Reproducible Summation", IEEE Trans.
//! Comput. 64(7), the indexed format with K = 2; here with integers). What it drops is
//! below 2⁻³⁸ of its largest term, for each term.

/// Bits of a bin. With 2²⁴ terms a bin's sum has 62 bits.
const BITS: i32 = 38;

/// The bin of sums without terms: below all others.
const EMPTY: i8 = i8::MIN;

/// Many sums, in arrays: 17 bytes each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct ExactSums {
    /// The highest bin of each sum.
    bins: Vec<i8>,
    /// What is in it, in units of 2^(38 · bin).
    high: Vec<i64>,
    /// What is in the bin below.
    low: Vec<i64>,
}

impl ExactSums {
    /// So many sums without terms.
    pub fn new(count: usize) -> Self {
        Self {
            bins: vec![EMPTY; count],
            high: vec![0; count],
            low: vec![0; count],
        }
    }

    /// Adds a finite term to the sum at `index`: a single-precision number or the
    /// square of one, at most 2²⁴ of them in all.
    #[inline]
    pub fn add(&mut self, index: usize, term: f64) {
        debug_assert!(term.is_finite());
        if term == 0.0 {
            return;
        }
        let (mantissa, exponent) = split(term);
        let top = exponent + (64 - mantissa.leading_zeros() as i32) - 1;
        let bin = top.div_euclid(BITS) as i8;
        self.raise(index, bin);
        let sign = if term < 0.0 { -1 } else { 1 };
        match self.bins[index] - bin {
            0 => {
                self.high[index] += sign * slice(mantissa, exponent, bin);
                self.low[index] += sign * slice(mantissa, exponent, bin - 1);
            }
            1 => self.low[index] += sign * slice(mantissa, exponent, bin),
            _ => {}
        }
    }

    /// Adds all the sums of `other`, of which there are as many.
    pub fn merge(&mut self, other: &Self) {
        for index in 0..other.bins.len() {
            let bin = other.bins[index];
            self.raise(index, bin);
            // `raise` has made the difference positive; an empty sum has nothing to add.
            match self.bins[index].wrapping_sub(bin) {
                0 => {
                    self.high[index] += other.high[index];
                    self.low[index] += other.low[index];
                }
                1 => self.low[index] += other.high[index],
                _ => {}
            }
        }
    }

    /// Makes `bin` the highest of the sum if it is above that.
    #[inline]
    fn raise(&mut self, index: usize, bin: i8) {
        let above = i32::from(bin) - i32::from(self.bins[index]);
        if above > 0 {
            self.low[index] = if above == 1 { self.high[index] } else { 0 };
            self.high[index] = 0;
            self.bins[index] = bin;
        }
    }

    /// The sum at `index`, rounded once.
    pub fn get(&self, index: usize) -> f64 {
        if self.bins[index] == EMPTY {
            return 0.0;
        }
        let units = (i128::from(self.high[index]) << BITS) + i128::from(self.low[index]);
        let exponent = BITS * (i32::from(self.bins[index]) - 1);
        units as f64 * 2f64.powi(exponent)
    }

    /// Bytes on the heap.
    pub fn bytes(&self) -> usize {
        self.bins.len() * (size_of::<i8>() + 2 * size_of::<i64>())
    }

    /// Appends all bits, for [`Self::read`].
    pub fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.bins.iter().map(|bin| bin.to_le_bytes()[0]));
        for value in self.high.iter().chain(&self.low) {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// What [`Self::write`] has written, [`Self::bytes`] long; `None` when it is of
    /// another length or says what no sum of at most 2²⁴ terms can.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let count = bytes.len() / (size_of::<i8>() + 2 * size_of::<i64>());
        let (bins, values) = bytes.split_at(count);
        if values.len() != count * 2 * size_of::<i64>() {
            return None;
        }
        let bins: Vec<i8> = bins.iter().map(|&bin| bin as i8).collect();
        let mut values = values
            .chunks_exact(8)
            .map(|value| i64::from_le_bytes(value.try_into().expect("chunks of eight")));
        let high: Vec<i64> = values.by_ref().take(count).collect();
        let low: Vec<i64> = values.collect();
        let possible = |index: usize| {
            let most = 1_u64 << (BITS + 24);
            let within = |value: i64| value.unsigned_abs() <= most;
            match bins[index] {
                EMPTY => high[index] == 0 && low[index] == 0,
                bin => BINS.contains(&bin) && within(high[index]) && within(low[index]),
            }
        };
        (0..count).all(possible).then_some(Self { bins, high, low })
    }
}

/// The bins of squares of single-precision numbers, from 2⁻²⁹⁸ to 2²⁵⁶.
const BINS: std::ops::RangeInclusive<i8> = -8..=6;

/// `mantissa`, `exponent` of |term| = mantissa · 2^exponent.
#[inline]
fn split(term: f64) -> (u64, i32) {
    let bits = term.to_bits();
    let fraction = bits & ((1 << 52) - 1);
    match ((bits >> 52) & 0x7ff) as i32 {
        0 => (fraction, -1074),
        exponent => (fraction | (1 << 52), exponent - 1075),
    }
}

/// The bits of mantissa · 2^exponent that are in `bin`, in its unit.
#[inline]
fn slice(mantissa: u64, exponent: i32, bin: i8) -> i64 {
    let shift = exponent - BITS * i32::from(bin);
    let bits = match shift {
        0.. => u128::from(mantissa) << shift,
        -63..0 => u128::from(mantissa >> -shift),
        _ => 0,
    };
    (bits & ((1 << BITS) - 1)) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    /// Numbers of any size and sign, as a render may have them and worse.
    fn terms(count: usize) -> Vec<f64> {
        let mut rng = Pcg32::seed_from_u64(1);
        let mut term = || {
            let exponent = rng.random_range(-60..60);
            let x = rng.random_range(-1.0f32..1.0) * 2f32.powi(exponent);
            if rng.next_u32() % 2 == 0 {
                f64::from(x)
            } else {
                f64::from(x) * f64::from(x)
            }
        };
        (0..count).map(|_| term()).collect()
    }

    fn sum(terms: impl IntoIterator<Item = f64>) -> ExactSums {
        let mut sums = ExactSums::new(1);
        terms.into_iter().for_each(|term| sums.add(0, term));
        sums
    }

    #[test]
    fn the_order_of_terms_and_parts_changes_no_bit() {
        let terms = terms(3000);
        let whole = sum(terms.iter().copied());
        assert_eq!(sum(terms.iter().rev().copied()), whole);
        for parts in [2, 7, 3000] {
            let mut merged = ExactSums::new(1);
            for part in (0..parts).rev() {
                merged.merge(&sum(terms.iter().copied().skip(part).step_by(parts)));
            }
            assert_eq!(merged, whole, "{parts} parts");
        }
    }

    /// Against sums in 128-bit integers, for terms with 20 bits below one.
    #[test]
    fn terms_of_like_size_add_up_exactly() {
        let mut rng = Pcg32::seed_from_u64(2);
        let integers: Vec<i32> = (0..1000)
            .map(|_| rng.random_range(-(1 << 23)..1 << 23))
            .collect();
        let exact: i128 = integers.iter().map(|&i| i128::from(i)).sum();
        let scale = 2f64.powi(-20);
        let found = sum(integers.iter().map(|&i| f64::from(i) * scale));
        assert_eq!(found.get(0), exact as f64 * scale);
    }

    #[test]
    fn any_single_precision_number_comes_back_and_so_does_its_square() {
        for x in [
            1.0,
            1e-20,
            1e20,
            f32::MAX,
            f32::MIN_POSITIVE,
            f32::from_bits(1),
            -0.3,
        ] {
            let x = f64::from(x);
            assert_eq!(sum([x]).get(0), x);
            assert!((sum([x * x]).get(0) / (x * x) - 1.0).abs() < 1e-11, "{x}");
        }
        assert_eq!(sum([]).get(0), 0.0);
    }

    #[test]
    fn sums_come_back_from_bytes_and_impossible_ones_do_not() {
        let mut sums = ExactSums::new(3);
        sums.add(0, 2.5);
        sums.add(2, -1e-9);
        let mut bytes = Vec::new();
        sums.write(&mut bytes);
        assert_eq!(ExactSums::read(&bytes), Some(sums));
        assert_eq!(ExactSums::read(&bytes[..bytes.len() - 1]), None);
        for (position, value) in [(0, 100), (1, 0x80_u8.wrapping_add(1)), (10, 0x7f)] {
            let mut bytes = bytes.clone();
            bytes[position] = value;
            assert_eq!(ExactSums::read(&bytes), None, "{position}");
        }
    }
}

//! Uniform random numbers.

use rand::Rng;

/// A source of uniform numbers in [0, 1): 0 may come, 1 never does.
///
/// A walk draws in a fixed order, the most telling first: for its first facet
/// the two numbers of the micro-normal, what the facet needs (the Fresnel
/// choice, or the two numbers of a cosine lobe), and whether the light leaves
/// or how deep it was; the walks of evaluation begin with the depth. A renderer
/// may feed well-stratified numbers to these and a plain generator to the rest.
pub trait Draw<F> {
    /// The next number.
    fn draw(&mut self) -> F;

    /// Says that the numbers from here on are for another walk, whose first ones
    /// tell the most again.
    fn next_walk(&mut self) {}
}

/// A random generator as a source of uniform numbers. The topmost 24 bits
/// (53 for `f64`) are kept, so that rounding can't reach 1.
#[derive(Clone, Debug)]
pub struct Stream<R>(pub R);

impl<R: Rng> Draw<f32> for Stream<R> {
    #[inline]
    fn draw(&mut self) -> f32 {
        const STEP: f32 = 1.0 / (1 << 24) as f32;
        (self.0.next_u32() >> 8) as f32 * STEP
    }
}

impl<R: Rng> Draw<f64> for Stream<R> {
    #[inline]
    fn draw(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1u64 << 53) as f64;
        (self.0.next_u64() >> 11) as f64 * STEP
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rand_core::{Infallible, TryRng};

    /// All bits set: the largest number a generator can give.
    struct Ones;

    impl TryRng for Ones {
        type Error = Infallible;
        fn try_next_u32(&mut self) -> Result<u32, Infallible> {
            Ok(u32::MAX)
        }
        fn try_next_u64(&mut self) -> Result<u64, Infallible> {
            Ok(u64::MAX)
        }
        fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
            bytes.fill(u8::MAX);
            Ok(())
        }
    }

    #[test]
    fn the_largest_number_stays_below_one() {
        let single: f32 = Stream(Ones).draw();
        assert_eq!(single, 1.0 - f32::EPSILON / 2.0);
        let double: f64 = Stream(Ones).draw();
        assert_eq!(double, 1.0 - f64::EPSILON / 2.0);
    }
}

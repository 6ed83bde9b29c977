//! The random numbers of several walks at once.

use rand::Rng;
use rand_pcg::Pcg32;
use wide::f32x8;

use super::{mix, sobol_4d};
use smithwalk_model::{Draw, LANES};

/// The numbers of one walk in each lane, in [0, 1): as many stratified ones for the
/// first order or two as a set has, and any number of independent ones after them.
/// Nothing is computed before it is asked for.
#[derive(Clone, Debug)]
pub struct LaneStream {
    key: u64,
    /// Of each lane's sample in the sequence.
    indices: [u32; LANES],
    /// The set, whose last `left` numbers are still to come, once there is one.
    numbers: [f32x8; 4],
    left: usize,
    /// Sets that are still to come.
    sets: u32,
    tails: Option<[Pcg32; LANES]>,
}

impl LaneStream {
    /// The samples `indices` < 2¹⁶ of the sequence scrambled by `key`.
    #[inline]
    pub(super) fn new(key: u64, indices: [u32; LANES], sets: u32) -> Self {
        Self {
            key,
            indices,
            numbers: [f32x8::ZERO; 4],
            left: 0,
            sets,
            tails: None,
        }
    }

    #[inline]
    fn begin(&mut self) {
        let points = self.indices.map(|index| sobol_4d(index, self.key));
        self.numbers = [0, 1, 2, 3].map(|d| points.map(|point| point[d]).into());
        self.left = 4;
        self.sets -= 1;
        self.key = mix(self.key);
    }

    #[inline]
    fn next_of_tails(&mut self) -> f32x8 {
        let (key, indices) = (self.key, self.indices);
        let tails = self.tails.get_or_insert_with(|| {
            indices.map(|index| Pcg32::new(mix(key ^ (u64::from(index) << 32)), key))
        });
        // The 24 bits that a f32 below 1 can hold, hence never rounded up to 1.
        let bits = tails.each_mut().map(|tail| (tail.next_u32() >> 8) as f32);
        f32x8::from(bits) * f32x8::from(1.0 / (1 << 24) as f32)
    }
}

impl Draw<f32x8> for LaneStream {
    #[inline]
    fn draw(&mut self) -> f32x8 {
        if self.left == 0 {
            if self.sets == 0 {
                return self.next_of_tails();
            }
            self.begin();
        }
        self.left -= 1;
        self.numbers[3 - self.left]
    }

    #[inline]
    fn next_walk(&mut self) {
        self.key = mix(self.key ^ u64::from(u32::MAX));
        self.left = 0;
        self.sets = 1;
        self.tails = None;
    }
}

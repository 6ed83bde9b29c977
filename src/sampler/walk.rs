//! The random numbers of one walk at a time.

use rand::Rng;
use rand_pcg::Pcg32;

use super::{mix, sobol_4d};
use smithwalk_model::Draw;

/// Sets of four stratified numbers that a walk has: enough for two orders.
pub(super) const WALK_SETS: u32 = 2;

/// The random numbers of microsurface walks at one vertex, in [0, 1): stratified
/// ones for the first orders of each, and any number of independent ones after
/// them. Nothing is computed before it is asked for.
#[derive(Clone, Debug)]
pub struct WalkStream {
    key: u64,
    index: u32,
    /// The current set; the last `left` are still to come.
    numbers: [f32; 4],
    left: usize,
    /// Sets begun by this walk.
    sets: u32,
    tail: Option<Pcg32>,
}

impl WalkStream {
    /// Of sample `index` of the sequence scrambled by `key`, with its first set if that
    /// is known.
    #[inline]
    pub(super) fn new(key: u64, index: u32, first: Option<[f32; 4]>) -> Self {
        Self {
            key,
            index,
            numbers: first.unwrap_or_default(),
            left: if first.is_some() { 4 } else { 0 },
            sets: u32::from(first.is_some()),
            tail: None,
        }
    }

    /// The next number, with 23 random bits or more; never 1.
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        if self.left == 0 {
            if self.sets == WALK_SETS {
                return self.next_of_tail();
            }
            self.next_set();
        }
        self.left -= 1;
        self.numbers[3 - self.left]
    }

    #[inline]
    fn next_set(&mut self) {
        if self.sets > 0 {
            self.key = mix(self.key);
        }
        self.numbers = sobol_4d(self.index, self.key);
        self.left = 4;
        self.sets += 1;
    }

    fn next_of_tail(&mut self) -> f32 {
        let (key, index) = (self.key, u64::from(self.index));
        let tail = self
            .tail
            .get_or_insert_with(|| Pcg32::new(mix(key ^ (index << 32)), key));
        // The 24 bits that a f32 below 1 can hold, hence never rounded up to 1.
        (tail.next_u32() >> 8) as f32 * (1.0 / (1 << 24) as f32)
    }
}

impl Draw<f32> for WalkStream {
    #[inline]
    fn draw(&mut self) -> f32 {
        self.next_f32()
    }

    #[inline]
    fn next_walk(&mut self) {
        // Sets of its own, under other keys than those that are used up.
        self.key = mix(self.key ^ u64::from(u32::MAX));
        self.left = 0;
        self.sets = 0;
        self.tail = None;
    }
}

//! Numbers for eight walks that share an end, from those of one.

use wide::{CmpGe, f32x8};

use super::LANES;
use crate::Draw;

/// Gives every lane the next number of one stream, moved on by a multiple of 1/8 of its
/// own, modulo 1 (Cranley and Patterson 1976, "Randomization of Number Theoretic
/// Methods for Multiple Integration"). Each lane by itself has numbers as good as the
/// stream's; the eight are stratified, and cost little more than one.
pub(super) struct Rotated<'a, R> {
    numbers: &'a mut R,
    /// Numbers drawn for this walk.
    drawn: usize,
}

impl<'a, R> Rotated<'a, R> {
    pub fn new(numbers: &'a mut R) -> Self {
        Self { numbers, drawn: 0 }
    }
}

/// The first eight points of Sobol's sequence in four dimensions, in eighths.
const EIGHTHS: [[u8; LANES]; 4] = [
    [0, 4, 2, 6, 1, 5, 3, 7],
    [0, 4, 6, 2, 5, 1, 3, 7],
    [0, 4, 6, 2, 3, 7, 5, 1],
    [0, 4, 6, 2, 1, 5, 7, 3],
];

impl<R: Draw<f32>> Draw<f32x8> for Rotated<'_, R> {
    #[inline]
    fn draw(&mut self) -> f32x8 {
        let eighths = EIGHTHS[self.drawn % EIGHTHS.len()];
        self.drawn += 1;
        let moved = f32x8::from(eighths.map(|n| f32::from(n) / 8.0)) + self.numbers.draw();
        moved.cmp_ge(f32x8::ONE).blend(moved - f32x8::ONE, moved)
    }

    #[inline]
    fn next_walk(&mut self) {
        self.numbers.next_walk();
        self.drawn = 0;
    }
}

//! Mirrors, eight walks at a time: one in each lane of a vector
//! register, in single precision. The model is that of the scalar code, which is what
//! this is tested against.

mod beckmann;
mod eval;
mod math;
mod ndf;
mod rotated;
mod sample;

pub use beckmann::BeckmannLanes;
pub use math::Directions;
pub use ndf::{GgxLanes, NdfInLanes, NdfLanes};

#[cfg(test)]
pub(super) use beckmann::{erf_inv_of_twice_less_one, ierfc};

use wide::{CmpEq, CmpGt, CmpLt, f32x8};

use super::Draw;
use super::walk::{Roulette, chance_of_long};

/// Walks at a time.
pub const LANES: usize = 8;

/// Plays roulette as [`Roulette::survives`]: the lanes that go on.
#[inline]
fn survivors(
    roulette: Roulette,
    weight: &mut [f32x8; 3],
    scale: f32x8,
    order: u32,
    rng: &mut impl Draw<f32x8>,
) -> f32x8 {
    let brightest = weight[0].fast_max(weight[1]).fast_max(weight[2]);
    if order < roulette.from {
        return brightest.cmp_gt(f32x8::ZERO);
    }
    let mut chance =
        (brightest / (f32x8::from(roulette.weight as f32) * scale)).fast_min(f32x8::ONE);
    if let Some(long) = chance_of_long(order) {
        chance *= f32x8::from(long as f32);
    }
    if !chance.cmp_lt(f32x8::ONE).any() {
        return f32x8::ZERO.cmp_eq(f32x8::ZERO);
    }
    for weight in weight {
        *weight /= chance;
    }
    rng.draw().cmp_lt(chance)
}

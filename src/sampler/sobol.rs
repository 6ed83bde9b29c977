//! Points of Sobol's sequence, scrambled as Owen does.

use sobol_burley::parts::{owen_scramble_int4_rev, owen_scramble_rev};

use super::mix;

/// Length of the Sobol sequence as a power of two; later samples start another
/// one, scrambled afresh.
pub(super) const LOG2_SEQUENCE: u32 = 16;

/// Four dimensions of sample `index` < 2¹⁶ of the Sobol sequence scrambled by
/// `key`, in [0, 1).
///
/// Bits are in reverse order, as the hash that stands for Owen's scrambling
/// wants them. The index is scrambled too, which shuffles the sequence but keeps
/// any 2^k first samples together with their strata, so that sets of different
/// keys are independent.
#[inline]
pub(super) fn sobol_4d(index: u32, key: u64) -> [f32; 4] {
    let scrambles = [mix(key ^ 1), mix(key ^ 2)].map(|bits| [bits as u32, (bits >> 32) as u32]);
    let index = owen_scramble_rev(index.reverse_bits(), (key >> 32) as u32);
    let mut point = [0; 4];
    for (nibble, vectors) in VECTORS.iter().enumerate() {
        let terms = vectors[(index >> (28 - 4 * nibble)) as usize & 15];
        for (point, term) in point.iter_mut().zip(terms) {
            *point ^= term;
        }
    }
    let [[a, b], [c, d]] = scrambles;
    owen_scramble_int4_rev(point.into(), [a, b, c, d].into())
        .reverse_bits()
        .to_f32_norm()
}

/// The sums (XOR) of direction vectors that belong to each value of each four
/// bits of a reversed 16-bit index, for four dimensions at a time. Adding up one
/// bit at a time takes several times as long, for want of predictable branches.
static VECTORS: [[[u32; 4]; 16]; LOG2_SEQUENCE as usize / 4] = {
    let mut sums = [[[0; 4]; 16]; LOG2_SEQUENCE as usize / 4];
    let mut dimension = 0;
    while dimension < 4 {
        let vectors = direction_vectors(DIRECTIONS[dimension]);
        let mut bit = 0;
        while bit < LOG2_SEQUENCE as usize {
            let mut value = 0;
            while value < 16 {
                // The first bit of a reversed index is its highest.
                if (value >> (3 - bit % 4)) & 1 == 1 {
                    sums[bit / 4][value][dimension] ^= vectors[bit].reverse_bits();
                }
                value += 1;
            }
            bit += 1;
        }
        dimension += 1;
    }
    sums
};

/// Degree, inner coefficients of the primitive polynomial, and initial direction
/// numbers of Sobol's first dimensions (Joe and Kuo 2008, "Constructing Sobol
/// Sequences with Better Two-Dimensional Projections", SIAM J. Sci. Comput.
/// 30(5)). The first dimension has none: van der Corput's sequence.
const DIRECTIONS: [(usize, u32, [u32; 3]); 4] = [
    (0, 0, [0; 3]),
    (1, 0, [1, 0, 0]),
    (2, 1, [1, 3, 0]),
    (3, 1, [1, 3, 1]),
];

/// Direction vectors v₁ … v₁₆ as binary fractions, from their recurrence.
const fn direction_vectors(
    (degree, coefficients, initial): (usize, u32, [u32; 3]),
) -> [u32; LOG2_SEQUENCE as usize] {
    let mut vectors = [0; LOG2_SEQUENCE as usize];
    let mut k = 0;
    while k < vectors.len() {
        vectors[k] = if degree == 0 {
            1 << (31 - k)
        } else if k < degree {
            initial[k] << (31 - k)
        } else {
            let mut vector = vectors[k - degree] ^ (vectors[k - degree] >> degree);
            let mut term = 1;
            while term < degree {
                if (coefficients >> (degree - 1 - term)) & 1 == 1 {
                    vector ^= vectors[k - term];
                }
                term += 1;
            }
            vector
        };
        k += 1;
    }
    vectors
}

#[cfg(test)]
mod tests {
    use super::*;
    use sobol_burley::parts::Int4;

    /// The points before scrambling, against an independent implementation.
    #[test]
    fn direction_vectors_are_sobols() {
        for index in (0..1 << 16).step_by(37) {
            let reversed = (index as u32).reverse_bits();
            for dimension in 0..4 {
                let nibbles = VECTORS.iter().enumerate();
                let terms =
                    nibbles.map(|(i, v)| v[(reversed >> (28 - 4 * i)) as usize & 15][dimension]);
                let expected = sobol_burley::parts::sobol_rev(reversed, dimension as u32);
                let found = terms.fold(0, |sum, term| sum ^ term);
                assert_eq!(found, expected, "sample {index}, dimension {dimension}");
            }
        }
    }

    /// The largest words that Sobol and PCG can give stay below 1.
    #[test]
    fn the_largest_number_is_below_one() {
        assert!((u32::MAX >> 8) as f32 * (1.0 / (1 << 24) as f32) < 1.0);
        let largest = Int4::from([u32::MAX; 4]);
        assert!(largest.to_f32_norm().iter().all(|&u| u < 1.0));
    }
}

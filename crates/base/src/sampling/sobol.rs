//! The first four dimensions of the Sobol sequence with Owen scrambling.
//!
//! Few points are spread best in these dimensions, so every set of a sample uses them, each with its own seed. The seed
//! also shuffles the order of the points, so sets are independent of each other (padding, Burley 2020). Direction
//! numbers: Joe & Kuo 2008, `new-joe-kuo-6`. The coordinates of a point are the XOR of one direction number for each
//! bit of its index; the table here combines four bits into one entry.

use crate::math::ToInt;
use sobol_burley::parts::{Int4, hash, hash_int4, owen_scramble_int4_rev, owen_scramble_rev};

/// Number of bits of a point index.
const BITS: usize = 16;

/// Degree and inner coefficients of each dimension's primitive polynomial, and its first direction numbers.
const DIMENSIONS: [(usize, u32, [u32; 3]); 4] =
    [(0, 0, [0; 3]), (1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

/// Bit-reversed direction numbers of the four dimensions for each bit of the index, lowest bit first.
const DIRECTIONS: [[u32; 4]; BITS] = directions();

/// XOR contribution of each value of each group of four index bits, lowest group first.
const TABLE: [[[u32; 4]; 16]; BITS / 4] = table();

const fn directions() -> [[u32; 4]; BITS] {
    let mut all = [[0; 4]; BITS];
    let mut d = 0;
    while d < 4 {
        let (degree, inner, first) = DIMENSIONS[d];
        let mut m = [1u32; BITS];
        let mut k = 0;
        while k < BITS {
            if k < degree {
                m[k] = first[k];
            } else if degree > 0 {
                // Recurrence of Bratley & Fox 1988.
                let mut next = m[k - degree] ^ m[k - degree] << degree;
                let mut j = 1;
                while j < degree {
                    if inner >> (degree - 1 - j) & 1 == 1 {
                        next ^= m[k - j] << j;
                    }
                    j += 1;
                }
                m[k] = next;
            }
            all[k][d] = (m[k] << (31 - k)).reverse_bits();
            k += 1;
        }
        d += 1;
    }
    all
}

const fn table() -> [[[u32; 4]; 16]; BITS / 4] {
    let mut table = [[[0; 4]; 16]; BITS / 4];
    let mut k = 0;
    while k < 16 * BITS {
        let (bits, value, bit) = (k / 64, k / 4 % 16, k % 4);
        if value >> bit & 1 == 1 {
            let mut d = 0;
            while d < 4 {
                table[bits][value][d] ^= DIRECTIONS[4 * bits + bit][d];
                d += 1;
            }
        }
        k += 1;
    }
    table
}

/// Returns the coordinates in [0, 1) of point `index` (below 2¹⁶). Points of one seed are well distributed, points of
/// different seeds are independent. Bit-identical to the crate's `sample_4d` for set 0.
#[inline]
pub(super) fn point(index: u32, seed: u32) -> [f32; 4] {
    // Shuffle the order of the points as well.
    let index = owen_scramble_rev(index.reverse_bits(), hash(seed ^ 0x79c6_8e4a)).reverse_bits();
    let entry = |bits: usize| Int4::from(TABLE[bits][(index >> (4 * bits) & 15).to_usize()]);
    let sum = entry(0) ^ entry(1) ^ entry(2) ^ entry(3);
    let seed = Int4::from([seed.wrapping_mul(0x9c8f_2d3b); 4]);
    let scramble = seed ^ Int4::from([0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8]);
    owen_scramble_int4_rev(sum, hash_int4(scramble)).reverse_bits().to_f32_norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a wrong bit in a table is easily missed. Expected: bit-identical to the crate, for indices of all
    /// magnitudes and several seeds. Source: `sobol_burley::sample_4d`.
    #[test]
    fn points_are_those_of_the_crate() {
        for seed in [0, 1, 77, 0xdead_beef, u32::MAX] {
            for index in (0..300).chain((300..1 << BITS).step_by(97)) {
                assert_eq!(point(index, seed), sobol_burley::sample_4d(index, 0, seed), "point {index}, seed {seed}");
            }
        }
    }
}

//! The Sobol' sequence in eight dimensions and its hash-based Owen scrambling.
//!
//! Direction numbers: S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections",
//! SIAM J. Sci. Comput. 30 (2008), the first eight dimensions of their set D6. Scrambling: B. Burley, "Practical
//! Hash-based Owen Scrambling", JCGT 9(4) (2020). Differs: matrices are kept bit-reversed on both sides, because the
//! scramble works on reversed numbers (Burley section 2.2 reverses before and after every hash); and the matrix product
//! takes four index bits at a time from a table of 4 KiB.

/// Dimensions of the point set.
pub const DIMENSIONS: u32 = 8;

/// Degree, inner coefficients and first direction integers of each primitive polynomial; dimension 0 is van der Corput's.
const POLYNOMIALS: [(u32, u32, [u32; 5]); 7] = [
    (1, 0, [1, 0, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0]),
    (4, 4, [1, 3, 5, 13, 0]),
    (5, 2, [1, 1, 5, 5, 17]),
];

/// Direction number of index bit `bit` in `dimension`, the binary point left of bit 31.
const fn direction(dimension: usize, bit: usize) -> u32 {
    if dimension == 0 {
        return 1 << (31 - bit);
    }
    let (degree, coefficients, first) = POLYNOMIALS[dimension - 1];
    let degree = degree as usize;
    let mut m = [0_u32; 32];
    let mut i = 0;
    while i <= bit {
        if i < degree {
            m[i] = first[i];
        } else {
            // The recurrence of Joe and Kuo, equation 2.
            let mut value = m[i - degree] ^ (m[i - degree] << degree);
            let mut k = 1;
            while k < degree {
                if coefficients >> (degree - 1 - k) & 1 == 1 {
                    value ^= m[i - k] << k;
                }
                k += 1;
            }
            m[i] = value;
        }
        i += 1;
    }
    m[bit] << (31 - bit)
}

/// `rows[position][nibble][dimension]`: the reversed point for `nibble` at bits `4 * position..` of the reversed index.
#[repr(align(64))]
struct Table {
    rows: [[[u32; 8]; 16]; 8],
}

static TABLE: Table = Table { rows: table() };

const fn table() -> [[[u32; 8]; 16]; 8] {
    let mut rows = [[[0_u32; 8]; 16]; 8];
    let mut dimension = 0;
    while dimension < 8 {
        let mut position = 0;
        while position < 8 {
            let mut nibble = 1;
            while nibble < 16 {
                let low = nibble & (nibble - 1);
                let reversed_bit = 4 * position + (nibble as u32).trailing_zeros() as usize;
                rows[position][nibble][dimension] =
                    rows[position][low][dimension] ^ direction(dimension, 31 - reversed_bit).reverse_bits();
                nibble += 1;
            }
            position += 1;
        }
        dimension += 1;
    }
    rows
}

/// The table that the matrix product is taken from, for back ends that take it elsewhere: by position (0 to 7), nibble (0 to 15) and
/// dimension (0 to 7), the bit-reversed point of the nibble at that position of the bit-reversed index.
pub fn reversed_rows() -> &'static [[[u32; 8]; 16]; 8] {
    &TABLE.rows
}

/// The point of `index` in `dimension`, unscrambled: 32 bits after the binary point. Dimensions are taken modulo 8.
#[inline]
pub fn sobol(index: u32, dimension: u32) -> u32 {
    reversed_sobol(index.reverse_bits(), dimension).reverse_bits()
}

/// [`sobol`] with index and result bit-reversed. Costs four table reads for indices below 65,536.
#[inline]
pub(crate) fn reversed_sobol(reversed_index: u32, dimension: u32) -> u32 {
    debug_assert!(dimension < DIMENSIONS, "the point set has eight dimensions");
    let dimension = (dimension % DIMENSIONS) as usize;
    let entry = |position: usize| TABLE.rows[position][(reversed_index >> (4 * position) & 15) as usize][dimension];
    let low_index_bits = entry(7) ^ entry(6) ^ entry(5) ^ entry(4);
    if reversed_index & 0xffff == 0 {
        low_index_bits
    } else {
        low_index_bits ^ entry(3) ^ entry(2) ^ entry(1) ^ entry(0)
    }
}

/// A nested uniform scramble of a bit-reversed number: each bit is flipped by a hash of the bits below it and `seed`.
///
/// Laine and Karras, "Stratified Sampling for Stochastic Transparency" (EGSR 2011), section 3.1. Differs: the multipliers and the
/// extra multiplication by the seed are N. Vegdahl's (2021, <https://psychopath.io/post/2021_01_30_building_a_better_lk_hash>),
/// because the original constants leave visible correlation between seeds.
#[inline]
pub(crate) const fn reversed_owen_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// A nested uniform (Owen) scramble: a permutation of the 32-bit numbers that keeps every elementary interval together
/// and moves it at random, by `seed`.
#[inline]
pub const fn owen_scramble(x: u32, seed: u32) -> u32 {
    reversed_owen_scramble(x.reverse_bits(), seed).reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::mix;
    use crate::statistics::{chi_square_p, pooled_chi_square};

    #[test]
    fn first_points_are_those_of_the_literature() {
        // Joe and Kuo's first points, in the order of the plain binary index.
        let half = 1 << 31;
        let quarter = 1 << 30;
        for dimension in 0..DIMENSIONS {
            assert_eq!(sobol(0, dimension), 0);
            assert_eq!(sobol(1, dimension), half);
        }
        let second: Vec<u32> = (0..8).map(|d| sobol(2, d) / quarter).collect();
        assert_eq!(second, [1, 3, 3, 3, 1, 1, 3, 1]);
    }

    #[test]
    fn direction_numbers_follow_the_recurrence() {
        // m_1.. of each dimension as tabulated by an independent implementation.
        let expected: [[u32; 8]; 8] = [
            [1, 1, 1, 1, 1, 1, 1, 1],
            [1, 3, 5, 15, 17, 51, 85, 255],
            [1, 3, 3, 9, 29, 23, 71, 197],
            [1, 3, 1, 5, 31, 29, 81, 147],
            [1, 1, 1, 11, 31, 55, 61, 157],
            [1, 1, 3, 3, 25, 9, 43, 251],
            [1, 3, 5, 13, 11, 37, 31, 227],
            [1, 1, 5, 5, 17, 9, 9, 45],
        ];
        for (dimension, row) in expected.iter().enumerate() {
            let m: Vec<u32> = (0..8).map(|bit| direction(dimension, bit) >> (31 - bit)).collect();
            assert_eq!(m, row);
        }
    }

    #[test]
    fn table_agrees_with_the_bit_by_bit_product() {
        for i in 0..2000_u32 {
            let index = if i < 500 { i } else { mix(i) };
            for dimension in 0..DIMENSIONS {
                let product = (0..32)
                    .filter(|bit| index >> bit & 1 == 1)
                    .fold(0, |sum, bit| sum ^ direction(dimension as usize, bit));
                assert_eq!(sobol(index, dimension), product);
            }
        }
    }

    /// Whether `points` has one point in each elementary interval of each shape.
    fn is_net(points: &[(u32, u32)]) -> bool {
        let log = points.len().trailing_zeros();
        (0..=log).all(|a| {
            let mut seen = vec![false; points.len()];
            for &(x, y) in points {
                let cell = (u64::from(x) >> (32 - a)) << (log - a) | u64::from(y) >> (32 - (log - a));
                seen[cell as usize] = true;
            }
            seen.into_iter().all(|s| s)
        })
    }

    #[test]
    fn scrambled_dimensions_are_nets() {
        for seed in 0..20 {
            for log in 0..=10 {
                // Any aligned block of the index, not only the first.
                let first = mix(seed ^ 77) >> log << log;
                let point = |i: u32, d: u32| owen_scramble(sobol(first + i, d), mix(seed * 8 + d));
                let pairs: Vec<(u32, u32)> = (0..1 << log).map(|i| (point(i, 0), point(i, 1))).collect();
                assert!(is_net(&pairs), "dimensions 0 and 1 form a (0, m, 2)-net");
                for d in 0..DIMENSIONS {
                    let mut strata: Vec<u32> = (0..1 << log)
                        .map(|i| (u64::from(point(i, d)) >> (32 - log)) as u32)
                        .collect();
                    strata.sort_unstable();
                    assert!(
                        strata.iter().enumerate().all(|(i, &s)| s == i as u32),
                        "one point per stratum"
                    );
                }
            }
        }
    }

    #[test]
    fn scramble_is_nested() {
        for i in 0..500_u32 {
            let (x, seed) = (mix(i), mix(i + 10_000));
            for prefix in 1..32 {
                let y = x ^ (1 << (31 - prefix));
                let difference = owen_scramble(x, seed) ^ owen_scramble(y, seed);
                assert_eq!(
                    difference.leading_zeros(),
                    prefix,
                    "equal prefixes stay equal, the next bit differs"
                );
            }
        }
    }

    /// Every point alone is uniform over the seeds, in bins of 1/256. Each p-value is below its limit once in 10,000
    /// runs over all 64.
    #[test]
    fn scrambled_points_are_uniform_over_seeds() {
        let seeds = 1 << 15;
        for index in 0..64_u32 {
            let mut bins = vec![0_u64; 256];
            for seed in 0..seeds {
                bins[(owen_scramble(sobol(index, 3), mix(seed + 1)) >> 24) as usize] += 1;
            }
            let expected = vec![f64::from(seeds) / 256.0; 256];
            let (statistic, dof) = pooled_chi_square(&bins, &expected, 5.0);
            assert!(chi_square_p(statistic, dof) > 1e-4 / 64.0);
        }
    }
}

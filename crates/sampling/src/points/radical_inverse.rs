//! The radical inverse and its variants: what Halton and Hammersley points are made of.

use crate::hash::{hash2, mix};

/// The bases of the dimensions of [`crate::points::PointSet::Halton`].
pub const PRIMES: [u32; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];

/// Permuted digits without end are cut off at this weight: as fine as the 32 bits of other random numbers, and finer.
const LEAST_WEIGHT: f64 = 1e-11;

/// Mirrors the digits of `index` in `base` (at least 2) at the point: `index = sum a_k b^k` gives `sum a_k b^(-k-1)`.
///
/// J. G. van der Corput, "Verteilungsfunktionen" (1935).
///
/// ```
/// use sampling::points::radical_inverse;
/// // 6 is 110 in base 2; mirrored, 0.011 = 3/8.
/// assert_eq!(radical_inverse(2, 6), 0.375);
/// ```
pub fn radical_inverse(base: u32, mut index: u32) -> f64 {
    let step = 1.0 / f64::from(base);
    let (mut weight, mut sum) = (step, 0.0);
    while index > 0 {
        sum += weight * f64::from(index % base);
        weight *= step;
        index /= base;
    }
    sum
}

/// The folded radical inverse: digit `k` becomes `(a_k + k) mod b`, zeros without end included.
///
/// S. K. Zaremba's folding ("The mathematical basis of Monte Carlo and quasi-Monte Carlo methods", SIAM Review 10, 1968): it breaks
/// the order in which the plain radical inverse creeps up from 0, and so lowers the discrepancy.
pub fn folded_radical_inverse(base: u32, index: u32) -> f64 {
    permuted_radical_inverse(base, index, |position, digit| (digit + position) % base)
}

/// The radical inverse under a nested random permutation of its digits: `d -> (a d + c) mod b`, where `a` and `c` are random
/// for every sequence of digits that went before.
///
/// A. B. Owen, "Randomly permuted (t,m,s)-nets" (1995) with the affine permutations of J. Matousek, "On the L2-discrepancy for
/// anchored boxes" (1998); `base` must be prime. The result is uniform in `[0, 1)`, over seeds, for every index.
pub fn scrambled_radical_inverse(base: u32, index: u32, seed: u32) -> f64 {
    // A hash of all digits so far.
    let mut path = mix(seed);
    permuted_radical_inverse(base, index, |_, digit| {
        // 16 bits each: the bias towards small digits is below b / 65,536.
        let factor = 1 + (path & 0xffff) * (base - 1) / 0x1_0000;
        let offset = (path >> 16) * base / 0x1_0000;
        path = hash2(path, digit);
        (digit * factor + offset) % base
    })
}

/// The radical inverse with digit `a_k` replaced by `permute(k, a_k)`, until further digits do not matter.
fn permuted_radical_inverse(base: u32, mut index: u32, mut permute: impl FnMut(u32, u32) -> u32) -> f64 {
    let step = 1.0 / f64::from(base);
    let (mut weight, mut sum, mut position) = (step, 0.0, 0);
    while weight > LEAST_WEIGHT {
        sum += weight * f64::from(permute(position, index % base));
        weight *= step;
        index /= base;
        position += 1;
    }
    // Rounding may reach 1 where all digits are the largest.
    sum.min(1.0 - f64::EPSILON / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_values_are_those_of_the_literature() {
        let corput: Vec<f64> = (0..8).map(|i| radical_inverse(2, i)).collect();
        assert_eq!(corput, [0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875]);
        let third: Vec<f64> = (0..6).map(|i| radical_inverse(3, i) * 9.0).collect();
        for (value, expected) in third.iter().zip([0.0, 3.0, 6.0, 1.0, 4.0, 7.0]) {
            assert!((value - expected).abs() < 1e-14);
        }
        // 0 folds to 0.010101..., 1 to 0.110101...: 1/3 and 5/6.
        assert!((folded_radical_inverse(2, 0) - 1.0 / 3.0).abs() < 1e-10);
        assert!((folded_radical_inverse(2, 1) - 5.0 / 6.0).abs() < 1e-10);
    }

    /// Each of the `base^2` intervals of that length gets one of the first `base^2` points, whatever the variant.
    #[test]
    fn every_variant_is_stratified() {
        for base in [2, 3, 5, 7] {
            let variants: [&dyn Fn(u32) -> f64; 3] = [
                &|i| radical_inverse(base, i),
                &|i| folded_radical_inverse(base, i),
                &|i| scrambled_radical_inverse(base, i, 77),
            ];
            for variant in variants {
                let mut seen = vec![0; (base * base) as usize];
                for i in 0..base * base {
                    // The plain variant lies on the lower ends of the intervals.
                    seen[(variant(i) * f64::from(base * base) + 1e-9) as usize] += 1;
                }
                assert!(seen.iter().all(|&count| count == 1), "{base}: {seen:?}");
            }
        }
    }
}

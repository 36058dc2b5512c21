//! Integer hashes with full avalanche: every input bit flips every output bit with a probability close to one half.
//!
//! Everything is done in 32 bits, so that a shader can do exactly the same.

/// Mixes 32 bits. A bijection, so different inputs never collide; 0 is mapped to itself.
///
/// The constants are "lowbias32", found by C. Wellons' search for the least avalanche bias, "Prospecting for Hash
/// Functions" (2018), <https://nullprogram.com/blog/2018/07/31/>.
#[inline]
pub const fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// 2^32 divided by the golden ratio, odd: steps of this size spread counters evenly over 32 bits.
pub(crate) const GOLDEN: u32 = 0x9e37_79b9;

/// Hashes two numbers; the order matters. For a given `a` a bijection of `b`.
#[inline]
pub const fn hash2(a: u32, b: u32) -> u32 {
    mix(mix(a.wrapping_add(GOLDEN)) ^ b)
}

/// Hashes three numbers; the order matters. For given `a` and `b` a bijection of `c`.
#[inline]
pub const fn hash3(a: u32, b: u32, c: u32) -> u32 {
    mix(hash2(a, b) ^ c)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worst deviation from 1/2 of the probability that flipping input bit i flips output bit j.
    fn avalanche_bias(function: impl Fn(u32) -> u32) -> f64 {
        let trials = 4096_u32;
        let mut flips = [[0_u32; 32]; 32];
        for trial in 0..trials {
            let x = trial.wrapping_mul(0x9e37_79b1) ^ 0x5bd1_e995;
            let y = function(x);
            for (i, row) in flips.iter_mut().enumerate() {
                let changed = y ^ function(x ^ 1 << i);
                for (j, count) in row.iter_mut().enumerate() {
                    *count += changed >> j & 1;
                }
            }
        }
        flips
            .iter()
            .flatten()
            .map(|&count| (f64::from(count) / f64::from(trials) - 0.5).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn every_input_bit_flips_every_output_bit_half_of_the_time() {
        // Standard error 1/128; the largest of 1,024 normal deviates stays below 4.9 of them 99.9 % of the time.
        let limit = 4.9 / 128.0;
        assert!(avalanche_bias(mix) < limit);
        assert!(avalanche_bias(|x| hash2(x, 7)) < limit);
        assert!(avalanche_bias(|x| hash2(7, x)) < limit);
        assert!(avalanche_bias(|x| hash3(7, 8, x)) < limit);
        assert!(avalanche_bias(|x| hash3(x, 7, 8)) < limit);
    }

    #[test]
    fn order_matters() {
        assert_ne!(hash2(1, 2), hash2(2, 1));
        assert_ne!(hash3(1, 2, 3), hash3(3, 2, 1));
        assert_ne!(hash3(1, 2, 3), hash3(1, 3, 2));
    }

    #[test]
    fn mix_is_a_bijection_on_a_sample() {
        let mut images: Vec<u32> = (0..1 << 18).map(|i| mix(i * 0x3fff)).collect();
        images.sort_unstable();
        images.dedup();
        assert_eq!(images.len(), 1 << 18);
    }
}

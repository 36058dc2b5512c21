//! Multiple importance sampling weights: E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation" (1997), section 9.2.
//!
//! Written as ratios: the textbook form squares densities, and a density of 1e20 squared is infinite in `f32`.

/// Balance heuristic: the weight of a sample drawn with density `a` where the other technique has density `b` (each
/// times its number of samples, same measure). In `[0, 1]` for every input; a density that is zero, negative or NaN
/// counts as "never"; `balance(a, b) + balance(b, a)` is 1 unless both are.
#[inline]
pub fn balance(a: f32, b: f32) -> f32 {
    weight(a, b, |ratio| ratio)
}

/// Power heuristic with exponent 2; otherwise as [`balance`].
#[inline]
pub fn power(a: f32, b: f32) -> f32 {
    weight(a, b, |ratio| ratio * ratio)
}

#[inline]
fn weight(a: f32, b: f32, shape: impl Fn(f32) -> f32) -> f32 {
    let possible = |density: f32| density > 0.0;
    if !possible(a) {
        0.0
    } else if !possible(b) {
        1.0
    } else if a == b {
        // Also both infinite, where the ratio would be NaN.
        0.5
    } else {
        1.0 / (1.0 + shape(b / a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const EDGE: [f32; 10] = [0.0, 1e-45, 1e-38, 1e-20, 0.5, 1.0, 1e20, 1e38, f32::MAX, f32::INFINITY];

    #[test]
    fn edge_cases_are_weights_that_sum_to_one() {
        for heuristic in [balance, power] {
            for a in EDGE {
                for b in EDGE {
                    let sum = heuristic(a, b) + heuristic(b, a);
                    assert!((0.0..=1.0).contains(&heuristic(a, b)));
                    let expected = if a == 0.0 && b == 0.0 { 0.0 } else { 1.0 };
                    assert!((sum - expected).abs() < 1e-6, "{a} {b}: {sum}");
                }
            }
            assert_eq!(heuristic(f32::NAN, 1.0), 0.0);
            assert_eq!(heuristic(1.0, f32::NAN), 1.0);
            assert_eq!(heuristic(-1.0, 1.0), 0.0);
        }
    }

    proptest! {
        #[test]
        fn agrees_with_the_textbook(a in 1e-6_f32..1e6, b in 1e-6_f32..1e6) {
            let (x, y) = (f64::from(a), f64::from(b));
            prop_assert!((f64::from(balance(a, b)) - x / (x + y)).abs() < 1e-6);
            prop_assert!((f64::from(power(a, b)) - x * x / (x * x + y * y)).abs() < 1e-6);
        }
    }
}

//! Multiple importance sampling weights: E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation" (1997), section 9.2.
//!
//! Written as ratios: the textbook form squares densities, and a density of 1e20 squared is infinite in `f32`.

/// A way to share a contribution among the techniques that could have found it.
///
/// With `q_i` the density of technique `i` times its number of samples, a sample of technique `i` gets the weight below. Whatever
/// the heuristic, the weights of a point sum to 1 over the techniques, so the sum of all weighted contributions is unbiased.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Heuristic {
    /// `q_i / sum q_k`. Veach's theorem 9.2: no choice of weights has a variance that is smaller by more than
    /// `(1 / min n_i - 1 / sum n_i)` times the squared integral.
    #[default]
    Balance,
    /// `q_i^2 / sum q_k^2`: decides more sharply, which pays where one technique is nearly perfect.
    Power,
    /// As balance, but techniques below a tenth of the largest `q` get nothing.
    Cutoff,
    /// The technique with the largest `q` gets everything, the first of equal ones.
    Maximum,
}

impl Heuristic {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Balance, Self::Power, Self::Cutoff, Self::Maximum];

    /// Share of the largest `q` below which [`Heuristic::Cutoff`] gives nothing; Veach's section 9.2.2 uses 0.1 as an example.
    const CUTOFF: f64 = 0.1;

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Balance => "balance",
            Self::Power => "power",
            Self::Cutoff => "cutoff",
            Self::Maximum => "maximum",
        }
    }

    /// The weight of a sample of technique `own`, where `q` are the densities of all techniques at the sample, each times its
    /// number of samples. 0 if `own` could not have found it.
    ///
    /// ```
    /// use sampling::mis::Heuristic;
    /// assert_eq!(Heuristic::Balance.weight(0, &[3.0, 1.0]), 0.75);
    /// assert_eq!(Heuristic::Power.weight(0, &[1.0, 0.5]), 0.8);
    /// assert_eq!(Heuristic::Cutoff.weight(1, &[30.0, 1.0]), 0.0);
    /// assert_eq!(Heuristic::Maximum.weight(0, &[3.0, 1.0]), 1.0);
    /// ```
    pub fn weight(self, own: usize, q: &[f64]) -> f64 {
        let largest = q.iter().copied().fold(0.0, f64::max);
        if largest.is_nan() || largest <= 0.0 {
            return 0.0;
        }
        let first_of_largest = q.iter().position(|&q| q == largest);
        let share = |k: usize| {
            // Relative to the largest, so that no square overflows.
            let ratio = q[k] / largest;
            match self {
                Self::Balance => ratio,
                Self::Power => ratio * ratio,
                Self::Cutoff if ratio < Self::CUTOFF => 0.0,
                Self::Cutoff => ratio,
                Self::Maximum if first_of_largest == Some(k) => 1.0,
                Self::Maximum => 0.0,
            }
        };
        share(own) / (0..q.len()).map(share).sum::<f64>()
    }
}

impl Heuristic {
    /// [`Heuristic::weight`] of the first of two techniques with densities `a` and `b` (each times its number of samples), in `f32` and safe for
    /// densities that are zero, infinite or no number, as [`balance`] is.
    #[inline]
    pub fn of_two(self, a: f32, b: f32) -> f32 {
        match self {
            Self::Balance => balance(a, b),
            Self::Power => power(a, b),
            Self::Cutoff => weight(a, b, |ratio| {
                let cutoff = Self::CUTOFF as f32;
                if ratio < cutoff {
                    0.0
                } else if ratio * cutoff > 1.0 {
                    f32::INFINITY
                } else {
                    ratio
                }
            }),
            // Equal ones share, since neither is the first.
            Self::Maximum => weight(a, b, |ratio| if ratio < 1.0 { 0.0 } else { f32::INFINITY }),
        }
    }
}

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
        let heuristics = Heuristic::ALL.map(|h| move |a, b| h.of_two(a, b));
        for heuristic in heuristics {
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

    #[test]
    fn weights_of_all_techniques_sum_to_one() {
        for heuristic in Heuristic::ALL {
            for q in [&[1.0][..], &[0.0, 2.0], &[1.0, 1.0, 1.0], &[1e-300, 1e300, 1e300, 5.0]] {
                let sum: f64 = (0..q.len()).map(|own| heuristic.weight(own, q)).sum();
                assert!((sum - 1.0).abs() < 1e-15, "{heuristic:?} {q:?}");
            }
            assert_eq!(heuristic.weight(0, &[0.0, 0.0]), 0.0);
        }
    }

    proptest! {
        #[test]
        fn two_techniques_are_weighed_as_any_number(a in 1e-6_f32..1e6, b in 1e-6_f32..1e6) {
            for heuristic in Heuristic::ALL {
                let expected = heuristic.weight(0, &[f64::from(a), f64::from(b)]);
                prop_assert!((f64::from(heuristic.of_two(a, b)) - expected).abs() < 1e-6 || a == b);
            }
        }

        #[test]
        fn agrees_with_the_textbook(a in 1e-6_f32..1e6, b in 1e-6_f32..1e6) {
            let (x, y) = (f64::from(a), f64::from(b));
            prop_assert!((f64::from(balance(a, b)) - x / (x + y)).abs() < 1e-6);
            prop_assert!((f64::from(power(a, b)) - x * x / (x * x + y * y)).abs() < 1e-6);
        }
    }
}

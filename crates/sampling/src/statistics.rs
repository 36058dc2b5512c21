//! Moments of samples, and the p-values statistical tests are decided by.

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};
use statrs::function::{erf::erfc, gamma::gamma_ur};

/// Running mean and variance (B. P. Welford, "Note on a Method for Calculating Corrected Sums of Squares and Products", 1962) in `f64`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Adds a sample.
    #[inline]
    pub fn push(&mut self, x: f64) {
        self.count += 1;
        let delta = x - self.mean;
        self.mean += delta / self.count as f64;
        self.squares += delta * (x - self.mean);
    }

    /// Adds all samples of `other`: Chan, Golub, LeVeque (1979), equation 2.1.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (n, m) = (self.count as f64, other.count as f64);
        let delta = other.mean - self.mean;
        self.count += other.count;
        self.mean += delta * m / (n + m);
        self.squares += other.squares + delta * delta * n * m / (n + m);
    }

    /// Number of samples.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean of the samples; 0 if there are none.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased variance of a sample; 0 for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            0.0
        } else {
            self.squares / (self.count - 1) as f64
        }
    }

    /// Standard error of the mean; 0 for fewer than two samples.
    pub fn standard_error(&self) -> f64 {
        if self.count < 2 {
            0.0
        } else {
            (self.variance() / self.count as f64).sqrt()
        }
    }
}

/// Probability that a chi-square variable of `dof` degrees of freedom exceeds `statistic`. 1 for `dof` 0 or a statistic
/// that is not positive, 0 for an infinite one; a NaN statistic gives 0, so that it fails a test.
pub fn chi_square_p(statistic: f64, dof: usize) -> f64 {
    if statistic.is_nan() || statistic == f64::INFINITY {
        0.0
    } else if dof == 0 || statistic <= 0.0 {
        1.0
    } else {
        gamma_ur(dof as f64 / 2.0, statistic / 2.0)
    }
}

/// Probability that a standard normal variable is at least as far from 0 as `z`; a NaN gives 0, so that it fails a test.
pub fn normal_p_two_sided(z: f64) -> f64 {
    if z.is_nan() {
        0.0
    } else {
        erfc(z.abs() / std::f64::consts::SQRT_2)
    }
}

/// The value that a Student-t variable of `dof` degrees of freedom stays below with probability `p`. NaN if `dof` is 0 or `p`
/// is not in `(0, 1)`.
pub fn student_t_quantile(p: f64, dof: usize) -> f64 {
    let possible = p > 0.0 && p < 1.0;
    match StudentsT::new(0.0, 1.0, dof as f64) {
        Ok(distribution) if possible => distribution.inverse_cdf(p),
        _ => f64::NAN,
    }
}

/// The value that a chi-square variable of `dof` degrees of freedom stays below with probability `p`. NaN if `dof` is 0 or `p`
/// is not in `(0, 1)`.
pub fn chi_square_quantile(p: f64, dof: usize) -> f64 {
    let possible = p > 0.0 && p < 1.0;
    match ChiSquared::new(dof as f64) {
        Ok(distribution) if possible => distribution.inverse_cdf(p),
        _ => f64::NAN,
    }
}

/// Significance for each of `n` independent tests such that any of them fails with probability `alpha`: Z. Sidak (1967).
pub fn sidak(alpha: f64, n: usize) -> f64 {
    -((-alpha).ln_1p() / n.max(1) as f64).exp_m1()
}

/// Pearson's statistic and its degrees of freedom for `observed` counts against `expected` ones (same total).
///
/// Bins expecting fewer than `min_expected` (5 is customary) are pooled in order. An observation where none is
/// expected gives infinity.
pub fn pooled_chi_square(observed: &[u64], expected: &[f64], min_expected: f64) -> (f64, usize) {
    let mut pool = (0.0, 0.0);
    let mut statistic = 0.0;
    let mut bins = 0_usize;
    let mut term = |observed: f64, expected: f64| {
        statistic += (observed - expected).powi(2) / expected;
        bins += 1;
    };
    for (&count, &expectation) in observed.iter().zip(expected) {
        if expectation <= 0.0 && count > 0 {
            return (f64::INFINITY, observed.len().saturating_sub(1));
        }
        if expectation >= min_expected {
            term(count as f64, expectation);
        } else {
            pool = (pool.0 + count as f64, pool.1 + expectation);
            if pool.1 >= min_expected {
                term(pool.0, pool.1);
                pool = (0.0, 0.0);
            }
        }
    }
    if pool.1 > 0.0 {
        term(pool.0, pool.1);
    }
    (statistic, bins.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn p_values_agree_with_tables() {
        assert!((normal_p_two_sided(1.959_964) - 0.05).abs() < 1e-6);
        assert!((normal_p_two_sided(-3.0) - 0.002_699_796).abs() < 1e-8);
        assert!((chi_square_p(3.841_459, 1) - 0.05).abs() < 1e-6);
        assert!((chi_square_p(124.342, 100) - 0.05).abs() < 1e-4);
        assert_eq!(chi_square_p(f64::INFINITY, 3), 0.0);
        assert_eq!(chi_square_p(f64::NAN, 3), 0.0);
        assert_eq!(normal_p_two_sided(f64::NAN), 0.0);
        assert_eq!(chi_square_p(0.0, 3), 1.0);
        let each = sidak(0.01, 1000);
        assert!((1.0 - (1.0 - each).powi(1000) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn quantiles_agree_with_tables() {
        assert!((student_t_quantile(0.975, 10) - 2.228_139).abs() < 1e-5);
        assert!((student_t_quantile(0.95, 1) - 6.313_752).abs() < 1e-5);
        assert!((chi_square_quantile(0.05, 10) - 3.940_299).abs() < 1e-5);
        assert!((chi_square_quantile(0.95, 1) - 3.841_459).abs() < 1e-5);
        assert!(student_t_quantile(0.9, 0).is_nan() && chi_square_quantile(1.0, 5).is_nan());
    }

    #[test]
    fn large_degrees_of_freedom_are_near_the_normal_limit() {
        let dof = 1_000_000;
        let one_sigma = dof as f64 + (2.0 * dof as f64).sqrt();
        assert!((chi_square_p(one_sigma, dof) - 0.158_7).abs() < 1e-3);
    }

    #[test]
    fn small_bins_are_pooled() {
        let (statistic, dof) = pooled_chi_square(&[10, 1, 1, 1, 2], &[10.0, 2.0, 2.0, 2.0, 0.5], 5.0);
        assert_eq!(dof, 2);
        assert!((statistic - (9.0 / 6.0 + 1.5 * 1.5 / 0.5)).abs() < 1e-12);
        assert_eq!(pooled_chi_square(&[1, 1], &[2.0, 0.0], 5.0).0, f64::INFINITY);
    }

    proptest! {
        #[test]
        fn moments_agree_with_two_passes(x in prop::collection::vec(-1e3_f64..1e3, 2..200), split in 0_usize..200) {
            let (mut a, mut b) = (Moments::default(), Moments::default());
            for (i, &v) in x.iter().enumerate() {
                if i < split { a.push(v) } else { b.push(v) }
            }
            a.merge(&b);
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            let variance = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (x.len() - 1) as f64;
            prop_assert_eq!(a.count(), x.len() as u64);
            prop_assert!((a.mean() - mean).abs() < 1e-9);
            prop_assert!((a.variance() - variance).abs() < 1e-6);
            prop_assert!((a.standard_error() - (variance / x.len() as f64).sqrt()).abs() < 1e-6);
        }
    }
}

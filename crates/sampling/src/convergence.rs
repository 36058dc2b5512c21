//! How fast an error falls with the number of samples.

use crate::statistics::student_t_quantile;

/// A fitted law `error = c N^rate`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// The exponent: -1/2 for crude Monte Carlo.
    pub rate: f64,
    /// Half the width of its 95 % confidence interval, by Student's t from how far the points lie from the line.
    pub half_width: f64,
}

/// Fits the law to pairs of a number of samples and an error by least squares of the logarithms. Pairs that are not above 0 are left out; `None` for
/// fewer than three, or all at the same number.
///
/// ```
/// let points: Vec<(f64, f64)> = (1..6).map(|k| (f64::from(1 << k), 3.0 / f64::from(1 << k))).collect();
/// let fit = sampling::convergence::fit(&points).unwrap();
/// assert!((fit.rate + 1.0).abs() < 1e-12 && fit.half_width < 1e-6);
/// ```
pub fn fit(points: &[(f64, f64)]) -> Option<Rate> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(n, error)| *n > 0.0 && *error > 0.0 && error.is_finite())
        .map(|(n, error)| (n.ln(), error.ln()))
        .collect();
    if logs.len() < 3 {
        return None;
    }
    let count = logs.len() as f64;
    let mean = (
        logs.iter().map(|p| p.0).sum::<f64>() / count,
        logs.iter().map(|p| p.1).sum::<f64>() / count,
    );
    let spread: f64 = logs.iter().map(|p| (p.0 - mean.0).powi(2)).sum();
    if spread <= 0.0 {
        return None;
    }
    let rate = logs.iter().map(|p| (p.0 - mean.0) * (p.1 - mean.1)).sum::<f64>() / spread;
    let residual: f64 = logs
        .iter()
        .map(|p| (p.1 - mean.1 - rate * (p.0 - mean.0)).powi(2))
        .sum();
    let dof = logs.len() - 2;
    let standard_error = (residual / dof as f64 / spread).sqrt();
    Some(Rate {
        rate,
        half_width: student_t_quantile(0.975, dof) * standard_error,
    })
}

//! Crude Monte Carlo that decides by itself when it is good enough.

use super::{Bias, Estimate, Estimator, Family};
use crate::integrands::Integrand;
use crate::random::Stream;
use crate::statistics::{Moments, chi_square_quantile, student_t_quantile};

/// Fewest samples before the first decision: a variance of fewer is not worth a decision.
const MIN_SAMPLES: usize = 16;

/// At most this many times the samples that an integrand with a standard deviation as large as its mean would need.
const PATIENCE: usize = 16;

/// Probability with which a rule wants to be right.
const CONFIDENCE: f64 = 0.95;

/// When to stop, from the samples so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoppingRule {
    /// When the confidence interval of the mean by Student's t is narrow enough, `t s / sqrt(m) < d`:
    /// W. Purgathofer, "A statistical method for adaptive stochastic sampling" (1987).
    StudentT,
    /// When a chi-square bound on the variance of the mean, `(m - 1) s^2 / (m chi^2)`, is below `d^2`: M. E. Lee, R. A. Redner and S. P. Uselton,
    /// "Statistically optimized sampling for distributed ray tracing" (1985). Wants the standard error to be below `d`, not the
    /// half-width of an interval, and so stops sooner.
    ChiSquare,
}

impl StoppingRule {
    /// Whether the samples are enough for an error of `tolerance`.
    ///
    /// ```
    /// use sampling::{Moments, estimators::StoppingRule};
    /// let mut moments = Moments::default();
    /// (0..100).for_each(|i| moments.push(f64::from(i % 2)));
    /// // The standard error is 0.05, the interval nearly twice as wide.
    /// assert!(StoppingRule::ChiSquare.is_satisfied(&moments, 0.06) && !StoppingRule::StudentT.is_satisfied(&moments, 0.06));
    /// assert!(StoppingRule::StudentT.is_satisfied(&moments, 0.1));
    /// ```
    pub fn is_satisfied(self, moments: &Moments, tolerance: f64) -> bool {
        let count = moments.count() as usize;
        if count < 2 {
            return false;
        }
        match self {
            Self::StudentT => {
                let t = student_t_quantile(0.5 + 0.5 * CONFIDENCE, count - 1);
                t * moments.standard_error() < tolerance
            }
            Self::ChiSquare => {
                let bound = chi_square_quantile(1.0 - CONFIDENCE, count - 1) / (count - 1) as f64;
                moments.standard_error().powi(2) < tolerance * tolerance * bound
            }
        }
    }
}

/// Crude Monte Carlo until a rule is satisfied. For `n` samples the tolerance is what they promise at a standard deviation as large as
/// the mean: a relative error of `1 / sqrt(n)`; more or fewer are taken as it turns out.
///
/// Biased, since the same samples decide and count: where the first few happen to be alike it stops too soon (D. Kirk and J. Arvo, "Unbiased
/// sampling techniques for image synthesis", 1991).
#[derive(Clone, Copy, Debug)]
pub struct Sequential(pub StoppingRule);

impl Estimator for Sequential {
    fn name(&self) -> String {
        match self.0 {
            StoppingRule::StudentT => "sequential-t".into(),
            StoppingRule::ChiSquare => "sequential-chi2".into(),
        }
    }

    fn family(&self) -> Family {
        Family::Blind
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        if n == 0 {
            return None;
        }
        let relative = 1.0 / (n as f64).sqrt();
        let mut stream = Stream::new(seed, 0);
        let mut x = vec![0.0; integrand.dimensions()];
        let mut moments = Moments::default();
        let mut next_look = MIN_SAMPLES;
        loop {
            while (moments.count() as usize) < next_look {
                stream.fill(&mut x);
                moments.push(integrand.value(&x));
            }
            let done = next_look >= PATIENCE * n.max(MIN_SAMPLES);
            if done || self.0.is_satisfied(&moments, relative * moments.mean().abs()) {
                return Some(Estimate {
                    value: moments.mean(),
                    standard_error: Some(moments.standard_error()),
                    evaluations: next_look,
                });
            }
            // An eighth more each time: quantiles are dear, and every look is one more chance to stop by mistake.
            next_look += next_look.div_ceil(8);
        }
    }

    fn bias(&self) -> Bias {
        Bias::Vanishing("the samples that decide when to stop also count")
    }
}

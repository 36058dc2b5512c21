//! Several techniques for one integral: combined beforehand, or sample by sample.

use super::linear::solve;
use super::{Estimate, Estimator, Family, combinable, for_each_draw, pilot_and_rest, sub_seed};
use crate::integrands::{Integrand, Technique};
use crate::mis::Heuristic;
use crate::points::PointSet;
use crate::statistics::Moments;

/// The weighted sum of the importance sampling estimates of all techniques, the weights being fixed beforehand from variances that a pilot run
/// estimated.
///
/// Independent estimates are best weighted in proportion to `1 / sigma_i^2`. Estimates that are made from the same uniform numbers have
/// a covariance matrix `C`, and the best weights are `C^(-1) 1`, normalised; where two techniques err in opposite directions the sum can be
/// better than independent ones would be.
#[derive(Clone, Copy, Debug)]
pub struct APriori {
    /// Whether the techniques share their uniform numbers.
    pub correlated: bool,
}

impl APriori {
    /// Values `f/p` of `count` draws of every technique; the techniques are the inner index.
    fn values(
        self,
        integrand: &dyn Integrand,
        techniques: &[Box<dyn Technique>],
        count: usize,
        seed: u64,
    ) -> Option<Vec<Vec<f64>>> {
        let mut rows = vec![Vec::with_capacity(techniques.len()); count];
        for (k, technique) in techniques.iter().enumerate() {
            let seed = sub_seed(seed, if self.correlated { 0 } else { k as u32 });
            let points = PointSet::Random.points(count, integrand.dimensions(), Some(seed))?;
            let mut row = rows.iter_mut();
            for_each_draw(&**technique, &points, |draw| {
                let value = draw.map_or(0.0, |(x, pdf)| integrand.value(x) / pdf);
                row.next().expect("as many rows as draws").push(value);
            });
        }
        Some(rows)
    }

    fn weights(self, pilot: &[Vec<f64>], techniques: usize) -> Vec<f64> {
        let count = pilot.len() as f64;
        let mean: Vec<f64> = (0..techniques)
            .map(|k| pilot.iter().map(|row| row[k]).sum::<f64>() / count)
            .collect();
        let covariance = |i: usize, j: usize| {
            pilot
                .iter()
                .map(|row| (row[i] - mean[i]) * (row[j] - mean[j]))
                .sum::<f64>()
                / (count - 1.0)
        };
        let mut matrix = vec![vec![0.0; techniques]; techniques];
        // A perfect technique has no variance: a trace of it keeps the weights finite.
        let least = 1e-9 * mean.iter().map(|m| m * m).sum::<f64>().max(f64::MIN_POSITIVE);
        for (i, row) in matrix.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                if i == j {
                    *entry = covariance(i, i) + least;
                } else if self.correlated {
                    *entry = covariance(i, j);
                }
            }
        }
        let weights = solve(matrix, vec![1.0; techniques]);
        let sum: f64 = weights.iter().sum();
        // Where the pilot run saw nothing but one value there is nothing to tell the techniques apart by.
        let known = sum > 0.0 && sum.is_finite();
        weights
            .into_iter()
            .map(|w| if known { w / sum } else { 1.0 / techniques as f64 })
            .collect()
    }
}

impl Estimator for APriori {
    fn name(&self) -> String {
        if self.correlated {
            "a-priori correlated".into()
        } else {
            "a-priori".into()
        }
    }

    fn family(&self) -> Family {
        Family::Combined
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let techniques = combinable(integrand)?;
        let k = techniques.len();
        let (pilot, count) = pilot_and_rest(n, k)?;
        let weights = self.weights(&self.values(integrand, techniques, pilot, sub_seed(seed, 0))?, k);
        // For correlated techniques the sums are what is independent; for independent ones it makes no difference.
        let mut sums = Moments::default();
        for row in self.values(integrand, techniques, count, sub_seed(seed, 1))? {
            sums.push(row.iter().zip(&weights).map(|(value, weight)| value * weight).sum());
        }
        Some(Estimate {
            value: sums.mean(),
            standard_error: Some(sums.standard_error()),
            evaluations: k * (pilot + count),
        })
    }
}

/// Multiple importance sampling: every technique draws the same number of samples, and each is weighted by how likely its technique was
/// to find it, compared with the others: E. Veach and L. Guibas, "Optimally combining sampling techniques for Monte Carlo
/// rendering" (1995).
///
/// `I = sum_i 1/n_i sum_j w_i(x_ij) f(x_ij) / p_i(x_ij)`, with `w` by [`Heuristic::weight`].
///
/// ```
/// use sampling::estimators::{Estimator, Importance, MultipleImportance};
/// use sampling::{integrands, mis::Heuristic};
/// let integrands = integrands::analytic();
/// let spike = integrands.iter().find(|i| i.name() == "spike-1d").unwrap();
/// let estimate = MultipleImportance(Heuristic::Balance).estimate(&**spike, 1000, 3).unwrap();
/// assert!((estimate.value - spike.integral()).abs() < 4.0 * estimate.standard_error.unwrap());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct MultipleImportance(pub Heuristic);

impl Estimator for MultipleImportance {
    fn name(&self) -> String {
        format!("mis {}", self.0.name())
    }

    fn family(&self) -> Family {
        Family::Combined
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let techniques = combinable(integrand)?;
        let count = n / techniques.len();
        if count == 0 {
            return None;
        }
        let mut density = vec![0.0; techniques.len()];
        let (mut value, mut variance) = (0.0, 0.0);
        for (own, technique) in techniques.iter().enumerate() {
            let points = PointSet::Random.points(count, integrand.dimensions(), Some(sub_seed(seed, own as u32)))?;
            let mut moments = Moments::default();
            for_each_draw(&**technique, &points, |draw| {
                moments.push(draw.map_or(0.0, |(x, pdf)| {
                    // All numbers of samples are alike, and so cancel.
                    density.iter_mut().zip(techniques).for_each(|(p, t)| *p = t.pdf(x));
                    self.0.weight(own, &density) * integrand.value(x) / pdf
                }));
            });
            value += moments.mean();
            variance += moments.standard_error().powi(2);
        }
        Some(Estimate {
            value,
            standard_error: Some(variance.sqrt()),
            evaluations: count * techniques.len(),
        })
    }
}

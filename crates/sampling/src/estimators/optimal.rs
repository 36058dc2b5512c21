//! Multiple importance sampling with optimal weights.

use super::linear::solve;
use super::{Estimate, Estimator, Family, combinable, for_each_draw, pilot_and_rest, sub_seed};
use crate::integrands::{Integrand, Technique};
use crate::points::PointSet;
use crate::statistics::Moments;

/// The weights of least variance, which may be negative: I. Kondapaneni, P. Vevoda, P. Grittmann, T. Skrivan, P. Slusallek and J. Krivanek, "Optimal
/// multiple importance sampling", ACM TOG 38(4) (2019).
///
/// Their theorem 1 makes it the balance heuristic with the densities as control variates, their integrals being 1 each:
/// `I = sum_i a_i + sum_ij (f(x_ij) - sum_k a_k p_k(x_ij)) / sum_k n_k p_k(x_ij)`, where `a` solves `A a = b`,
/// `A_ik = integral of p_i p_k / sum_j n_j p_j` and `b_i = integral of f p_i / sum_j n_j p_j`. Here `A` and `b` are estimated from samples which are not used again:
/// unbiased, whatever `a`.
#[derive(Clone, Copy, Debug)]
pub struct OptimalMultipleImportance;

impl Estimator for OptimalMultipleImportance {
    fn name(&self) -> String {
        "mis optimal".into()
    }

    fn family(&self) -> Family {
        Family::Combined
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let techniques = combinable(integrand)?;
        let k = techniques.len();
        let (pilot, count) = pilot_and_rest(n, k)?;

        let mut matrix = vec![vec![0.0; k]; k];
        let mut right = vec![0.0; k];
        for_each_sample(integrand, techniques, pilot, sub_seed(seed, 0), |_, value, density| {
            let mixture: f64 = density.iter().sum();
            for i in 0..k {
                right[i] += value * density[i] / (mixture * mixture);
                for j in 0..k {
                    matrix[i][j] += density[i] * density[j] / (mixture * mixture);
                }
            }
        })?;
        let alpha = solve(matrix, right);

        let mut of_technique = vec![Moments::default(); k];
        for_each_sample(
            integrand,
            techniques,
            count,
            sub_seed(seed, 1),
            |own, value, density| {
                let control: f64 = alpha.iter().zip(density).map(|(a, p)| a * p).sum();
                of_technique[own].push((value - control) / density.iter().sum::<f64>());
            },
        )?;
        let variance: f64 = of_technique.iter().map(|m| m.standard_error().powi(2)).sum();
        Some(Estimate {
            value: alpha.iter().sum::<f64>() + of_technique.iter().map(Moments::mean).sum::<f64>(),
            standard_error: Some(variance.sqrt()),
            evaluations: k * (pilot + count),
        })
    }
}

/// Calls `visit` for `count` draws of every technique with its index, the value there and the densities of all techniques.
///
/// A miss is a place that its technique alone can reach, with value 0: all misses of a technique count as one such place, whatever its
/// density, which cancels.
fn for_each_sample(
    integrand: &dyn Integrand,
    techniques: &[Box<dyn Technique>],
    count: usize,
    seed: u64,
    mut visit: impl FnMut(usize, f64, &[f64]),
) -> Option<()> {
    let mut density = vec![0.0; techniques.len()];
    for (own, technique) in techniques.iter().enumerate() {
        let points = PointSet::Random.points(count, integrand.dimensions(), Some(sub_seed(seed, own as u32)))?;
        for_each_draw(&**technique, &points, |draw| {
            if let Some((x, _)) = draw {
                density.iter_mut().zip(techniques).for_each(|(p, t)| *p = t.pdf(x));
                visit(own, integrand.value(x), &density);
            } else {
                density.fill(0.0);
                density[own] = 1.0;
                visit(own, 0.0, &density);
            }
        });
    }
    Some(())
}

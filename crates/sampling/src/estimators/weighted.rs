//! Weighted Monte Carlo: samples count for as much of the domain as they stand for.

use super::voronoi::voronoi_areas;
use super::{Bias, Estimate, Estimator, Family};
use crate::integrands::Integrand;
use crate::points::PointSet;

/// Crude Monte Carlo whose samples are weighted by the room that they happened to get.
///
/// S. Yakowitz, J. E. Krimmel and F. Szidarovszky, "Weighted Monte Carlo integration", SIAM J. Numer. Anal. 15 (1978): in 1-D the trapezoidal
/// rule over the sorted samples, whose error falls as `N^(-2)` for smooth integrands; in 2-D each value times the area of its Voronoi cell,
/// `N^(-1)`. The samples stay random and the points may come from anywhere; only their weights are clever. Biased, as any
/// quadrature rule is.
///
/// Differs: at the two ends of the interval the nearest value is continued, since the integrand may not be evaluated there; this costs
/// `N^(-2)` as well.
#[derive(Clone, Copy, Debug)]
pub struct Weighted;

impl Estimator for Weighted {
    fn name(&self) -> String {
        "weighted".into()
    }

    fn family(&self) -> Family {
        Family::Blind
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let points = PointSet::Random.points(n, integrand.dimensions(), Some(seed))?;
        let value = match integrand.dimensions() {
            _ if n == 0 => None,
            1 => Some(trapezoids(integrand, points.iter().map(|x| x[0]).collect())),
            2 => {
                let sites: Vec<[f64; 2]> = points.iter().map(|x| [x[0], x[1]]).collect();
                let areas = voronoi_areas(&sites);
                Some(sites.iter().zip(areas).map(|(x, area)| area * integrand.value(x)).sum())
            }
            _ => None,
        };
        value.map(|value| Estimate {
            value,
            standard_error: None,
            evaluations: n,
        })
    }

    fn bias(&self) -> Bias {
        Bias::Vanishing("weights and values belong to the same points")
    }
}

/// The trapezoidal rule over the points of the unit interval, which are not empty.
fn trapezoids(integrand: &dyn Integrand, mut x: Vec<f64>) -> f64 {
    x.sort_unstable_by(f64::total_cmp);
    let values: Vec<f64> = x.iter().map(|&x| integrand.value(&[x])).collect();
    let inner = x.windows(2).zip(values.windows(2));
    let inner: f64 = inner.map(|(x, f)| 0.5 * (f[0] + f[1]) * (x[1] - x[0])).sum();
    let last = x.len() - 1;
    x[0] * values[0] + inner + (1.0 - x[last]) * values[last]
}

//! Importance sampling, and its weighted form.

use super::{Bias, Estimate, Estimator, Family, for_each_draw};
use crate::integrands::Integrand;
use crate::points::PointSet;
use crate::statistics::Moments;

/// Importance sampling: `1/N sum f(x_i) / p(x_i)` over points drawn with density `p`.
///
/// The variance is `(integral of f^2/p - I^2) / N`: the more `p` is like `f`, the smaller, and 0 at `p = f / I`. A density that is small where the
/// integrand is not makes it larger than that of crude Monte Carlo, even infinite. The uniform numbers that are turned into draws may
/// come from any point set.
#[derive(Clone, Debug)]
pub struct Importance {
    /// Index of the technique in [`Integrand::techniques`].
    pub technique: usize,
    /// Its name.
    pub name: String,
    /// Where the uniform numbers come from.
    pub points: PointSet,
}

impl Estimator for Importance {
    fn name(&self) -> String {
        match self.points {
            PointSet::Random => format!("importance {}", self.name),
            points => format!("importance {} {}", self.name, points.name()),
        }
    }

    fn family(&self) -> Family {
        Family::Technique
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let technique = &**integrand.techniques().get(self.technique)?;
        let points = self.points.points(n, integrand.dimensions(), Some(seed))?;
        let mut moments = Moments::default();
        for_each_draw(technique, &points, |draw| {
            moments.push(draw.map_or(0.0, |(x, pdf)| integrand.value(x) / pdf));
        });
        (moments.count() > 0).then(|| Estimate {
            value: moments.mean(),
            standard_error: (self.points == PointSet::Random).then(|| moments.standard_error()),
            evaluations: points.len(),
        })
    }
}

/// Weighted importance sampling: `sum f(x_i) / sum g(x_i)` over uniform points, where `g` is the density of a technique, which need not be drawn
/// from.
///
/// M. J. D. Powell and J. Swann, "Weighted uniform sampling" (1966); for light transport P. Bekaert, M. Sbert and Y. Willems, "Weighted importance
/// sampling techniques for Monte Carlo radiosity" (2000). Biased by `O(1/N)`, since the quotient of two means is not the mean of the
/// quotients; the error still falls as `N^(-1/2)`, with the variance of `f - I g` instead of `f`.
#[derive(Clone, Debug)]
pub struct WeightedImportance {
    /// Index of the technique whose density is `g`.
    pub technique: usize,
    /// Its name.
    pub name: String,
}

impl Estimator for WeightedImportance {
    fn name(&self) -> String {
        format!("weighted-importance {}", self.name)
    }

    fn family(&self) -> Family {
        Family::Technique
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let technique = integrand.techniques().get(self.technique)?;
        if !technique.always_hits() {
            return None;
        }
        let points = PointSet::Random.points(n, integrand.dimensions(), Some(seed))?;
        let mut sums = (0.0, 0.0);
        for x in points.iter() {
            sums.0 += integrand.value(x);
            sums.1 += technique.pdf(x);
        }
        (sums.1 > 0.0).then(|| Estimate {
            value: sums.0 / sums.1,
            standard_error: None,
            evaluations: n,
        })
    }

    fn bias(&self) -> Bias {
        Bias::Vanishing("a quotient of two means")
    }
}

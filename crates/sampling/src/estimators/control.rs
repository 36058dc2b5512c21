//! Control variates.

use super::{Estimate, Estimator, Family, for_each_draw, pilot_size, sub_seed};
use crate::integrands::Integrand;
use crate::points::PointSet;
use crate::statistics::Moments;

/// A control variate, combined with importance sampling: `beta G + 1/N sum (f(x_i) - beta g(x_i)) / p(x_i)`, where the integral `G` of `g` is known.
///
/// Hammersley and Handscomb (1964), section 5.4. Only the difference is estimated, so its variance is all that matters; with the best `beta`,
/// the covariance of `f/p` and `g/p` over the variance of `g/p`, the variance falls to `1 - rho^2` of what it was. `beta` is taken from
/// samples that are not used again, which keeps the estimate unbiased.
#[derive(Clone, Debug)]
pub struct ControlVariate {
    /// Index of the technique that draws the points in [`Integrand::techniques`]; 0 is uniform.
    pub technique: usize,
    /// Its name.
    pub name: String,
}

impl Estimator for ControlVariate {
    fn name(&self) -> String {
        match self.technique {
            0 => "control".into(),
            _ => format!("control+{}", self.name),
        }
    }

    fn family(&self) -> Family {
        Family::Technique
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let control = integrand.control()?;
        let technique = &**integrand.techniques().get(self.technique)?;
        let pilot = pilot_size(n);
        if !technique.always_hits() || n <= pilot {
            return None;
        }
        // Calls back with f/p and g/p.
        let for_each_pair = |count: usize, part: u32, visit: &mut dyn FnMut(f64, f64)| -> Option<()> {
            let points = PointSet::Random.points(count, integrand.dimensions(), Some(sub_seed(seed, part)))?;
            for_each_draw(technique, &points, |draw| {
                let pair = draw.map_or((0.0, 0.0), |(x, pdf)| {
                    (integrand.value(x) / pdf, (control.value)(x) / pdf)
                });
                visit(pair.0, pair.1);
            });
            Some(())
        };
        let mut pairs = Vec::with_capacity(pilot);
        for_each_pair(pilot, 0, &mut |f, g| pairs.push((f, g)))?;
        let beta = slope(&pairs);
        let mut moments = Moments::default();
        for_each_pair(n - pilot, 1, &mut |f, g| moments.push(f - beta * g))?;
        Some(Estimate {
            value: beta * control.integral + moments.mean(),
            standard_error: Some(moments.standard_error()),
            evaluations: n,
        })
    }
}

/// The slope of the regression of the first on the second; 0 if the second hardly varies.
fn slope(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let mean = (
        pairs.iter().map(|p| p.0).sum::<f64>() / count,
        pairs.iter().map(|p| p.1).sum::<f64>() / count,
    );
    let (mut covariance, mut variance) = (0.0, 0.0);
    for (f, g) in pairs {
        covariance += (f - mean.0) * (g - mean.1);
        variance += (g - mean.1).powi(2);
    }
    if variance > 1e-12 * count * mean.1 * mean.1 {
        covariance / variance
    } else {
        0.0
    }
}

//! Means over point sets, and hit-or-miss.

use super::{Estimate, Estimator, Family};
use crate::integrands::Integrand;
use crate::points::PointSet;
use crate::random::Stream;
use crate::statistics::Moments;

/// The mean of the integrand over the points of a set: `1/N sum f(x_i)`.
///
/// With independent points this is crude Monte Carlo, whose variance is `sigma^2 / N` and can be told from the samples themselves (the
/// standard error, from the unbiased variance of the values); with one point per cell it is jittered sampling; with the others it is
/// randomised quasi-Monte Carlo. See [`crate::points`] for how fast each converges.
#[derive(Clone, Copy, Debug)]
pub struct PointMean(pub PointSet);

impl Estimator for PointMean {
    fn name(&self) -> String {
        match self.0 {
            PointSet::Random => "crude".into(),
            set => set.name().into(),
        }
    }

    fn family(&self) -> Family {
        match self.0 {
            PointSet::Random => Family::Blind,
            _ => Family::Points,
        }
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let points = self.0.points(n, integrand.dimensions(), Some(seed))?;
        let mut moments = Moments::default();
        points.iter().for_each(|x| moments.push(integrand.value(x)));
        (moments.count() > 0).then(|| Estimate {
            value: moments.mean(),
            standard_error: (self.0 == PointSet::Random).then(|| moments.standard_error()),
            evaluations: points.len(),
        })
    }
}

/// Rejection (hit or miss): the share of points of the box over the cube, as high as the integrand's bound `M`, that lie below its graph,
/// times `M`.
///
/// Its variance `I (M - I) / N` is never below that of crude Monte Carlo (J. M. Hammersley and D. C. Handscomb, "Monte Carlo Methods",
/// 1964, section 5.2): a random number is spent on what the value itself tells.
#[derive(Clone, Copy, Debug)]
pub struct HitOrMiss;

impl Estimator for HitOrMiss {
    fn name(&self) -> String {
        "hit-or-miss".into()
    }

    fn family(&self) -> Family {
        Family::Blind
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let bound = integrand.maximum()?;
        let mut stream = Stream::new(seed, 0);
        let mut x = vec![0.0; integrand.dimensions()];
        let mut moments = Moments::default();
        for _ in 0..n {
            stream.fill(&mut x);
            let hit = stream.number() * bound < integrand.value(&x);
            moments.push(if hit { bound } else { 0.0 });
        }
        (n > 0).then(|| Estimate {
            value: moments.mean(),
            standard_error: Some(moments.standard_error()),
            evaluations: n,
        })
    }
}

//! Error and cost of one method on one integrand.

use sampling::Moments;
use sampling::convergence::{self, Rate};
use sampling::estimators::{Bias, Estimator, Family};
use sampling::integrands::Integrand;
use std::ops::Range;
use std::time::Instant;

/// What is measured for every method.
pub(super) struct Plan {
    /// Numbers of samples, rising.
    pub(super) samples: Vec<usize>,
    pub(super) seeds: Range<u64>,
}

/// The errors of a method at one number of samples.
pub(super) struct Point {
    /// Samples asked for.
    pub(super) samples: usize,
    /// Mean number of evaluations of the integrand.
    pub(super) evaluations: f64,
    /// Root mean square error over the integral.
    pub(super) error: f64,
    /// Mean error over the integral.
    pub(super) mean_error: f64,
    /// Standard error of the mean error.
    pub(super) mean_error_se: f64,
    /// What the method itself thought of its error: root mean square of its standard errors over the integral.
    pub(super) stated_error: Option<f64>,
    /// Mean seconds of one estimate.
    pub(super) seconds: f64,
}

/// A method on an integrand.
pub(super) struct Curve {
    pub(super) integrand: String,
    pub(super) dimensions: usize,
    pub(super) method: String,
    pub(super) family: Family,
    pub(super) biased: bool,
    /// At least one, by rising numbers of samples.
    pub(super) points: Vec<Point>,
    /// `None` for too few points.
    pub(super) rate: Option<Rate>,
}

impl Curve {
    /// The point of the most samples.
    pub(super) fn last(&self) -> &Point {
        self.points.last().expect("a curve has a point")
    }

    /// 1 / (variance x cost) at the largest number of samples that both have, as a multiple of that of `other`.
    pub(super) fn efficiency_to(&self, other: &Self, cost: fn(&Point) -> f64) -> f64 {
        let work = |point: &Point| point.error.powi(2) * cost(point);
        let same = |own: &&Point| other.points.iter().find(|point| point.samples == own.samples);
        let pair = self
            .points
            .iter()
            .rev()
            .find_map(|own| same(&own).map(|other| (own, other)));
        pair.map_or(f64::NAN, |(own, other)| work(other) / work(own))
    }
}

/// Measures `method`; `None` if it does not apply to `integrand` at any of the numbers of samples.
pub(super) fn measure(integrand: &dyn Integrand, method: &dyn Estimator, plan: &Plan) -> Option<Curve> {
    // Tables that are made on first use are not what is timed.
    for &samples in plan.samples.first().into_iter().chain(plan.samples.last()) {
        method.estimate(integrand, samples, plan.seeds.start);
    }
    let points: Vec<Point> = plan
        .samples
        .iter()
        .filter_map(|&n| point(integrand, method, n, &plan.seeds))
        .collect();
    let falling: Vec<(f64, f64)> = points.iter().map(|point| (point.evaluations, point.error)).collect();
    (!points.is_empty()).then(|| Curve {
        integrand: integrand.name().into(),
        dimensions: integrand.dimensions(),
        method: method.name(),
        family: method.family(),
        biased: method.bias() != Bias::None,
        rate: convergence::fit(&falling),
        points,
    })
}

fn point(integrand: &dyn Integrand, method: &dyn Estimator, samples: usize, seeds: &Range<u64>) -> Option<Point> {
    let (mut errors, mut squares, mut stated) = (Moments::default(), Moments::default(), Moments::default());
    let mut evaluations = Moments::default();
    let start = Instant::now();
    for seed in seeds.clone() {
        let estimate = method.estimate(integrand, samples, seed)?;
        let error = estimate.value / integrand.integral() - 1.0;
        errors.push(error);
        squares.push(error * error);
        evaluations.push(estimate.evaluations as f64);
        if let Some(standard_error) = estimate.standard_error {
            stated.push((standard_error / integrand.integral()).powi(2));
        }
    }
    Some(Point {
        samples,
        evaluations: evaluations.mean(),
        error: squares.mean().sqrt(),
        mean_error: errors.mean(),
        mean_error_se: errors.standard_error(),
        stated_error: (stated.count() > 0).then(|| stated.mean().sqrt()),
        seconds: start.elapsed().as_secs_f64() / (seeds.end - seeds.start) as f64,
    })
}

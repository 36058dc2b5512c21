//! Monte Carlo estimators of integrals over the unit cube.
//!
//! Each takes an [`Integrand`] and a number of samples, and returns an [`Estimate`]. They differ in what they know:
//!
//! - **Blind** ones evaluate the integrand and know nothing else: [`PointMean`] (crude, stratified and quasi-Monte Carlo),
//!   [`HitOrMiss`], [`Sequential`], [`Weighted`].
//! - **Intelligent** ones use knowledge: of where the integrand varies ([`VarianceStrata`]), of densities like it ([`Importance`],
//!   [`WeightedImportance`], [`APriori`], [`MultipleImportance`], [`OptimalMultipleImportance`]), of similar functions
//!   ([`ControlVariate`]).
//!
//! ```
//! use sampling::estimators::{Estimator, PointMean, Weighted};
//! use sampling::{integrands, points::PointSet};
//! let integrands = integrands::analytic();
//! let smooth = &*integrands[0];
//! let error = |e: &dyn Estimator| (e.estimate(smooth, 256, 7).unwrap().value - smooth.integral()).abs();
//! // N^(-1/2) against N^(-2).
//! assert!(error(&PointMean(PointSet::Random)) > 20.0 * error(&Weighted));
//! ```

mod combined;
mod control;
mod importance;
mod linear;
mod mean;
mod optimal;
mod sequential;
mod strata;
mod voronoi;
mod weighted;

pub use combined::{APriori, MultipleImportance};
pub use control::ControlVariate;
pub use importance::{Importance, WeightedImportance};
pub use mean::{HitOrMiss, PointMean};
pub use optimal::OptimalMultipleImportance;
pub use sequential::{Sequential, StoppingRule};
pub use strata::{Allotment, VarianceStrata};
pub use weighted::Weighted;

use crate::integrands::{Integrand, Technique};
use crate::mis::Heuristic;
use crate::points::{PointSet, Points};
use crate::random::Random;

/// What an estimator found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The estimate of the integral.
    pub value: f64,
    /// Its own estimate of its standard error, if it can tell.
    pub standard_error: Option<f64>,
    /// Times that the integrand was evaluated.
    pub evaluations: usize,
}

/// Whether the mean of many estimates is the integral.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bias {
    /// It is, for every number of samples.
    None,
    /// It is in the limit of many samples; for the reason given.
    Vanishing(&'static str),
}

/// What an estimator knows and makes use of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Nothing but the values of the integrand.
    Blind,
    /// Nothing either, but the points are placed better than at random.
    Points,
    /// A density or a function like the integrand.
    Technique,
    /// Several densities.
    Combined,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Blind, Self::Points, Self::Technique, Self::Combined];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Blind => "blind",
            Self::Points => "points",
            Self::Technique => "technique",
            Self::Combined => "combined",
        }
    }
}

/// A way to estimate an integral.
pub trait Estimator: Send + Sync {
    /// The name in tables.
    fn name(&self) -> String;

    /// What it knows.
    fn family(&self) -> Family;

    /// Estimates the integral with about `n` samples. Different seeds give independent estimates. `None` if the method does not exist
    /// for the integrand, or not for so few or so many samples.
    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate>;

    /// Whether its estimates are biased.
    fn bias(&self) -> Bias {
        Bias::None
    }
}

/// Every estimator that applies to `integrand`, with every technique of it. The first is crude Monte Carlo.
pub fn all(integrand: &dyn Integrand) -> Vec<Box<dyn Estimator>> {
    let mut list: Vec<Box<dyn Estimator>> = Vec::new();
    list.extend(PointSet::ALL.map(|set| Box::new(PointMean(set)) as Box<dyn Estimator>));
    list.push(Box::new(HitOrMiss));
    list.push(Box::new(Sequential(StoppingRule::StudentT)));
    list.push(Box::new(Sequential(StoppingRule::ChiSquare)));
    list.push(Box::new(Weighted));
    list.extend(Allotment::ALL.map(|allotment| Box::new(VarianceStrata(allotment)) as Box<dyn Estimator>));
    for technique in 1..integrand.techniques().len() {
        let name = integrand.techniques()[technique].name().to_string();
        for points in [PointSet::Random, PointSet::OwenSobol] {
            list.push(Box::new(Importance {
                technique,
                name: name.clone(),
                points,
            }));
        }
        list.push(Box::new(WeightedImportance { technique, name }));
    }
    for technique in 0..integrand.techniques().len() {
        let name = integrand.techniques()[technique].name().to_string();
        list.push(Box::new(ControlVariate { technique, name }));
    }
    list.push(Box::new(APriori { correlated: false }));
    list.push(Box::new(APriori { correlated: true }));
    list.extend(Heuristic::ALL.map(|heuristic| Box::new(MultipleImportance(heuristic)) as Box<dyn Estimator>));
    list.push(Box::new(OptimalMultipleImportance));
    // A method that can do nothing with this many samples can do nothing with any number.
    list.retain(|estimator| estimator.estimate(integrand, PROBE, 0).is_some());
    list
}

/// Samples with which a method is asked whether it applies: enough for all, and few enough for [`PointSet::BlueNoise`].
const PROBE: usize = 256;

/// Share of the samples that methods which look before they leap spend on looking: what they learn decides how the others are used,
/// and these samples are not used for the estimate, which keeps it unbiased. Higher values choose better; lower values waste less.
const PILOT_SHARE: f64 = 0.25;

/// Fewest samples from which a variance is worth being estimated.
const MIN_PILOT: usize = 8;

/// How many samples of each of `k` techniques are spent on looking, and how many are left, of `n` in all; `None` if that is too few.
fn pilot_and_rest(n: usize, k: usize) -> Option<(usize, usize)> {
    let pilot = pilot_size(n) / k;
    (pilot >= 4 && n / k >= pilot + 2).then(|| (pilot, n / k - pilot))
}

/// The samples to look with, of `n`.
fn pilot_size(n: usize) -> usize {
    ((n as f64 * PILOT_SHARE) as usize).max(MIN_PILOT)
}

/// A seed for part `part` of an estimate, independent of that of any other part.
fn sub_seed(seed: u64, part: u32) -> u64 {
    let random = Random::new(seed, part, SUB_SEEDS);
    u64::from(random.u32(0)) << 32 | u64::from(random.u32(1))
}

/// Frame number of the random numbers that make seeds, so that they are no one else's.
const SUB_SEEDS: u32 = 1;

/// The techniques that share the work where several are combined: those other than the uniform one if there are enough of them.
fn combinable(integrand: &dyn Integrand) -> Option<&[Box<dyn Technique>]> {
    match integrand.techniques() {
        [] | [_] => None,
        two @ [_, _] => Some(two),
        [_uniform, others @ ..] => Some(others),
    }
}

/// Calls `visit` for every draw of `technique` that `points` give, with the drawn point and its density; `None` for a miss.
fn for_each_draw(technique: &dyn Technique, points: &Points, mut visit: impl FnMut(Option<(&[f64], f64)>)) {
    let mut x = vec![0.0; points.dimensions()];
    for u in points.iter() {
        if technique.sample(u, &mut x) {
            visit(Some((&x, technique.pdf(&x))));
        } else {
            visit(None);
        }
    }
}

#[cfg(test)]
mod tests;

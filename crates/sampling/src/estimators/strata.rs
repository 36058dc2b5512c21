//! Strata placed where the integrand varies, and samples allotted to them.

use super::{Estimate, Estimator, Family, MIN_PILOT, pilot_size, sub_seed};
use crate::integrands::Integrand;
use crate::points::PointSet;
use crate::random::Stream;
use crate::statistics::Moments;

/// Fewest pilot samples in a stratum. Higher values know the variances better; lower values allow more strata.
const MIN_IN_STRATUM: usize = 4;

/// Samples that every stratum gets, whatever its variance seems to be: two tell a variance.
const LEAST_ALLOTTED: usize = 2;

/// How many samples a stratum gets of all, by its volume `w` and its standard deviation `s`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Allotment {
    /// In proportion to `w`: never worse than crude Monte Carlo.
    Volume,
    /// In proportion to `w s^2`, as often taught.
    VolumeVariance,
    /// In proportion to `w s`, the optimum: J. Neyman, "On the two different aspects of the representative method" (1934). The variance of the
    /// estimate is then `(sum w s)^2 / N`.
    Neyman,
}

impl Allotment {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Volume, Self::VolumeVariance, Self::Neyman];

    fn share(self, volume: f64, deviation: f64) -> f64 {
        match self {
            Self::Volume => volume,
            Self::VolumeVariance => volume * deviation * deviation,
            Self::Neyman => volume * deviation,
        }
    }
}

/// Stratified sampling with strata placed by variance: a pilot run finds out where the integrand varies, the cube is halved again and again
/// where the standard deviation times the volume is largest, and new samples are allotted to the parts.
///
/// Unbiased, since the pilot samples only place and allot: `sum_j w_j mean_j` over the strata.
#[derive(Clone, Copy, Debug)]
pub struct VarianceStrata(pub Allotment);

impl Estimator for VarianceStrata {
    fn name(&self) -> String {
        match self.0 {
            Allotment::Volume => "strata volume".into(),
            Allotment::VolumeVariance => "strata volume x variance".into(),
            Allotment::Neyman => "strata neyman".into(),
        }
    }

    fn family(&self) -> Family {
        Family::Blind
    }

    fn estimate(&self, integrand: &dyn Integrand, n: usize, seed: u64) -> Option<Estimate> {
        let pilot = pilot_size(n);
        if n < pilot + MIN_PILOT {
            return None;
        }
        let strata = place(integrand, pilot, (n - pilot) / (2 * LEAST_ALLOTTED), sub_seed(seed, 0))?;
        let counts = allot(&strata, self.0, n - pilot);
        let mut stream = Stream::new(sub_seed(seed, 1), 0);
        let mut x = vec![0.0; integrand.dimensions()];
        let (mut value, mut variance) = (0.0, 0.0);
        for (stratum, &count) in strata.iter().zip(&counts) {
            let mut moments = Moments::default();
            for _ in 0..count {
                stream.fill(&mut x);
                stratum.place(&mut x);
                moments.push(integrand.value(&x));
            }
            value += stratum.volume() * moments.mean();
            variance += (stratum.volume() * moments.standard_error()).powi(2);
        }
        Some(Estimate {
            value,
            standard_error: Some(variance.sqrt()),
            evaluations: pilot + counts.iter().sum::<usize>(),
        })
    }
}

/// A box of the cube, and the pilot samples in it.
struct Stratum {
    low: Vec<f64>,
    high: Vec<f64>,
    samples: Vec<(Vec<f64>, f64)>,
}

impl Stratum {
    fn volume(&self) -> f64 {
        self.low.iter().zip(&self.high).map(|(low, high)| high - low).product()
    }

    fn deviation(&self) -> f64 {
        let mut moments = Moments::default();
        self.samples.iter().for_each(|(_, value)| moments.push(*value));
        moments.variance().sqrt()
    }

    /// What it contributes to the variance of the estimate, before the samples are allotted.
    fn weight(&self) -> f64 {
        self.volume() * self.deviation()
    }

    /// Moves a point of the unit cube into the box.
    fn place(&self, x: &mut [f64]) {
        for ((x, low), high) in x.iter_mut().zip(&self.low).zip(&self.high) {
            *x = low + *x * (high - low);
        }
    }

    /// The two halves across `axis`; `None` if one of them had too few samples.
    fn halves(&self, axis: usize) -> Option<[Self; 2]> {
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let (left, right): (Vec<_>, Vec<_>) = self.samples.iter().cloned().partition(|(x, _)| x[axis] < middle);
        if left.len().min(right.len()) < MIN_IN_STRATUM {
            return None;
        }
        let (mut below, mut above) = (self.high.clone(), self.low.clone());
        below[axis] = middle;
        above[axis] = middle;
        Some([
            Self {
                low: self.low.clone(),
                high: below,
                samples: left,
            },
            Self {
                low: above,
                high: self.high.clone(),
                samples: right,
            },
        ])
    }

    /// The halves across the axis that leaves the least to be estimated.
    fn best_halves(&self) -> Option<[Self; 2]> {
        let weight = |halves: &[Self; 2]| halves.iter().map(Self::weight).sum::<f64>();
        let candidates = (0..self.low.len()).filter_map(|axis| self.halves(axis));
        candidates.min_by(|a, b| weight(a).total_cmp(&weight(b)))
    }
}

/// At most `most` strata, from `pilot` samples.
fn place(integrand: &dyn Integrand, pilot: usize, most: usize, seed: u64) -> Option<Vec<Stratum>> {
    let dimensions = integrand.dimensions();
    let points = PointSet::Random.points(pilot, dimensions, Some(seed))?;
    let mut open = vec![Stratum {
        low: vec![0.0; dimensions],
        high: vec![1.0; dimensions],
        samples: points.iter().map(|x| (x.to_vec(), integrand.value(x))).collect(),
    }];
    let mut done = Vec::new();
    while open.len() + done.len() < most {
        let heaviest = (0..open.len()).max_by(|&a, &b| open[a].weight().total_cmp(&open[b].weight()));
        let Some(heaviest) = heaviest else { break };
        let stratum = open.swap_remove(heaviest);
        match stratum.best_halves() {
            Some(halves) => open.extend(halves),
            None => done.push(stratum),
        }
    }
    done.append(&mut open);
    Some(done)
}

/// How many of `n` samples each stratum gets: [`LEAST_ALLOTTED`], and the rest by shares, rounded so that none is lost.
fn allot(strata: &[Stratum], allotment: Allotment, n: usize) -> Vec<usize> {
    let shares: Vec<f64> = strata
        .iter()
        .map(|s| allotment.share(s.volume(), s.deviation()))
        .collect();
    let sum: f64 = shares.iter().sum();
    let rest = n.saturating_sub(LEAST_ALLOTTED * strata.len());
    let (mut running, mut given) = (0.0, 0);
    let count = |(stratum, share): (&Stratum, &f64)| {
        running += if sum > 0.0 { share / sum } else { stratum.volume() };
        let target = ((running * rest as f64).round() as usize).min(rest);
        let count = LEAST_ALLOTTED + target - given;
        given = target;
        count
    };
    strata.iter().zip(&shares).map(count).collect()
}

//! Every estimator on every integrand: unbiased, and as fast as the theory says.

use super::*;
use crate::convergence;
use crate::integrands;
use crate::statistics::{Moments, normal_p_two_sided, sidak};
use std::sync::OnceLock;

/// Made once: their integrals take a while.
fn integrands() -> &'static [Box<dyn Integrand>] {
    static ALL: OnceLock<Vec<Box<dyn Integrand>>> = OnceLock::new();
    ALL.get_or_init(integrands::all)
}

fn integrand(name: &str) -> &'static dyn Integrand {
    &**integrands().iter().find(|i| i.name() == name).unwrap()
}

/// Moments of the error of `estimator` over `seeds`, if it applies.
fn errors(estimator: &dyn Estimator, integrand: &dyn Integrand, n: usize, seeds: u64) -> Option<Moments> {
    let mut moments = Moments::default();
    for seed in 0..seeds {
        moments.push(estimator.estimate(integrand, n, seed)?.value - integrand.integral());
    }
    Some(moments)
}

/// The exponent with which the root mean square error falls from `2^low` to `2^high` samples.
fn rate(estimator: &dyn Estimator, name: &str, [low, high]: [u32; 2]) -> f64 {
    let integrand = integrand(name);
    let at = |log: u32| {
        let mut squares = 0.0;
        for seed in 0..64 {
            let estimate = estimator.estimate(integrand, 1 << log, seed).unwrap();
            squares += (estimate.value - integrand.integral()).powi(2);
        }
        (f64::from(1 << log), (squares / 64.0).sqrt())
    };
    let points: Vec<(f64, f64)> = (low..=high).step_by(2).map(at).collect();
    convergence::fit(&points).unwrap().rate
}

/// A z-test for every unbiased estimator on every integrand, at a small number of samples. Together they fail once in 1,000 runs of
/// other seeds.
#[test]
fn unbiased_estimators_are_unbiased() {
    let mut all_z = Vec::new();
    for integrand in integrands() {
        let integrand = &**integrand;
        for estimator in all(integrand) {
            if estimator.bias() != Bias::None {
                continue;
            }
            // In many dimensions that is the smallest grid.
            let n = if integrand.dimensions() > 2 { 64 } else { 48 };
            if let Some(errors) = errors(&*estimator, integrand, n, 400) {
                let z = errors.mean() / errors.standard_error().max(1e-9);
                all_z.push((z, format!("{} on {}", estimator.name(), integrand.name())));
            }
        }
    }
    assert!(all_z.len() > 300, "only {} apply", all_z.len());
    let limit = sidak(1e-3, all_z.len());
    for (z, what) in all_z {
        assert!(normal_p_two_sided(z) > limit, "{what}: z = {z}");
    }
}

fn variance(estimator: &dyn Estimator, name: &str, n: usize, seeds: u64) -> f64 {
    errors(estimator, integrand(name), n, seeds).unwrap().variance()
}

/// Five numbers of samples with 64 seeds each tell an exponent to 0.02 (one standard error); tolerances are four of these or more. Those of
/// the last ones allow for the logarithms in their laws.
#[test]
fn errors_fall_as_the_theory_says() {
    let mean = |set| Box::new(PointMean(set)) as Box<dyn Estimator>;
    let laws: [(Box<dyn Estimator>, &str, f64, f64); 19] = [
        (mean(PointSet::Random), "smooth-1d", -0.5, 0.08),
        (mean(PointSet::Random), "smooth-2d", -0.5, 0.08),
        (mean(PointSet::Random), "edge-2d", -0.5, 0.08),
        (mean(PointSet::Random), "product-6d", -0.5, 0.08),
        // Per cell of side h the deviation is h, or 1 in the cells of the edge, which are N^(1/2) of N.
        (mean(PointSet::Stratified), "smooth-1d", -1.5, 0.08),
        (mean(PointSet::Stratified), "smooth-2d", -1.0, 0.08),
        (mean(PointSet::Stratified), "edge-2d", -0.75, 0.08),
        (mean(PointSet::Stratified), "disc-2d", -0.75, 0.08),
        (Box::new(Weighted), "smooth-1d", -2.0, 0.1),
        // Faster than its law while the cells at the rim, whose sites lie to one side, still matter.
        (Box::new(Weighted), "smooth-2d", -1.05, 0.15),
        (mean(PointSet::OwenSobol), "smooth-1d", -1.5, 0.1),
        (mean(PointSet::OwenSobol), "smooth-2d", -1.5, 0.1),
        (mean(PointSet::Sobol), "smooth-2d", -1.0, 0.15),
        (mean(PointSet::Halton), "smooth-2d", -1.0, 0.15),
        (mean(PointSet::ScrambledHalton), "smooth-1d", -1.5, 0.15),
        (mean(PointSet::Hammersley), "smooth-2d", -1.0, 0.15),
        (mean(PointSet::FoldedHammersley), "smooth-2d", -1.0, 0.15),
        (mean(PointSet::Lattice), "smooth-2d", -1.0, 0.15),
        (mean(PointSet::R2), "smooth-2d", -1.0, 0.15),
    ];
    for (estimator, name, expected, tolerance) in laws {
        let rate = rate(&*estimator, name, [4, 12]);
        assert!(
            (rate - expected).abs() < tolerance,
            "{} on {name}: N^{rate:.3}",
            estimator.name()
        );
    }
}

/// The biases that [`Bias`] states are there (five standard errors and more), are small against the error, and vanish with more samples.
#[test]
fn stated_biases_are_there_and_vanish() {
    let quotient = WeightedImportance {
        technique: 1,
        name: "lorentz".into(),
    };
    let cases: [(&dyn Estimator, &str, [usize; 2]); 3] = [
        (&Weighted, "smooth-2d", [64, 1024]),
        (&quotient, "spike-1d", [64, 1024]),
        (&Sequential(StoppingRule::ChiSquare), "disc-2d", [64, 1024]),
    ];
    for (estimator, name, [few, many]) in cases {
        assert_ne!(estimator.bias(), Bias::None);
        let few = errors(estimator, integrand(name), few, 2000).unwrap();
        let many = errors(estimator, integrand(name), many, 500).unwrap();
        let z = few.mean() / few.standard_error();
        assert!(z.abs() > 5.0, "{name}: z = {z}");
        assert!(few.mean().abs() < 0.8 * few.variance().sqrt(), "{name}: {few:?}");
        let left = many.mean().abs() + 2.0 * many.standard_error();
        assert!(left < few.mean().abs() / 2.0, "{name}: {} {left}", few.mean());
    }
}

/// Veach (1997), theorem 9.2, for two techniques with `n / 2` samples each. Variances of 2,000 estimates are good to 1/30; three of these are allowed.
#[test]
fn no_heuristic_beats_balance_by_more_than_the_bound() {
    let n = 64;
    for name in [
        "smooth-1d",
        "spike-1d",
        "smooth-2d",
        "edge-2d",
        "product-6d",
        "corner-6d",
    ] {
        let balance = variance(&MultipleImportance(Heuristic::Balance), name, n, 2000);
        let bound = (2.0 / n as f64 - 1.0 / n as f64) * integrand(name).integral().powi(2);
        for other in Heuristic::ALL {
            let other_variance = variance(&MultipleImportance(other), name, n, 2000);
            assert!(
                balance < 1.1 * other_variance + bound,
                "{name}: {balance} {other:?} {other_variance}"
            );
        }
    }
}

#[test]
fn knowledge_pays() {
    let v = |estimator: &dyn Estimator, name| variance(estimator, name, 256, 400);
    let crude = PointMean(PointSet::Random);
    let linear = Importance {
        technique: 1,
        name: "linear".into(),
        points: PointSet::Random,
    };
    let controlled = ControlVariate {
        technique: 0,
        name: "uniform".into(),
    };
    assert!(v(&linear, "smooth-2d") < 0.2 * v(&crude, "smooth-2d"));
    assert!(v(&controlled, "smooth-2d") < 0.1 * v(&crude, "smooth-2d"));
    assert!(v(&OptimalMultipleImportance, "smooth-1d") < 0.2 * v(&MultipleImportance(Heuristic::Balance), "smooth-1d"));
    assert!(v(&APriori { correlated: true }, "smooth-1d") < 0.1 * v(&APriori { correlated: false }, "smooth-1d"));
    // Neyman against the rule by variance where deviations differ much; hit or miss never pays.
    let [_, taught, neyman] = Allotment::ALL.map(VarianceStrata);
    assert!(v(&neyman, "spike-1d") < 0.8 * v(&taught, "spike-1d"));
    assert!(v(&HitOrMiss, "smooth-2d") > v(&crude, "smooth-2d"));
}

/// Standard errors are true: as large as the spread of the estimates, within 15 %, where values are not too skewed.
#[test]
fn standard_errors_tell_the_spread() {
    for name in ["smooth-1d", "edge-2d", "product-6d"] {
        let integrand = integrand(name);
        for estimator in all(integrand) {
            let (mut values, mut squares) = (Moments::default(), Moments::default());
            for seed in 0..300 {
                if let Some(estimate) = estimator.estimate(integrand, 512, seed)
                    && let Some(standard_error) = estimate.standard_error
                    && estimator.bias() == Bias::None
                {
                    values.push(estimate.value);
                    squares.push(standard_error * standard_error);
                }
            }
            let ratio = (squares.mean() / values.variance()).sqrt();
            assert!(
                values.count() == 0 || (ratio - 1.0).abs() < 0.15,
                "{} on {name}: {ratio}",
                estimator.name()
            );
        }
    }
}

/// Student's rule promises its tolerance with 95 %; stopping at a lucky moment takes some of it.
#[test]
fn sequential_sampling_keeps_its_promise() {
    let integrand = integrand("smooth-2d");
    let (n, seeds) = (400, 1000);
    let tolerance = integrand.integral() / (n as f64).sqrt();
    let rule = Sequential(StoppingRule::StudentT);
    let within = (0..seeds).filter(|&seed| {
        let estimate = rule.estimate(integrand, n, seed).unwrap();
        (estimate.value - integrand.integral()).abs() < tolerance
    });
    let share = within.count() as f64 / seeds as f64;
    assert!((0.9..0.99).contains(&share), "{share}");
}

/// What each technique is good for, and that multiple importance sampling is good everywhere.
#[test]
fn techniques_of_direct_light_have_their_places() {
    let v = |technique: usize, name: &str| {
        let importance = Importance {
            technique,
            name: String::new(),
            points: PointSet::Random,
        };
        variance(&importance, name, 64, 300)
    };
    let (area, solid_angle, direction) = (0, 1, 2);
    // Far planar lights: a fifth of the distance, and area is as good. Near ones: solid angle.
    assert!((v(area, "planar-far-small") / v(solid_angle, "planar-far-small") - 1.0).abs() < 0.5);
    assert!(v(solid_angle, "planar-near-large") < 0.7 * v(area, "planar-near-large"));
    // Half of a sphere faces away.
    assert!(v(solid_angle, "sphere-far-small") < 0.1 * v(area, "sphere-far-small"));
    // Small lights are missed by directions, large ones are not.
    assert!(v(solid_angle, "planar-far-small") < 0.01 * v(direction, "planar-far-small"));
    assert!(v(direction, "planar-near-large") < v(solid_angle, "planar-near-large"));
    for name in [
        "planar-far-small",
        "planar-near-small",
        "planar-near-large",
        "sphere-far-large",
        "sphere-near-large",
    ] {
        // Each technique gets half of the samples: twice the variance of the better one, and Veach's bound on top.
        let mis = variance(&MultipleImportance(Heuristic::Balance), name, 64, 300);
        let better = v(solid_angle, name).min(v(direction, name));
        let bound = (1.0 / 32.0 - 1.0 / 64.0) * integrand(name).integral().powi(2);
        assert!(mis < 1.3 * 2.0 * better + bound, "{name}: {mis} {better}");
    }
}

/// Each strategy of choice knows more than the one before it.
#[test]
fn what_is_known_of_lights_pays() {
    let many = integrand("many-lights");
    let v = |technique: usize| {
        let importance = Importance {
            technique,
            name: String::new(),
            points: PointSet::Random,
        };
        errors(&importance, many, 64, 400).unwrap().variance()
    };
    let [equal, power, subdivision, dynamic] = [1, 2, 3, 4].map(v);
    assert!(
        power < equal && subdivision < power && dynamic < 0.5 * subdivision,
        "{equal} {power} {subdivision} {dynamic}"
    );
}

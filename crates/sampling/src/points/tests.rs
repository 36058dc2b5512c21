//! Properties that every set must have.

use super::*;
use crate::statistics::{Moments, chi_square_p, normal_p_two_sided, pooled_chi_square, sidak};

#[test]
fn points_lie_in_the_cube_and_are_as_many_as_asked() {
    for set in PointSet::ALL {
        for dimensions in [1, 2, 3, 6] {
            for seed in [None, Some(1), Some(u64::MAX)] {
                let Some(points) = set.points(100, dimensions, seed) else {
                    assert!(!set.dimensions().contains(&dimensions));
                    continue;
                };
                let grid = [100, 100, 64, 81, 32, 64][dimensions - 1];
                let expected = if set == PointSet::Stratified { grid } else { 100 };
                assert_eq!(points.len(), expected, "{set:?} in {dimensions}");
                assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)), "{set:?}");
            }
        }
        assert!(set.points(4, *set.dimensions().end() + 1, None).is_none());
    }
    assert!(PointSet::BlueNoise.points(4097, 2, None).is_none());
}

#[test]
fn names_differ() {
    let mut names = PointSet::ALL.map(PointSet::name).to_vec();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), PointSet::ALL.len());
}

#[test]
fn known_points() {
    let halton = PointSet::Halton.points(5, 2, None).unwrap();
    assert_eq!(halton.iter().nth(3).unwrap(), [0.75, 1.0 / 9.0]);
    let lattice = PointSet::Lattice.points(4, 2, None).unwrap();
    assert_eq!(lattice.iter().nth(1).unwrap(), [0.5, 0.5]);
    assert!((generalised_golden_ratio(1) - 1.618_033_988_749_895).abs() < 1e-14);
    assert!((generalised_golden_ratio(2) - 1.324_717_957_244_746).abs() < 1e-14);
}

/// With a seed, each point of each set is uniform over seeds. All tests together fail once in 1,000 runs of other seeds.
#[test]
fn randomised_points_are_uniform_over_seeds() {
    let limit = sidak(1e-3, PointSet::ALL.len() * 3);
    for set in PointSet::ALL {
        for index in [0, 5, 13] {
            let mut bins = [0_u64; 16];
            for seed in 0..2000 {
                let points = set.points(16, 2, Some(seed)).unwrap();
                let p = points.iter().nth(index).unwrap();
                bins[(p[0] * 4.0) as usize * 4 + (p[1] * 4.0) as usize] += 1;
            }
            // A point of the stratified set keeps to its cell: the 16 of them together are uniform.
            if set != PointSet::Stratified {
                let (statistic, dof) = pooled_chi_square(&bins, &[125.0; 16], 5.0);
                assert!(chi_square_p(statistic, dof) > limit, "{set:?}, point {index}: {bins:?}");
            }
        }
    }
}

/// Means are unbiased in two and six dimensions: a z-test each, which together fail once in 1,000 runs.
#[test]
fn means_are_unbiased() {
    let limit = sidak(1e-3, PointSet::ALL.len() * 2);
    for set in PointSet::ALL {
        for dimensions in [2, 6] {
            let mut moments = Moments::default();
            for seed in 0..300 {
                let Some(points) = set.points(64, dimensions, Some(seed)) else {
                    continue;
                };
                let sum: f64 = points.iter().map(|x| x.iter().map(|x| 0.5 + x).product::<f64>()).sum();
                moments.push(sum / points.len() as f64 - 1.0);
            }
            if moments.count() > 0 {
                let z = moments.mean() / moments.standard_error();
                assert!(normal_p_two_sided(z) > limit, "{set:?} in {dimensions}: {z}");
            }
        }
    }
}

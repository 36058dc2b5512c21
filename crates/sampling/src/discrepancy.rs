//! How far points are from even: the discrepancy.
//!
//! The star discrepancy is the largest difference, over all boxes `[0, t)` with a corner at the origin, between the share of the
//! points in the box and its volume:
//!
//! `D* = sup_t | #{x_i in [0, t)} / N - t_1 ... t_d |`.
//!
//! The Koksma-Hlawka inequality bounds the error of a mean by `D*` times the variation of the integrand, so it says what points can
//! do for every integrand at once: `N^(-1/2)` for independent points, `N^(-1) log N` for the best in 2-D.
//!
//! <div>
#![doc = include_str!("../../../docs/monte-carlo/discrepancy.svg")]
//! </div>
//!
//! ```
//! use sampling::{discrepancy, points::PointSet};
//! let of = |set: PointSet| discrepancy::star_2d(&set.points(256, 2, Some(3)).unwrap()).unwrap();
//! assert!(of(PointSet::Hammersley) < 0.3 * of(PointSet::Random));
//! ```

use crate::points::Points;

/// The exact star discrepancy in one dimension, `O(N log N)`; `None` for points of another dimension or no points.
///
/// H. Niederreiter, "Random Number Generation and Quasi-Monte Carlo Methods" (1992), theorem 2.6:
/// `1/(2N) + max_i |x_i - (2i - 1)/(2N)|` over the sorted points.
pub fn star_1d(points: &Points) -> Option<f64> {
    if points.dimensions() != 1 || points.is_empty() {
        return None;
    }
    let n = points.len() as f64;
    let mut x: Vec<f64> = points.iter().map(|x| x[0]).collect();
    x.sort_unstable_by(f64::total_cmp);
    let farthest = x.iter().enumerate().map(|(i, x)| (x - (i as f64 + 0.5) / n).abs());
    Some(0.5 / n + farthest.fold(0.0, f64::max))
}

/// The exact star discrepancy in two dimensions, `O(N^2)`; `None` for points of another dimension or no points.
///
/// P. Bundschuh and Y. Zhu, "A method for exact calculation of the discrepancy of low-dimensional finite point sets I" (1993): with
/// the points sorted by x, and `y_1 <= ... <= y_l` those of the first `l` sorted, the supremum is reached at the corners
/// `(x_l, y_k)` of the closed and `(x_(l+1), y_(k+1))` of the open boxes.
pub fn star_2d(points: &Points) -> Option<f64> {
    if points.dimensions() != 2 || points.is_empty() {
        return None;
    }
    let n = points.len() as f64;
    let mut by_x: Vec<[f64; 2]> = points.iter().map(|p| [p[0], p[1]]).collect();
    by_x.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    // The sorted y of the points left of the sweep, between the two ends of the unit interval.
    let mut y = vec![0.0, 1.0];
    let mut largest = 0.0_f64;
    for l in 0..=by_x.len() {
        let x = if l == 0 { 0.0 } else { by_x[l - 1][0] };
        let next_x = by_x.get(l).map_or(1.0, |p| p[0]);
        if l > 0 {
            let place = y.partition_point(|&other| other <= by_x[l - 1][1]).min(y.len() - 1);
            y.insert(place, by_x[l - 1][1]);
        }
        for (k, pair) in y.windows(2).enumerate() {
            let share = k as f64 / n;
            largest = largest
                .max((share - x * pair[0]).abs())
                .max((share - next_x * pair[1]).abs());
        }
    }
    Some(largest)
}

/// The L2 star discrepancy, the root mean square instead of the largest difference, in any dimension, `O(N^2 d)`; `None` for no points.
///
/// T. T. Warnock, "Computational investigations of low-discrepancy point sets" (1972):
/// `3^(-d) - 2^(1-d)/N sum_i prod_k (1 - x_ik^2) + 1/N^2 sum_i sum_j prod_k (1 - max(x_ik, x_jk))`.
pub fn l2_star(points: &Points) -> Option<f64> {
    if points.is_empty() {
        return None;
    }
    let (n, d) = (points.len() as f64, points.dimensions() as i32);
    let single: f64 = points
        .iter()
        .map(|x| x.iter().map(|x| 1.0 - x * x).product::<f64>())
        .sum();
    let pair = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| 1.0 - x.max(*y)).product::<f64>();
    let mut double = 0.0;
    for (i, x) in points.iter().enumerate() {
        double += pair(x, x) + 2.0 * points.iter().take(i).map(|y| pair(x, y)).sum::<f64>();
    }
    let squared = 3_f64.powi(-d) - 2_f64.powi(1 - d) * single / n + double / (n * n);
    Some(squared.max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::PointSet;
    use crate::random::Stream;

    fn points(dimensions: usize, coordinates: &[f64]) -> Points {
        Points::new(dimensions, coordinates.to_vec()).unwrap()
    }

    #[test]
    fn a_single_point() {
        assert!((star_1d(&points(1, &[0.5])).unwrap() - 0.5).abs() < 1e-15);
        assert!((star_1d(&points(1, &[0.9])).unwrap() - 0.9).abs() < 1e-15);
        // Closed boxes that just contain it have volume 0.35 and share 1; open ones up to x = 0.5 volume 0.5 and share 0.
        assert!((star_2d(&points(2, &[0.5, 0.7])).unwrap() - 0.7).abs() < 1e-15);
        assert!((star_2d(&points(2, &[0.5, 0.6])).unwrap() - 0.7).abs() < 1e-15);
        // integral of (1[t > x] - t)^2 = x^3/3 + (1-x)^3/3 for one point.
        let l2 = l2_star(&points(1, &[0.3])).unwrap();
        assert!((l2 * l2 - (0.027 + 0.343) / 3.0).abs() < 1e-15);
        assert!(star_1d(&points(1, &[])).is_none() && star_2d(&points(1, &[0.5])).is_none());
    }

    /// Against all corners that matter, counted one by one: ties included.
    #[test]
    fn two_dimensions_agree_with_counting() {
        let mut stream = Stream::new(5, 0);
        for n in [1, 2, 3, 7, 20] {
            for tie in [false, true] {
                let mut random = || {
                    let u = stream.number();
                    if tie { (u * 4.0).floor() / 4.0 } else { u }
                };
                let coordinates: Vec<f64> = (0..2 * n).map(|_| random()).collect();
                let set = points(2, &coordinates);
                let ends = |axis: usize| set.iter().map(move |p| p[axis]).chain([1.0]);
                let mut expected = 0.0_f64;
                for x in ends(0) {
                    for y in ends(1) {
                        let closed = set.iter().filter(|p| p[0] <= x && p[1] <= y).count() as f64 / n as f64;
                        let open = set.iter().filter(|p| p[0] < x && p[1] < y).count() as f64 / n as f64;
                        expected = expected.max((closed - x * y).abs()).max((open - x * y).abs());
                    }
                }
                let star = star_2d(&set).unwrap();
                assert!((star - expected).abs() < 1e-14, "{n} {tie}: {star} {expected}");
            }
        }
    }

    #[test]
    fn l2_agrees_with_integration() {
        let set = PointSet::Halton.points(10, 2, Some(9)).unwrap();
        let m = 800;
        let mut sum = 0.0;
        for i in 0..m * m {
            let t = [i % m, i / m].map(|k| (k as f64 + 0.5) / m as f64);
            let share = set.iter().filter(|p| p[0] < t[0] && p[1] < t[1]).count() as f64 / 10.0;
            sum += (share - t[0] * t[1]).powi(2);
        }
        let expected = (sum / (m * m) as f64).sqrt();
        assert!((l2_star(&set).unwrap() / expected - 1.0).abs() < 5e-3);
    }

    /// Niederreiter (1992), theorem 3.8, equation 3.6: the van der Corput-Hammersley set stays below this bound.
    #[test]
    fn hammersley_stays_below_its_bound() {
        for log in 4..=10 {
            let n = 1 << log;
            let star = star_2d(&PointSet::Hammersley.points(n, 2, None).unwrap()).unwrap();
            let random = star_2d(&PointSet::Random.points(n, 2, Some(1)).unwrap()).unwrap();
            assert!(
                star * n as f64 <= f64::from(log) / 3.0 + 19.0 / 9.0 + 1e-9,
                "{n}: {star}"
            );
            assert!(star < random);
        }
    }
}

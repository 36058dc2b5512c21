//! Directions of a hemisphere, drawn more often where much light comes from.

use crate::hemisphere::{Frame, unit_circle};
use glam::{Vec2, Vec3};
use std::f32::consts::SQRT_2;

/// Rings around the normal. Higher values follow finer detail; lower values learn faster.
pub const RINGS: usize = 4;
/// Sectors of each ring: the same trade.
pub const SECTORS: usize = 16;
/// Parts of the hemisphere, all of the same cosine-weighted solid angle.
pub const PARTS: usize = RINGS * SECTORS;

/// A density over the hemisphere: that of the cosine times a factor, constant in each of [`PARTS`] parts. Stratified numbers give stratified directions.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HemisphereGuide {
    /// Where the part of the numbers begins that stands for each ring.
    rings: [f32; RINGS],
    /// The same for the sectors of each ring.
    sectors: [[f32; SECTORS]; RINGS],
}

impl HemisphereGuide {
    /// In proportion to `weights`, ring by ring, at least 0; `None` if their sum is 0 or not finite. `floor`, in (0, 1\]: the least factor.
    pub fn new(weights: &[f32; PARTS], floor: f32) -> Option<Self> {
        let total: f32 = weights.iter().sum();
        if !(total > 0.0 && total < f32::INFINITY) {
            return None;
        }
        let mass = |weight: f32| floor / PARTS as f32 + (1.0 - floor) * (weight / total);
        let mut guide = Self {
            rings: [0.0; RINGS],
            sectors: [[0.0; SECTORS]; RINGS],
        };
        let mut before = 0.0;
        for (ring, weights) in weights.as_chunks::<SECTORS>().0.iter().enumerate() {
            let (starts, of_ring) = starts(weights.map(mass));
            guide.sectors[ring] = starts.map(|start| (start / of_ring).min(1.0));
            guide.rings[ring] = f32::min(before, 1.0);
            before += of_ring;
        }
        Some(guide)
    }

    /// A direction around `normal`, both unit vectors, and its factor: times cosine / pi it is the density per sr.
    #[inline]
    pub fn sample(&self, normal: Vec3, u: Vec2) -> (Vec3, f32) {
        const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
        let (ring, start, height) = interval_at(&self.rings, u.x);
        let sin_sq = (ring as f32 + ((u.x - start) / height).min(BELOW_ONE)) / RINGS as f32;
        let (sector, start, width) = interval_at(&self.sectors[ring], u.y);
        let turn = (sector as f32 + ((u.y - start) / width).min(BELOW_ONE)) / SECTORS as f32;
        // The rim would be a direction of density 0.
        let z = (1.0 - sin_sq).max(1e-9).sqrt();
        let local = (unit_circle(turn) * sin_sq.sqrt()).extend(z);
        (Frame::steady(normal).to_world(local), height * width * PARTS as f32)
    }

    /// The factor of `direction`, as [`HemisphereGuide::sample`] reports it.
    #[inline]
    pub fn density(&self, normal: Vec3, direction: Vec3) -> f32 {
        let part = part_of(normal, direction);
        let ring = part / SECTORS;
        interval(&self.rings, ring).1 * interval(&self.sectors[ring], part % SECTORS).1 * PARTS as f32
    }

    /// All it consists of: where the rings begin, then the sectors of each ring.
    pub fn starts(&self) -> impl Iterator<Item = f32> {
        self.rings.iter().chain(self.sectors.as_flattened()).copied()
    }

    /// Whether it can be the outcome of [`HemisphereGuide::new`]: what was read from a file may be anything.
    pub fn is_sound(&self) -> bool {
        fn ascend(starts: &[f32]) -> bool {
            starts[0] == 0.0 && starts.is_sorted_by(|a, b| a < b) && starts.iter().all(|start| *start < 1.0)
        }
        ascend(&self.rings) && self.sectors.iter().all(|starts| ascend(starts))
    }
}

/// In which of the [`PARTS`] parts of the hemisphere around `normal` a direction lies, both unit vectors.
#[inline]
pub fn part_of(normal: Vec3, direction: Vec3) -> usize {
    let around = Frame::steady(normal).to_local(direction).truncate();
    let ring = (around.length_squared() * RINGS as f32) as usize;
    ring.min(RINGS - 1) * SECTORS + sector_of(around)
}

/// In which of 16 equal sectors of the plane a vector lies.
#[inline]
fn sector_of(v: Vec2) -> usize {
    /// Of an eighth of pi.
    const TAN: f32 = SQRT_2 - 1.0;
    let a = v.abs();
    let within = usize::from(a.y >= TAN * a.x) + usize::from(a.y >= a.x) + usize::from(TAN * a.y >= a.x);
    match (v.x >= 0.0, v.y >= 0.0) {
        (true, true) => within,
        (false, true) => 7 - within,
        (false, false) => 8 + within,
        (true, false) => 15 - within,
    }
}

/// Where intervals of these `widths` begin that lie side by side, and where the last one ends.
fn starts<const N: usize>(widths: [f32; N]) -> ([f32; N], f32) {
    let mut end = 0.0;
    let starts = widths.map(|width| {
        let start = end;
        end += width;
        start
    });
    (starts, end)
}

/// The interval of \[0, 1) that holds `u`: number, start and width.
#[inline]
fn interval_at<const N: usize>(starts: &[f32; N], u: f32) -> (usize, f32, f32) {
    let index = starts.iter().map(|&start| usize::from(start <= u)).sum::<usize>() - 1;
    let (start, width) = interval(starts, index);
    (index, start, width)
}

/// Start and width of an interval.
#[inline]
fn interval<const N: usize>(starts: &[f32; N], index: usize) -> (f32, f32) {
    let end = starts.get(index + 1).copied().unwrap_or(1.0);
    (starts[index], end - starts[index])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hemisphere::uniform_sphere;
    use crate::random::Random;
    use crate::statistics::{chi_square_p, pooled_chi_square};
    use proptest::prelude::*;

    fn weights(seed: u64, contrast: f32) -> [f32; PARTS] {
        let random = Random::new(seed, 1, 0);
        std::array::from_fn(|part| random.f32(part as u32).powf(contrast))
    }

    /// All together fail once in 1,000 seeds.
    #[test]
    fn directions_follow_their_densities() {
        for (seed, contrast) in [(1, 0.0), (2, 1.0), (3, 8.0)] {
            let normal = uniform_sphere(Random::new(seed, 2, 0).vec2(0));
            let guide = HemisphereGuide::new(&weights(seed, contrast), 0.2).expect("weights are above 0");
            let random = Random::new(seed, 3, 0);
            let draws = 1 << 17;
            let mut bins = [0_u64; PARTS];
            let mut expected = [0.0; PARTS];
            for i in 0..draws {
                let (direction, factor) = guide.sample(normal, random.vec2(2 * i));
                let part = part_of(normal, direction);
                bins[part] += 1;
                expected[part] = f64::from(draws) * f64::from(factor) / PARTS as f64;
            }
            let (statistic, dof) = pooled_chi_square(&bins, &expected, 5.0);
            assert!(chi_square_p(statistic, dof) > 1e-3 / 3.0);
        }
    }

    /// The mean of f x cosine / density over what is drawn is the integral, by parts that no part of the guide is aligned with. Fails once in 1,000 seeds.
    #[test]
    fn the_density_is_one_of_solid_angle() {
        let normal = Vec3::new(0.3, -0.5, 0.8).normalize();
        let guide = HemisphereGuide::new(&weights(5, 4.0), 0.2).expect("weights are above 0");
        let toward = Vec3::new(0.8, 0.1, 0.6).normalize();
        // cos^2 of the angle to a direction: integral over the hemisphere with the cosine = pi / 4 (1 + (n.t)^2).
        let f = |direction: Vec3| f64::from(direction.dot(toward).powi(2));
        let wanted = std::f64::consts::PI / 4.0 * (1.0 + f(normal));
        let random = Random::new(9, 0, 0);
        let draws = 1 << 16;
        let (mut sum, mut sum_sq) = (0.0, 0.0);
        for i in 0..draws {
            let (direction, factor) = guide.sample(normal, random.vec2(2 * i));
            let y = f(direction) * std::f64::consts::PI / f64::from(factor);
            sum += y;
            sum_sq += y * y;
        }
        let mean = sum / f64::from(draws);
        let error = ((sum_sq / f64::from(draws) - mean * mean) / f64::from(draws)).sqrt();
        assert!(
            (mean - wanted).abs() < 3.3 * error,
            "{mean} for {wanted}, error {error}"
        );
    }

    proptest! {
        #[test]
        fn what_is_drawn_is_what_is_reported(
            normal in prop::array::uniform2(0.0_f32..1.0),
            u in prop::array::uniform2(prop_oneof![Just(0.0_f32), Just(0.5), Just(1.0 - f32::EPSILON / 2.0), 0.0_f32..1.0]),
            contrast in 0.0_f32..20.0,
        ) {
            let normal = uniform_sphere(Vec2::from_array(normal));
            let guide = HemisphereGuide::new(&weights(7, contrast), 0.2).expect("weights are above 0");
            prop_assert!(guide.is_sound());
            let (direction, factor) = guide.sample(normal, Vec2::from_array(u));
            prop_assert!((direction.length() - 1.0).abs() < 1e-5 && direction.dot(normal) > 0.0);
            prop_assert!((0.19..=PARTS as f32).contains(&factor));
            // At the edge of a part rounding decides which one it is.
            let inside = u.iter().all(|u| *u > 0.0 && *u != 0.5 && *u < 0.9999);
            let near_edge = [-1e-5, 1e-5].iter().any(|d| {
                let moved = (direction + Frame::steady(normal).tangent * *d + Frame::steady(normal).bitangent * *d * 0.7).normalize();
                part_of(normal, moved) != part_of(normal, direction)
            });
            if inside && !near_edge {
                prop_assert_eq!(guide.density(normal, direction), factor);
            }
        }
    }

    #[test]
    fn nothing_to_go_by_is_no_guide() {
        assert_eq!(HemisphereGuide::new(&[0.0; PARTS], 0.2), None);
        assert_eq!(HemisphereGuide::new(&[f32::MAX; PARTS], 0.2), None);
    }
}

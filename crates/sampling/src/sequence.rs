//! The numbers a path consumes: eight Owen-scrambled Sobol' dimensions per path vertex.
//!
//! Dimensions of a vertex: 0, 1 position in the pixel (first vertex only); 2 choice of the light; 3, 4 point on the
//! light; 5 BSDF lobe; 6, 7 BSDF direction. The first vertex uses the sample number as index, so all of its
//! dimensions are stratified jointly; later vertices visit the same points in an order of their own (padding: Burley
//! 2020, section 4), so that they are stratified in themselves and independent of each other.

use crate::hash::{GOLDEN, hash3, mix};
use crate::random::unit_f32;
use crate::sobol::{reversed_owen_scramble, reversed_sobol};
use glam::Vec2;

/// The sample sequence of one pixel at one sample number.
#[derive(Clone, Copy, Debug)]
pub struct PixelSequence {
    key: u32,
    reversed_index: u32,
}

impl PixelSequence {
    /// Sample number `sample` of `pixel`. The samples 0, 1, 2, ... of a pixel are stratified in every power of two;
    /// pixels and seeds are independent of each other.
    #[inline]
    pub const fn new(seed: u64, pixel: u32, sample: u32) -> Self {
        let key = hash3((seed >> 32) as u32, seed as u32, pixel);
        Self {
            key,
            reversed_index: sample.reverse_bits(),
        }
    }

    /// The numbers for path vertex `vertex`; 0 is the camera and the first hit.
    #[inline]
    pub const fn vertex(&self, vertex: u32) -> VertexSequence {
        let key = mix(self.key.wrapping_add(GOLDEN.wrapping_mul(vertex)));
        let step = mix(key ^ self.key.rotate_left(16)) | 1;
        if vertex == 0 {
            return VertexSequence {
                key: [key, step],
                reversed_index: self.reversed_index,
            };
        }
        // A nested uniform scramble of the index, whose order reversal puts at the top. Differs from Burley section 4:
        // only the low 16 index bits move. The flips of the others are, for all samples below 65,536, one constant,
        // which the scramble of the points absorbs; leaving them out keeps the index short and the table reads few.
        let shuffled = reversed_owen_scramble(self.reversed_index, key);
        VertexSequence {
            key: [key, step],
            reversed_index: shuffled & 0xffff_0000 | self.reversed_index & 0xffff,
        }
    }
}

/// The eight numbers of one path vertex.
#[derive(Clone, Copy, Debug)]
pub struct VertexSequence {
    /// Seed of dimension 0 before mixing, and the odd step between the dimensions.
    key: [u32; 2],
    reversed_index: u32,
}

impl VertexSequence {
    /// 32 bits of `dimension` (0 to 7).
    #[inline]
    pub fn u32(&self, dimension: u32) -> u32 {
        // The step is random itself: hashes of numbers a constant apart are not independent enough for the scramble, whose
        // leading bits depend on few bits of the seed.
        let seed = mix(self.key[0].wrapping_add(self.key[1].wrapping_mul(dimension)));
        reversed_owen_scramble(reversed_sobol(self.reversed_index, dimension), seed).reverse_bits()
    }

    /// A number in `[0, 1)` with 24 bits, of `dimension` (0 to 7).
    #[inline]
    pub fn f32(&self, dimension: u32) -> f32 {
        unit_f32(self.u32(dimension))
    }

    /// The numbers of `first_dimension` and the one after it, each in `[0, 1)`.
    #[inline]
    pub fn vec2(&self, first_dimension: u32) -> Vec2 {
        Vec2::new(self.f32(first_dimension), self.f32(first_dimension + 1))
    }
}

/// `D` dimensions, from `first_dimension` on, of the first vertex (`PixelSequence::vertex(0)`) for `N` pixels,
/// 32 bits each, at one sample number. All pixels share the point and differ in its scramble, so there is nothing to look
/// up per pixel, and the compiler takes several pixels at a time.
#[allow(
    clippy::needless_range_loop,
    reason = "pixels are the inner index of what the outer loop fills"
)]
#[inline(always)]
pub fn first_vertices<const D: usize, const N: usize>(
    seed: u64,
    pixels: &[u32; N],
    sample: u32,
    first_dimension: u32,
) -> [[u32; N]; D] {
    let points: [u32; D] = std::array::from_fn(|d| reversed_sobol(sample.reverse_bits(), first_dimension + d as u32));
    let mut numbers = [[0; N]; D];
    for i in 0..N {
        let [key, step] = PixelSequence::new(seed, pixels[i], sample).vertex(0).key;
        for d in 0..D {
            let scramble = mix(key.wrapping_add(step.wrapping_mul(first_dimension + d as u32)));
            numbers[d][i] = reversed_owen_scramble(points[d], scramble).reverse_bits();
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::{Moments, chi_square_p, normal_p_two_sided, pooled_chi_square};

    /// The cells of a grid of `1 << bits[k]` intervals in each dimension `k` that the first samples visit: as many as samples?
    fn visits_every_cell(sequence: impl Fn(u32) -> VertexSequence, dimensions: &[(u32, u32)]) -> bool {
        let bits: u32 = dimensions.iter().map(|&(_, bits)| bits).sum();
        let mut seen = vec![false; 1 << bits];
        for sample in 0..1 << bits {
            let point = sequence(sample);
            let cell = dimensions.iter().fold(0, |cell, &(d, bits)| {
                cell << bits | (u64::from(point.u32(d)) >> (32 - bits)) as usize
            });
            seen[cell] = true;
        }
        seen.into_iter().all(|s| s)
    }

    #[test]
    fn many_pixels_at_a_time_get_the_same_numbers() {
        for (seed, first, sample) in [(0, 0, 0), (9, 77, 5), (u64::MAX, u32::MAX - 3, 1 << 20)] {
            let pixels = std::array::from_fn(|i| first.wrapping_add(i as u32));
            let numbers: [[u32; 16]; 6] = first_vertices(seed, &pixels, sample, 2);
            for i in 0..16_u32 {
                let vertex = PixelSequence::new(seed, first.wrapping_add(i), sample).vertex(0);
                for d in 2..8 {
                    assert_eq!(numbers[d as usize - 2][i as usize], vertex.u32(d));
                }
            }
        }
    }

    #[test]
    fn pixel_position_is_a_net() {
        for pixel in 0..50 {
            for a in 0..=10 {
                assert!(visits_every_cell(
                    |s| PixelSequence::new(3, pixel, s).vertex(0),
                    &[(0, a), (1, 10 - a)]
                ));
            }
        }
    }

    #[test]
    fn every_dimension_of_every_vertex_is_stratified() {
        for vertex in 0..4 {
            for first in [0, 1024, 65_536 - 256] {
                for dimension in 0..8 {
                    let sequence = |s| PixelSequence::new(5, 77, first + s).vertex(vertex);
                    assert!(
                        visits_every_cell(sequence, &[(dimension, 8)]),
                        "vertex {vertex}, dimension {dimension}"
                    );
                }
                // Scrambling turns any aligned block into a net of the same quality.
                assert!(visits_every_cell(
                    |s| PixelSequence::new(5, 77, first + s).vertex(vertex),
                    &[(0, 4), (1, 4)]
                ));
            }
        }
    }

    #[test]
    fn light_choice_and_pixel_are_stratified_jointly() {
        for pixel in 0..20 {
            let sequence = |s| PixelSequence::new(1, pixel, s).vertex(0);
            // Dimensions 0, 1, 2 have quality t = 1, so one bit less than a perfect net.
            for (a, b, c) in [(2, 2, 2), (1, 1, 4), (0, 3, 3), (3, 0, 3)] {
                let mut seen = vec![0; 1 << (a + b + c)];
                for s in 0..1 << (a + b + c + 1) {
                    let p = sequence(s);
                    let bin = |d, bits: u32| (u64::from(p.u32(d)) >> (32 - bits)) as usize;
                    seen[(bin(0, a) << b | bin(1, b)) << c | bin(2, c)] += 1;
                }
                assert!(seen.into_iter().all(|count| count == 2));
            }
        }
    }

    /// p-value of 16 x 16 bins of pairs against uniformity.
    fn pair_p(count: u32, pair: impl Fn(u32) -> (u32, u32)) -> f64 {
        let mut bins = vec![0_u64; 256];
        for i in 0..count {
            let (a, b) = pair(i);
            bins[(a >> 28 << 4 | b >> 28) as usize] += 1;
        }
        let (statistic, dof) = pooled_chi_square(&bins, &vec![f64::from(count) / 256.0; 256], 5.0);
        chi_square_p(statistic, dof)
    }

    /// All together fail once in 1,000 seeds. Over pixels, because within one pixel the numbers are meant to be dependent.
    #[test]
    fn numbers_are_independent_over_pixels() {
        let n = 1 << 16;
        let limit = 1e-3 / (4.0 * (28.0 + 8.0 * 4.0));
        let at = |pixel, sample, vertex, d| PixelSequence::new(42, pixel, sample).vertex(vertex).u32(d);
        for (sample, vertex) in [(0, 0), (3, 0), (0, 1), (5, 2)] {
            for d in 0..8 {
                for e in 0..d {
                    assert!(
                        pair_p(n, |i| (at(i, sample, vertex, d), at(i, sample, vertex, e))) > limit,
                        "dimensions {d} {e}"
                    );
                }
                assert!(
                    pair_p(n, |i| (at(i, sample, vertex, d), at(i + 1, sample, vertex, d))) > limit,
                    "pixels, {d}"
                );
                assert!(
                    pair_p(n, |i| (at(i, sample, vertex, d), at(i, sample, vertex + 1, d))) > limit,
                    "vertices, {d}"
                );
                let other_seed = |i| PixelSequence::new(43, i, sample).vertex(vertex).u32(d);
                assert!(
                    pair_p(n, |i| (at(i, sample, vertex, d), other_seed(i))) > limit,
                    "seeds, {d}"
                );
                let fine = |i| (at(i, sample, vertex, d) << 4, at(i, sample, vertex, d) << 12);
                assert!(pair_p(n, fine) > limit, "lower bits, {d}");
            }
        }
    }

    /// Mean and variance of the mean of a smooth function of `dimensions` over `n` samples, over pixels.
    fn integrate(n: u32, vertex: u32, dimensions: &[u32]) -> Moments {
        let mut moments = Moments::default();
        for pixel in 0..400 {
            let sum: f64 = (0..n)
                .map(|s| {
                    let point = PixelSequence::new(8, pixel, s).vertex(vertex);
                    dimensions
                        .iter()
                        .map(|&d| f64::from(point.f32(d)) * 2.0)
                        .product::<f64>()
                })
                .sum();
            moments.push(sum / f64::from(n));
        }
        moments
    }

    /// Owen (1997): the variance of a smooth integrand falls about like n^-3, independent numbers would give n^-1. The
    /// mean fails once in 1,000 seeds.
    #[test]
    fn smooth_integrals_converge_fast_and_without_bias() {
        for (vertex, dimensions) in [(0, &[0, 1][..]), (0, &[2, 3, 4]), (1, &[2, 3, 4]), (2, &[6, 7])] {
            let (few, many) = (integrate(16, vertex, dimensions), integrate(256, vertex, dimensions));
            for moments in [&few, &many] {
                // The 24-bit numbers are rounded down: 2^-24 of bias for each dimension.
                let z = (moments.mean() - 1.0) / moments.standard_error().max(1e-6);
                assert!(normal_p_two_sided(z) > 1e-3 / 8.0, "vertex {vertex}: z {z}");
            }
            let gain = few.variance() / many.variance();
            assert!(
                gain > 16.0 * 8.0,
                "vertex {vertex}, {dimensions:?}: variance fell by {gain} only"
            );
        }
    }

    #[test]
    fn vertices_visit_the_samples_in_different_orders() {
        let order = |vertex: u32| -> Vec<u32> {
            (0..16)
                .map(|s| PixelSequence::new(1, 2, s).vertex(vertex).reversed_index.reverse_bits())
                .collect()
        };
        assert_eq!(order(0), (0..16).collect::<Vec<u32>>());
        assert_ne!(order(1), order(0));
        assert_ne!(order(1), order(2));
        let blocks: std::collections::HashSet<u32> = order(1).into_iter().map(|index| index / 16).collect();
        assert_eq!(blocks.len(), 1, "an aligned block stays a block");
    }
}

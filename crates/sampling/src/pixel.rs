//! Where in its pixel each sample lies.

use crate::hash::{hash2, hash3};
use crate::points::{blue_noise, radical_inverse};
use crate::random::Random;
use crate::sequence::first_vertices;
use crate::sobol::sobol;

/// Samples after which a set that must know their number begins anew: a power of two, and a square. Higher values suit long renderings;
/// lower values are complete sooner.
const BLOCK: u32 = 64;

/// Strata of a block in each direction.
const STRATA: u32 = 8;

/// A way to spread the samples of a pixel over its area. All are unbiased at any number of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PixelSampler {
    /// Independent positions.
    Random,
    /// One position in each of 8 x 8 strata per 64 samples, in an order of the pixel's own.
    Stratified,
    /// Radical inverses in bases 2 and 3, shifted around the torus for each pixel.
    Halton,
    /// Hammersley's set of 64 points, shifted for each pixel and every 64 samples.
    Hammersley,
    /// Owen-scrambled Sobol', stratified jointly with the choice of lights and the points on them.
    #[default]
    Sobol,
    /// Sobol' points shifted for each pixel by a blue-noise mask, so that the errors of neighbouring pixels differ as much as they can: I. Georgiev and M. Fajardo,
    /// "Blue-noise dithered sampling" (2016). The error is no smaller, but looks so.
    BlueNoise,
}

impl PixelSampler {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Random,
        Self::Stratified,
        Self::Halton,
        Self::Hammersley,
        Self::Sobol,
        Self::BlueNoise,
    ];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Stratified => "stratified",
            Self::Halton => "halton",
            Self::Hammersley => "hammersley",
            Self::Sobol => "sobol",
            Self::BlueNoise => "blue-noise",
        }
    }

    /// The positions of sample number `sample` in `N` pixels of a row that follow each other, from column `x` of row `y` on, in an image `width`
    /// pixels wide: for each coordinate and pixel 32 bits after the point.
    // Inlined as far as the default goes, for callers with wider vectors than others have.
    #[inline(always)]
    pub fn positions<const N: usize>(self, seed: u64, [x, y]: [u32; 2], width: u32, sample: u32) -> [[u32; N]; 2] {
        match self {
            Self::Sobol => first_vertices(seed, y * width + x, sample, 0),
            _ => self.other_positions(seed, [x, y], width, sample),
        }
    }

    /// [`PixelSampler::positions`] of all but the default.
    #[inline(never)]
    fn other_positions<const N: usize>(self, seed: u64, [x, y]: [u32; 2], width: u32, sample: u32) -> [[u32; N]; 2] {
        let first_pixel = y * width + x;
        let pixel = |i: usize| first_pixel.wrapping_add(i as u32);
        let each = |position: &dyn Fn(usize) -> [u32; 2]| {
            let pairs: [[u32; 2]; N] = std::array::from_fn(position);
            [0, 1].map(|axis| pairs.map(|pair| pair[axis]))
        };
        // The point of the sample, and random vectors to move it by that stay the same for a pixel and all samples of a round.
        let shifted = |point: [u32; 2], round: u32| {
            each(&|i| {
                let shift = Random::new(seed, pixel(i), round);
                [0, 1].map(|axis| point[axis].wrapping_add(shift.u32(axis as u32)))
            })
        };
        let (round, index) = (sample / BLOCK, sample % BLOCK);
        match self {
            Self::Sobol => first_vertices(seed, first_pixel, sample, 0),
            Self::Random => each(&|i| {
                let random = Random::new(seed, pixel(i), sample);
                [random.u32(0), random.u32(1)]
            }),
            Self::Stratified => each(&|i| {
                let random = Random::new(seed, pixel(i), sample);
                let order = hash3(seed as u32, pixel(i), round);
                let stratum = (index * (order | 1)).wrapping_add(order >> 16) % BLOCK;
                let within = |cell: u32, u: u32| cell * (u32::MAX / STRATA + 1) + u / STRATA;
                [
                    within(stratum % STRATA, random.u32(0)),
                    within(stratum / STRATA, random.u32(1)),
                ]
            }),
            Self::Halton => shifted([sobol(sample, 0), bits(radical_inverse(3, sample))], 0),
            Self::Hammersley => {
                // In golden-ratio steps, so that the first points of a block do not crowd on one side.
                let point = index * 39 % BLOCK;
                shifted([point * (u32::MAX / BLOCK + 1), sobol(point, 0)], round)
            }
            Self::BlueNoise => {
                let mask = blue_noise::mask();
                let size = blue_noise::SIZE as u32;
                // One mask for both coordinates, moved, and both moved with the seed.
                let shift = |i: usize, axis: u32| {
                    let moved = hash2(seed as u32, axis);
                    let (column, row) = ((x + i as u32 + moved) % size, (y + (moved >> 16)) % size);
                    mask[(row * size + column) as usize].wrapping_add(hash3(seed as u32, (seed >> 32) as u32, axis))
                };
                each(&|i| [0, 1].map(|axis| sobol(sample, axis).wrapping_add(shift(i, axis))))
            }
        }
    }
}

/// The first 32 bits after the point.
fn bits(u: f64) -> u32 {
    (u * 4_294_967_296.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::unit_f64;
    use crate::statistics::{Moments, chi_square_p, normal_p_two_sided, pooled_chi_square, sidak};

    /// The mean over pixels of an integral over each, and its root mean square error, from `n` samples.
    fn integrate(sampler: PixelSampler, n: u32) -> Moments {
        let width = 64;
        let mut moments = Moments::default();
        for y in 0..16 {
            let mut sums = [0.0; 64];
            for sample in 0..n {
                let [u, v]: [[u32; 64]; 2] = sampler.positions(5, [0, y], width, sample);
                for (sum, (u, v)) in sums.iter_mut().zip(u.into_iter().zip(v)) {
                    *sum += (unit_f64(u) + unit_f64(v)).exp();
                }
            }
            sums.iter()
                .for_each(|sum| moments.push(sum / f64::from(n) - 1_f64.exp_m1().powi(2)));
        }
        moments
    }

    /// Means over 1,024 pixels, complete and incomplete blocks: each is unbiased, all but `random` beat it by far. Together they fail once in 1,000 seeds.
    #[test]
    fn all_are_unbiased_and_better_than_random() {
        for n in [5, 64, 100] {
            let random = integrate(PixelSampler::Random, n).variance();
            for sampler in PixelSampler::ALL {
                let moments = integrate(sampler, n);
                // Neighbours under the mask are far from independent, to the better.
                let z = moments.mean() / moments.standard_error();
                assert!(
                    normal_p_two_sided(z) > sidak(1e-3, 18),
                    "{sampler:?} after {n}: z = {z}"
                );
                let gain = random / moments.variance();
                assert!(
                    sampler == PixelSampler::Random || n < 64 || gain > 5.0,
                    "{sampler:?} after {n}: {gain}"
                );
            }
        }
    }

    #[test]
    fn blocks_are_stratified() {
        let sets = [PixelSampler::Stratified, PixelSampler::Sobol];
        for sampler in sets {
            for first in [0, 64, 640] {
                let mut seen = [false; 64];
                for sample in first..first + 64 {
                    let [[u], [v]] = sampler.positions(1, [17, 3], 100, sample);
                    seen[(u >> 29 << 3 | v >> 29) as usize] = true;
                }
                assert!(seen.into_iter().all(|s| s), "{sampler:?}");
            }
        }
    }

    /// Together they fail once in 1,000 seeds.
    #[test]
    fn positions_are_uniform_over_pixels() {
        for sampler in PixelSampler::ALL {
            let mut bins = [0_u64; 64];
            for y in 0..64 {
                let [u, v]: [[u32; 64]; 2] = sampler.positions(9, [0, y], 64, 11);
                u.into_iter()
                    .zip(v)
                    .for_each(|(u, v)| bins[(u >> 29 << 3 | v >> 29) as usize] += 1);
            }
            let (statistic, dof) = pooled_chi_square(&bins, &[64.0; 64], 5.0);
            assert!(chi_square_p(statistic, dof) > sidak(1e-3, 6), "{sampler:?}: {bins:?}");
        }
    }
}

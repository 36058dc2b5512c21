//! The numbers with which paths begin: where in its pixel each sample lies, which light it asks first, and for which point of it.

use crate::hash::{hash2, hash3};
use crate::points::{PRIMES, blue_noise, radical_inverse};
use crate::random::Random;
use crate::sequence::first_vertices;
use crate::sobol::sobol;

/// Samples after which a set that must know their number begins anew: a power of two, and a square. Higher values suit long renderings;
/// lower values are complete sooner.
const BLOCK: u32 = 64;

/// Strata of a block in each direction.
const STRATA: u32 = 8;

/// A way to spread the samples of a pixel, over its area, over the lights and over each light. All are unbiased at any number of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PixelSampler {
    /// Independent numbers.
    Random,
    /// One sample in each of 8 x 8 strata of the pixel and of the light, and in each of 64 of the choice, per 64 samples, in orders of the pixel's own.
    Stratified,
    /// Radical inverses in the first prime bases, shifted around the torus for each pixel.
    Halton,
    /// Hammersley's set of 64 points, shifted for each pixel and every 64 samples.
    Hammersley,
    /// Owen-scrambled Sobol'.
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

    /// `D` dimensions of the first path vertex (see [`crate::sequence`]), from `first_dimension` on and at most up to dimension 7, for sample number
    /// `sample` in each of `N` pixels, given by column and row, in an image `width` pixels wide: 32 bits after the point each.
    // Inlined as far as the default goes, for callers with wider vectors than others have.
    #[inline(always)]
    pub fn numbers<const D: usize, const N: usize>(
        self,
        seed: u64,
        pixels: &[[u32; 2]; N],
        width: u32,
        sample: u32,
        first_dimension: u32,
    ) -> [[u32; N]; D] {
        match self {
            Self::Sobol => first_vertices(seed, &numbered(pixels, width), sample, first_dimension),
            _ => std::array::from_fn(|d| self.dimension(seed, pixels, width, sample, first_dimension + d as u32)),
        }
    }

    /// One dimension of [`PixelSampler::numbers`], not in a hurry.
    #[inline(never)]
    fn dimension<const N: usize>(
        self,
        seed: u64,
        pixels: &[[u32; 2]; N],
        width: u32,
        sample: u32,
        dimension: u32,
    ) -> [u32; N] {
        let numbered = numbered(pixels, width);
        let pixel = |i: usize| numbered[i];
        // The point of the sample, moved by a random vector that stays the same for a pixel and all samples of a round.
        let shifted = |point: u32, round: u32| {
            std::array::from_fn(|i| point.wrapping_add(Random::new(seed, pixel(i), round).u32(dimension)))
        };
        let (round, index) = (sample / BLOCK, sample % BLOCK);
        match self {
            Self::Sobol => first_vertices::<1, N>(seed, &numbered, sample, dimension)[0],
            Self::Random => std::array::from_fn(|i| Random::new(seed, pixel(i), sample).u32(dimension)),
            Self::Stratified => std::array::from_fn(|i| {
                let Strata { group, count, step } = Strata::of(dimension);
                let order = hash3(seed as u32 ^ group, pixel(i), round);
                let stratum = (index * (order | 1)).wrapping_add(order >> 16) % BLOCK / step % count;
                let within = Random::new(seed, pixel(i), sample).u32(dimension);
                stratum * (u32::MAX / count + 1) + within / count
            }),
            Self::Halton => shifted(bits(radical_inverse(PRIMES[dimension as usize], sample)), 0),
            Self::Hammersley => {
                // In golden-ratio steps, so that the first points of a block do not crowd on one side.
                let point = index * 39 % BLOCK;
                match dimension {
                    0 => shifted(point * (u32::MAX / BLOCK + 1), round),
                    _ => shifted(bits(radical_inverse(PRIMES[dimension as usize - 1], point)), round),
                }
            }
            Self::BlueNoise => {
                // One mask for all dimensions, moved, and all moved with the seed.
                let (mask, size) = (blue_noise::mask(), blue_noise::SIZE as u32);
                let moved = hash2(seed as u32, dimension);
                let shift = hash3(seed as u32, (seed >> 32) as u32, dimension).wrapping_add(sobol(sample, dimension));
                std::array::from_fn(|i| {
                    let [x, y] = pixels[i];
                    let (column, row) = ((x + moved) % size, (y + (moved >> 16)) % size);
                    mask[(row * size + column) as usize].wrapping_add(shift)
                })
            }
        }
    }
}

/// Numbers of pixels given by column and row, row by row.
#[inline(always)]
fn numbered<const N: usize>(pixels: &[[u32; 2]; N], width: u32) -> [u32; N] {
    let mut numbers = [0; N];
    for (number, [x, y]) in numbers.iter_mut().zip(pixels) {
        *number = (y * width).wrapping_add(*x);
    }
    numbers
}

/// How a dimension is cut into strata: it and its neighbour into squares if they are coordinates of one place.
struct Strata {
    /// Dimensions of one group are cut together.
    group: u32,
    /// Strata along this dimension.
    count: u32,
    /// The stratum is the group's over this, counted around.
    step: u32,
}

impl Strata {
    fn of(dimension: u32) -> Self {
        let in_square = |group, axis| Self {
            group,
            count: STRATA,
            step: if axis == 0 { 1 } else { STRATA },
        };
        match dimension {
            0 | 1 => in_square(0, dimension),
            3 | 4 => in_square(3, dimension - 3),
            6 | 7 => in_square(6, dimension - 6),
            _ => Self {
                group: dimension,
                count: BLOCK,
                step: 1,
            },
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

    /// The first pixels of row `y`.
    fn row<const N: usize>(y: u32) -> [[u32; 2]; N] {
        std::array::from_fn(|x| [x as u32, y])
    }

    /// The mean over pixels of an integral over each, and its root mean square error, from `n` samples: over the pixel, the choice of a light
    /// and the light at once.
    fn integrate(sampler: PixelSampler, n: u32) -> Moments {
        let width = 64;
        let mut moments = Moments::default();
        for y in 0..16 {
            let mut sums = [0.0; 64];
            for sample in 0..n {
                let numbers: [[u32; 64]; 5] = sampler.numbers(5, &row(y), width, sample, 0);
                for (i, sum) in sums.iter_mut().enumerate() {
                    *sum += numbers.iter().map(|u| unit_f64(u[i])).sum::<f64>().exp();
                }
            }
            sums.iter()
                .for_each(|sum| moments.push(sum / f64::from(n) - 1_f64.exp_m1().powi(5)));
        }
        moments
    }

    /// Means over 1,024 pixels, complete and incomplete blocks: each is unbiased, all but `random` beat it by far (strata by at most 8: pixel, choice and
    /// light are stratified apart, and what their factors do together stays as it is). Together they fail once in 1,000 seeds.
    #[test]
    fn all_are_unbiased_and_better_than_random() {
        for (n, least_gain) in [(5, 0.0), (64, 3.0), (100, 2.0)] {
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
                    sampler == PixelSampler::Random || gain > least_gain,
                    "{sampler:?} after {n}: {gain}"
                );
            }
        }
    }

    #[test]
    fn blocks_are_stratified() {
        let full = |seen: [bool; 64]| seen.into_iter().all(|s| s);
        for sampler in [PixelSampler::Stratified, PixelSampler::Sobol] {
            for first in [0, 64, 640] {
                let (mut in_pixel, mut choices, mut on_light) = ([false; 64], [false; 64], [false; 64]);
                for sample in first..first + 64 {
                    let numbers: [[u32; 1]; 5] = sampler.numbers(1, &[[17, 3]], 100, sample, 0);
                    let [x, y, choice, u, v] = numbers.map(|[u]| u as usize);
                    in_pixel[x >> 29 << 3 | y >> 29] = true;
                    choices[choice >> 26] = true;
                    on_light[u >> 29 << 3 | v >> 29] = true;
                }
                // Of Sobol's dimensions only the first two are a net of the best quality.
                assert!(full(in_pixel) && full(choices), "{sampler:?}");
                assert!(sampler == PixelSampler::Sobol || full(on_light), "{sampler:?}");
            }
        }
    }

    /// Each dimension against the one before it. Together they fail once in 1,000 seeds.
    #[test]
    fn numbers_are_uniform_over_pixels() {
        for sampler in PixelSampler::ALL {
            let mut bins = [[0_u64; 64]; 4];
            for y in 0..64 {
                let numbers: [[u32; 64]; 5] = sampler.numbers(9, &row(y), 64, 11, 0);
                for (bins, pair) in bins.iter_mut().zip(numbers.windows(2)) {
                    let pairs = pair[0].iter().zip(&pair[1]);
                    pairs.for_each(|(u, v)| bins[(u >> 29 << 3 | v >> 29) as usize] += 1);
                }
            }
            for bins in bins {
                let (statistic, dof) = pooled_chi_square(&bins, &[64.0; 64], 5.0);
                assert!(chi_square_p(statistic, dof) > sidak(1e-3, 24), "{sampler:?}: {bins:?}");
            }
        }
    }
}

//! Counter-based random numbers: a number is a pure function of (seed, pixel, frame, dimension).

use crate::hash::{GOLDEN, hash2, hash3, mix};
use glam::Vec2;

/// Maps the top 24 bits to `[0, 1)`, exactly: every result is a multiple of 2^-24 and 1 is never reached.
#[inline]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Maps 32 bits to the middles of 2^32 equal parts of `(0, 1)`: unbiased, and neither end is reached.
#[inline]
pub fn unit_f64(bits: u32) -> f64 {
    (f64::from(bits) + 0.5) * (1.0 / 4_294_967_296.0)
}

/// The independent random numbers of one pixel in one frame.
///
/// Use them where strata do not help (Russian roulette at late vertices, jitter); [`crate::PixelSequence`] is the
/// stratified counterpart.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    /// Two words, so that streams do not overlap even when one of them collides.
    key: [u32; 2],
}

impl Random {
    /// The numbers of `pixel` in `frame`. Different arguments give streams that share nothing.
    #[inline]
    pub const fn new(seed: u64, pixel: u32, frame: u32) -> Self {
        let (low, high) = (seed as u32, (seed >> 32) as u32);
        let stream = hash3(high, low, pixel);
        Self {
            key: [hash2(stream, frame), hash2(frame, stream)],
        }
    }

    /// 32 random bits.
    #[inline]
    pub const fn u32(&self, dimension: u32) -> u32 {
        mix(mix(self.key[0].wrapping_add(GOLDEN.wrapping_mul(dimension))) ^ self.key[1])
    }

    /// A number in `[0, 1)` with 24 bits.
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

/// Independent random numbers one after the other, for whoever cannot tell beforehand how many it takes.
#[derive(Clone, Debug)]
pub struct Stream {
    random: Random,
    next: u32,
}

impl Stream {
    /// The numbers of `seed` and `purpose`. Different arguments give streams that share nothing.
    #[inline]
    pub const fn new(seed: u64, purpose: u32) -> Self {
        Self {
            random: Random::new(seed, purpose, 0),
            next: 0,
        }
    }

    /// The next number, in `(0, 1)`. Repeats after 2^32.
    #[inline]
    pub fn number(&mut self) -> f64 {
        let number = unit_f64(self.random.u32(self.next));
        self.next = self.next.wrapping_add(1);
        number
    }

    /// Fills `point` with the next numbers.
    #[inline]
    pub fn fill(&mut self, point: &mut [f64]) {
        point.iter_mut().for_each(|u| *u = self.number());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::{chi_square_p, pooled_chi_square};

    #[test]
    fn unit_numbers_stay_below_one() {
        assert_eq!(unit_f32(0), 0.0);
        assert_eq!(unit_f32(u32::MAX), 1.0 - f32::EPSILON / 2.0);
        assert_eq!(unit_f32(1 << 31), 0.5);
    }

    /// p-value of 16 x 16 bins against uniformity, of pairs made by `pair(i)`.
    fn pair_p(count: u32, pair: impl Fn(u32) -> (u32, u32)) -> f64 {
        let mut bins = vec![0_u64; 256];
        for i in 0..count {
            let (a, b) = pair(i);
            bins[(a >> 28 << 4 | b >> 28) as usize] += 1;
        }
        let expected = vec![f64::from(count) / 256.0; 256];
        let (statistic, dof) = pooled_chi_square(&bins, &expected, 5.0);
        chi_square_p(statistic, dof)
    }

    /// Each of the four p-values is below its limit once in 40,000 seeds.
    #[test]
    fn neighbours_in_every_key_are_independent() {
        let n = 1 << 16;
        let limit = 1e-4 / 4.0;
        assert!(pair_p(n, |i| (Random::new(1, i, 0).u32(0), Random::new(1, i + 1, 0).u32(0))) > limit);
        assert!(pair_p(n, |i| (Random::new(1, 5, i).u32(0), Random::new(1, 5, i + 1).u32(0))) > limit);
        assert!(pair_p(n, |i| (Random::new(1, i, 3).u32(0), Random::new(1, i, 3).u32(1))) > limit);
        assert!(pair_p(n, |i| (Random::new(1, i, 3).u32(0), Random::new(2, i, 3).u32(0))) > limit);
    }

    #[test]
    fn numbers_depend_on_their_counter_only() {
        let random = Random::new(9, 8, 7);
        let forward: Vec<u32> = (0..8).map(|d| random.u32(d)).collect();
        let backward: Vec<u32> = (0..8).rev().map(|d| Random::new(9, 8, 7).u32(d)).collect();
        assert!(forward.iter().eq(backward.iter().rev()));
        assert_eq!(random.vec2(2), Vec2::new(random.f32(2), random.f32(3)));
    }
}

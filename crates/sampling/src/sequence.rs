//! The numbers a path consumes: eight Owen-scrambled Sobol' dimensions per path vertex.
//!
//! Dimensions of a vertex: 0, 1 position in the pixel (first vertex only); 2 choice of the light; 3, 4 point on the
//! light; 5 BSDF lobe; 6, 7 BSDF direction. The first vertex uses the sample number as index, so all of its
//! dimensions are stratified jointly; later vertices visit the same points in an order of their own (padding: Burley
//! 2020, section 4), so that they are stratified in themselves and independent of each other.

use crate::hash::{GOLDEN, mix64};
use crate::random::unit_f32;
use crate::sobol::{reversed_owen_scramble, reversed_sobol};
use glam::Vec2;

/// The sample sequence of one pixel at one sample number.
#[derive(Clone, Copy, Debug)]
pub struct PixelSequence {
    key: u64,
    reversed_index: u32,
}

impl PixelSequence {
    /// Sample number `sample` of `pixel`. The samples 0, 1, 2, ... of a pixel are stratified in every power of two;
    /// pixels and seeds are independent of each other.
    #[inline]
    pub const fn new(seed: u64, pixel: u32, sample: u32) -> Self {
        // `seed` in the high bits' way of `pixel` would let (seed, pixel) pairs collide; the odd factor spreads it.
        let key = mix64(seed.wrapping_mul(GOLDEN) ^ pixel as u64);
        Self {
            key,
            reversed_index: sample.reverse_bits(),
        }
    }

    /// The numbers for path vertex `vertex`; 0 is the camera and the first hit.
    #[inline]
    pub const fn vertex(&self, vertex: u32) -> VertexSequence {
        if vertex == 0 {
            return VertexSequence {
                key: self.key,
                reversed_index: self.reversed_index,
            };
        }
        let key = mix64(self.key.wrapping_add(GOLDEN.wrapping_mul(vertex as u64)));
        // A nested uniform scramble of the index, whose order reversal puts at the top. Differs from Burley section 4:
        // only the low 16 index bits move. The flips of the others are, for all samples below 65,536, one constant,
        // which the scramble of the points absorbs; leaving them out keeps the index short and the table reads few.
        let shuffled = reversed_owen_scramble(self.reversed_index, key as u32);
        VertexSequence {
            key,
            reversed_index: shuffled & 0xffff_0000 | self.reversed_index & 0xffff,
        }
    }
}

/// The eight numbers of one path vertex.
#[derive(Clone, Copy, Debug)]
pub struct VertexSequence {
    key: u64,
    reversed_index: u32,
}

impl VertexSequence {
    /// 32 bits of `dimension` (0 to 7).
    #[inline]
    pub fn u32(&self, dimension: u32) -> u32 {
        // The key is mixed already; one multiplication separates the dimensions.
        let step = GOLDEN.wrapping_mul(2 * u64::from(dimension) + 1);
        let seed = ((self.key ^ step).wrapping_mul(0xd6e8_feb8_6659_fd93) >> 32) as u32;
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

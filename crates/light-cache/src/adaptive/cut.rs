//! An interval cut in proportion to weights, in whole numbers.

use super::row::{LANES, Lanes};

/// Entries whose running sums are worked out one after the other; groups of them are worked out side by side.
const GROUP: usize = 4;

/// An interval cut in proportion to weights: part `k` begins at the ceiling of (sum of the weights before it) x scale. Parts
/// are whole numbers that add up to the width exactly, and a weight of zero gets nothing.
pub(super) struct Cut {
    /// Sums up to and including each weight: never falling, for adding a positive number never makes less.
    sums: Lanes,
    scale: f64,
    width: u64,
}

impl Cut {
    /// `None` if nothing weighs anything. `width` is at most 2^52, so that `f64` holds every position.
    #[inline(always)]
    pub(super) fn new(weights: &Lanes, width: u64) -> Option<Self> {
        let mut sums = *weights;
        for i in 1..GROUP {
            for group in (0..LANES).step_by(GROUP) {
                sums[group + i] += sums[group + i - 1];
            }
        }
        let mut before = 0.0;
        for group in (0..LANES).step_by(GROUP) {
            for i in 0..GROUP {
                sums[group + i] += before;
            }
            before = sums[group + GROUP - 1];
        }
        (before > 0.0).then(|| Self {
            sums,
            scale: width as f64 / f64::from(before),
            width,
        })
    }

    /// Sum of the weights.
    #[inline(always)]
    pub(super) fn total(&self) -> f32 {
        self.sums[LANES - 1]
    }

    /// Where the part after weight `index` begins.
    #[inline(always)]
    fn end(&self, index: usize) -> u64 {
        if self.sums[index] >= self.total() {
            return self.width;
        }
        let boundary = f64::from(self.sums[index]) * self.scale;
        let below = boundary as u64;
        // The library's ceiling is a call where the target lacks the instruction.
        (below + u64::from((below as f64) < boundary)).min(self.width)
    }

    /// Start and width of a part.
    #[inline(always)]
    pub(super) fn part(&self, index: usize) -> (u64, u64) {
        let start = if index == 0 { 0 } else { self.end(index - 1) };
        (start, self.end(index) - start)
    }

    /// The part that holds `x`, which is less than the width.
    #[inline(always)]
    pub(super) fn index_at(&self, x: u64) -> usize {
        let (x, total) = (x as f64, self.total());
        // A whole number has passed a boundary if and only if it has passed the boundary's ceiling.
        let passed = |&sum: &f32| u32::from(sum < total) & u32::from(f64::from(sum) * self.scale <= x);
        self.sums.iter().map(passed).sum::<u32>() as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: u64 = (1 << 52) - 12_345;

    #[test]
    fn parts_are_as_drawn_and_fill_the_interval() {
        let random = |i: u32| sampling::Random::new(3, i, 0);
        for round in 0..2000 {
            // From 30 decades to nearly alike, zeros among them, at the ends too.
            let decades = random(round).f32(0) * 30.0;
            let weights: Lanes = std::array::from_fn(|lane| {
                let number = random(round).f32(1 + lane as u32);
                if number < 0.2 {
                    0.0
                } else {
                    10.0_f32.powf(decades * (number - 0.6))
                }
            });
            let Some(cut) = Cut::new(&weights, WIDTH) else {
                assert_eq!(weights, [0.0; LANES]);
                continue;
            };
            let total: f64 = weights.iter().copied().map(f64::from).sum();
            let mut next = 0;
            for (lane, &weight) in weights.iter().enumerate() {
                let (start, width) = cut.part(lane);
                assert_eq!(start, next);
                next = start + width;
                let expected = f64::from(weight) / total;
                assert!((width as f64 / WIDTH as f64 - expected).abs() < 1e-6);
                assert!(weight > 0.0 || width == 0);
                if width > 0 {
                    assert_eq!((cut.index_at(start), cut.index_at(next - 1)), (lane, lane));
                }
            }
            assert_eq!(next, WIDTH);
        }
    }
}

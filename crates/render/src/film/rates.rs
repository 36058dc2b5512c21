//! How many samples each pixel takes in a frame.

use super::{TILE_AREA, Tile};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Samples per frame: a power of two, so that at the end of a block, whose length is one too, every pixel has a whole net of its sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct Rate {
    log2: i8,
}

impl Rate {
    /// One sample in 8 frames. Lower values skip more; higher values guard better against pixels whose samples happened to agree.
    const LEAST: i8 = -3;
    /// Higher values follow large differences; lower values bound how long a tile takes.
    const MOST: i8 = 4;

    /// All of them, the lowest first.
    fn all() -> impl Iterator<Item = Self> {
        (Self::LEAST..=Self::MOST).map(|log2| Self { log2 })
    }

    /// The nearest to `samples` per frame by ratio; the lowest for 0.
    pub(super) fn nearest(samples: f64) -> Self {
        let log2 = samples.log2().round();
        Self {
            log2: log2.clamp(Self::LEAST.into(), Self::MOST.into()) as i8,
        }
    }

    /// Samples per frame.
    pub(super) fn per_frame(self) -> f64 {
        f64::from(self.log2).exp2()
    }

    /// Samples in the first `frames` of a block. The first frame has one of every pixel, so that no block is without.
    pub(super) fn in_first(self, frames: u32) -> u32 {
        if self.log2 >= 0 {
            frames << self.log2
        } else {
            frames.div_ceil(1 << -self.log2)
        }
    }

    /// In how many of the first `frames` of a block there is no sample.
    pub(super) fn skipped(self, frames: u32) -> u32 {
        frames.saturating_sub(self.in_first(frames))
    }

    /// Whether it can be one: what was read from a file may be anything.
    pub(super) fn is_sound(self) -> bool {
        (Self::LEAST..=Self::MOST).contains(&self.log2)
    }
}

/// The samples that a tile takes in a frame: groups of pixels that take those of the same numbers.
pub(crate) struct Work {
    /// The pixels, counted row by row, group by group.
    pixels: [u8; TILE_AREA],
    /// Where each group ends, and its samples.
    groups: [(usize, Range<u32>); (Rate::MOST - Rate::LEAST + 1) as usize],
}

impl Work {
    /// Pixels and numbers of samples, group by group; groups may be empty.
    #[inline(always)]
    pub(crate) fn groups(&self) -> impl Iterator<Item = (&[u8], Range<u32>)> {
        let mut start = 0;
        self.groups.iter().map(move |(end, samples)| {
            let pixels = &self.pixels[start..*end];
            start = *end;
            (pixels, samples.clone())
        })
    }
}

impl Tile {
    /// The work of the coming frame, which is number `frame` of its sequence of random numbers.
    pub(crate) fn work(&self, frame: u32) -> Work {
        let count = self.pixels.len();
        let mut work = Work {
            pixels: std::array::from_fn(|i| i as u8),
            groups: std::array::from_fn(|_| (count, 0..0)),
        };
        if self.rates.is_empty() {
            work.groups[0].1 = frame..frame.wrapping_add(1);
            return work;
        }
        // A sequence may have begun before the block, while all rates were 1, or in it.
        let both = frame.min(self.block_frame);
        let mut end = 0;
        for (rate, group) in Rate::all().zip(&mut work.groups) {
            let taken = rate.in_first(self.block_frame - both);
            let first = rate.in_first(self.block_frame) - taken + (frame - both);
            let next = first + rate.in_first(self.block_frame + 1) - rate.in_first(self.block_frame);
            if first < next {
                for (index, _) in self.rates.iter().enumerate().filter(|(_, of)| **of == rate) {
                    work.pixels[end] = index as u8;
                    end += 1;
                }
            }
            *group = (end, first..next);
        }
        work
    }

    /// Column and row in the image of pixel `index`, counted row by row.
    #[inline(always)]
    pub(crate) fn place(&self, index: u8) -> [u32; 2] {
        let index = u32::from(index);
        [self.x0 + index % self.width, self.y0 + index / self.width]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_of_a_block_is_taken_once_whenever_it_is_cut() {
        for rate in Rate::all() {
            assert!(rate.is_sound() && Rate::nearest(rate.per_frame() * 1.3) == rate);
            assert_eq!(rate.in_first(0), 0);
            assert!(rate.in_first(1) >= 1, "the first frame has samples of all");
            assert_eq!(f64::from(rate.in_first(64)), 64.0 * rate.per_frame());
            assert_eq!(rate.skipped(64), 64 - rate.in_first(64).min(64));
        }
        assert_eq!(Rate::nearest(0.0).log2, Rate::LEAST);
        assert_eq!(Rate::nearest(f64::INFINITY).log2, Rate::MOST);
        assert!(!Rate { log2: 9 }.is_sound());
    }

    #[test]
    fn a_tile_takes_the_samples_that_its_rates_ask_for() {
        let mut film = crate::Film::new(16, 16, false).with_rates();
        let tile = &mut film.tiles[0];
        let all: Vec<Rate> = Rate::all().collect();
        let rates = tile.rates.iter_mut().zip(all.iter().cycle());
        rates.for_each(|(rate, of)| *rate = *of);
        let mut taken = vec![Vec::new(); 256];
        for frame in 0..32 {
            tile.block_frame = frame;
            for (pixels, samples) in tile.work(frame).groups() {
                for &pixel in pixels {
                    taken[usize::from(pixel)].extend(samples.clone());
                }
            }
        }
        for (taken, rate) in taken.iter().zip(&tile.rates) {
            assert_eq!(*taken, (0..rate.in_first(32)).collect::<Vec<_>>(), "{rate:?}");
        }
    }
}

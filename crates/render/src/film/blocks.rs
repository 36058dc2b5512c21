//! Films whose pixels take samples where the error is.
//!
//! Frames come in blocks: [`FIRST_BLOCK`] frames, then as many as all before. In the first block every pixel takes one sample per frame. Before
//! each other block every pixel gets a rate, in proportion to how much its samples have varied so far: that makes the mean of the relative
//! squared errors least (J. Neyman, "On the two different aspects of the representative method", 1934). What dark pixels vary by counts more, as in
//! relMSE. The mean rate is 1, so a frame takes about as long as it would without rates.
//!
//! **Unbiased.** Each block has random numbers of its own, so whatever was decided before it, the mean of its samples has the right expectation. The
//! image is the mean of the blocks, and their weights are fixed beforehand: the number of frames, whatever the number of samples that a pixel has
//! taken in them. Blocks weighed by their samples would have a little less variance, and be biased: a pixel whose first samples happened
//! to agree takes few more, and so keeps them (D. Kirk and J. Arvo, "Unbiased sampling techniques for image synthesis", 1991; the same is known as
//! bias of optional stopping). Only when to stop is decided by the samples that count, in which every pixel has a share of one in as many as there are.

use super::rates::Rate;
use super::{Film, PixelRecord, Tile, luminance_of};
use crate::metric::EPSILON;
use rayon::prelude::*;
use sampling::statistics::{Moments, chi_square_quantile, student_t_quantile};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Frames before the first decision; a power of two. Higher values decide on more; lower values sooner.
const FIRST_BLOCK: u64 = 8;

/// Part of the samples that goes to all pixels alike, whatever was seen of them: where few samples happened to agree there may be more to see.
const EVEN_SHARE: f64 = 0.1;

/// Steps towards a mean rate of 1: each is right but for the rounding.
const STEPS: u32 = 6;

/// Probability with which intervals and bounds want to be right.
const CONFIDENCE: f64 = 0.95;

/// The blocks of a pixel that are done.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct EarlierRecord {
    /// Means of R, G, B, luminance squared, each times the weight of its block.
    pub(super) sums: [f64; 4],
    /// Samples in them.
    pub(super) count: u32,
    /// Sum over the blocks of weight^2 x (variance of the block's mean / variance of a sample).
    pub(super) spread: f64,
}

/// How far an image is from what it would be in the end, estimated from itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorEstimate {
    /// relMSE as [`crate::ImageError::relmse`] would be against a perfect reference.
    pub relmse: f64,
    /// Lower end of its 95 % confidence interval, by Student's t over the pixels (W. Purgathofer, "A statistical method for
    /// adaptive stochastic sampling", 1987).
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// How the samples of a film are spread over its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SampleCounts {
    /// Of the pixel that has fewest.
    pub least: u32,
    /// Half of the pixels have no more.
    pub median: u32,
    /// Of the pixel that has most.
    pub most: u32,
    /// Over all pixels.
    pub mean: f64,
    /// Share of all (pixel, frame) in which the pixel took no sample.
    pub skipped: f64,
}

/// The mean of a pixel's samples.
pub(super) struct Mean {
    /// R, G, B, luminance squared.
    pub(super) values: [f64; 4],
    /// Variance of the mean over that of a sample.
    pub(super) share: f64,
    /// Samples.
    pub(super) count: u32,
}

impl EarlierRecord {
    /// Adds a block.
    fn add(&mut self, weight: f64, block: &Mean) {
        for (sum, value) in self.sums.iter_mut().zip(block.values) {
            *sum += weight * value;
        }
        self.count += block.count;
        self.spread += weight * weight * block.share;
    }

    /// The mean of the blocks, whose weights add up to `weight`.
    fn mean(&self, weight: f64) -> Mean {
        Mean {
            values: self.sums.map(|sum| sum / weight),
            share: self.spread / (weight * weight),
            count: self.count,
        }
    }
}

impl Mean {
    /// Of no samples.
    const NONE: Self = Self {
        values: [0.0; 4],
        share: 0.0,
        count: 0,
    };

    /// The variance of a sample's luminance; 0 for fewer than two samples.
    pub(super) fn sample_variance(&self) -> f64 {
        let [r, g, b, y_sq] = self.values;
        let mean = luminance_of(r, g, b);
        if self.count < 2 {
            return 0.0;
        }
        // Rounding may take the difference of two nearly equal squares below zero.
        ((y_sq - mean * mean) / (1.0 - self.share)).max(0.0)
    }

    pub(super) fn luminance(&self) -> f64 {
        luminance_of(self.values[0], self.values[1], self.values[2])
    }

    /// The variance of the mean luminance; 0 for fewer than two samples.
    pub(super) fn variance(&self) -> f64 {
        (self.sample_variance() * self.share).max(0.0)
    }
}

impl Film {
    /// The same empty film, whose pixels will take samples where the error is.
    pub(crate) fn with_rates(mut self) -> Self {
        for tile in &mut self.tiles {
            tile.rates = vec![Rate::default(); tile.pixels.len()].into();
            tile.earlier = vec![EarlierRecord::default(); tile.pixels.len()].into();
        }
        self.has_rates = true;
        self
    }

    /// Whether its pixels take different numbers of samples.
    pub fn has_rates(&self) -> bool {
        self.has_rates
    }

    /// To be called before each frame. Begins a new block when the time has come: random numbers from now on must be independent of all before.
    pub(crate) fn begin_block(&mut self) -> bool {
        let due = self.frames >= FIRST_BLOCK && self.frames.is_power_of_two() && self.frames > self.block_start;
        if !self.has_rates || !due {
            return false;
        }
        let rates = self.decide();
        self.skipped += self.skipped_in_block();
        let weight = self.block_weights()[0];
        for index in 0..self.tiles.len() {
            let blocks: Vec<Mean> = (0..self.tiles[index].pixels.len())
                .map(|i| self.block_mean(&self.tiles[index], i))
                .collect();
            let tile = &mut self.tiles[index];
            for (i, block) in blocks.iter().enumerate() {
                tile.pixels[i] = PixelRecord::default();
                tile.earlier[i].add(weight, block);
                let [x, y] = tile.place(i as u8);
                tile.rates[i] = rates[(y * self.width + x) as usize];
            }
            tile.block_frame = 0;
        }
        self.block_start = self.frames;
        self.earlier_weights = self.weights;
        true
    }

    /// The rate of every pixel, row 0 first, from all samples so far.
    fn decide(&self) -> Vec<Rate> {
        let offset = self.offset();
        let relative = self.to_rows(0.0, |tile, i| {
            let mean = self.mean(tile, i);
            ratio(mean.sample_variance(), mean.luminance().powi(2) + offset)
        });
        // The variance of few samples is uncertain: those of the pixels around it, of the same surface for the most part, help.
        let mut wanted = around(&relative, self.width as usize);
        wanted.par_iter_mut().for_each(|variance| *variance = variance.sqrt());
        let mean = wanted.iter().sum::<f64>() / wanted.len() as f64;
        if mean <= 0.0 || !mean.is_finite() {
            return vec![Rate::default(); wanted.len()];
        }
        let of = |deviation: f64| EVEN_SHARE + (1.0 - EVEN_SHARE) * deviation / mean;
        // Rounding to powers of two, and the ends of their range, change the mean: a few steps make it nearly 1 again. Sums of powers
        // of two are exact, in whatever order.
        let mut scale = 1.0;
        for _ in 0..STEPS {
            let rates = wanted.par_iter().map(|&deviation| Rate::nearest(scale * of(deviation)));
            scale *= wanted.len() as f64 / rates.map(Rate::per_frame).sum::<f64>();
        }
        let rates = wanted.par_iter().map(|&deviation| Rate::nearest(scale * of(deviation)));
        rates.collect()
    }

    /// Frames of the current block.
    fn block_frames(&self) -> u32 {
        u32::try_from(self.frames - self.block_start).unwrap_or(u32::MAX)
    }

    /// Sum of the weights of the current block's frames, and of their squares.
    fn block_weights(&self) -> [f64; 2] {
        [0, 1].map(|i| self.weights[i] - self.earlier_weights[i])
    }

    /// The variance of the current block's mean over that of a sample, where every pixel has one sample per frame: 1 / n for n frames of
    /// the same weight.
    pub(crate) fn even_share(&self) -> f64 {
        let [sum, squares] = self.block_weights();
        squares / (sum * sum)
    }

    /// The regulariser of relative squared errors.
    fn offset(&self) -> f64 {
        let luminances = self.to_rows(0.0, |tile, i| self.mean(tile, i).luminance());
        let mean = luminances.iter().sum::<f64>() / luminances.len() as f64;
        EPSILON * mean * mean
    }

    /// The mean of a pixel's samples in the current block.
    fn block_mean(&self, tile: &Tile, i: usize) -> Mean {
        let pixel = &tile.pixels[i];
        if pixel.count == 0 {
            return Mean::NONE;
        }
        let even = self.even_share();
        let scale = 1.0 / pixel.weight;
        Mean {
            values: pixel.sums.map(|value| value * scale),
            share: match tile.rates.is_empty() {
                true => even,
                false => even * f64::from(self.block_frames()) / f64::from(pixel.count),
            },
            count: pixel.count,
        }
    }

    /// The mean of all of a pixel's samples.
    pub(super) fn mean(&self, tile: &Tile, i: usize) -> Mean {
        let block = self.block_mean(tile, i);
        match tile.earlier.get(i) {
            Some(earlier) if earlier.count > 0 => {
                let mut all = *earlier;
                let weight = if block.count > 0 { self.block_weights()[0] } else { 0.0 };
                all.add(weight, &block);
                all.mean(self.earlier_weights[0] + weight)
            }
            _ => block,
        }
    }

    /// How far the image is from what it would be in the end. `None` for films without rates, and before the second block.
    ///
    /// The current block and all before it are two independent images of the same: half of what they differ by, about, is what their mean is
    /// off. Thus it counts that samples are spread evenly, which variances of samples do not. Denominators are the image's own, so where rare bright samples rule
    /// it is rather too low: they divide their own error, and have not all been met.
    pub fn estimated_error(&self) -> Option<ErrorEstimate> {
        let (earlier, block) = (self.earlier_weights[0], self.block_weights()[0]);
        if earlier <= 0.0 || block <= 0.0 {
            return None;
        }
        let offset = self.offset();
        let rows = self.to_rows([0.0; 3], |tile, i| {
            let [before, now] = [tile.earlier[i].mean(earlier), self.block_mean(tile, i)];
            let mean = self.mean(tile, i);
            let difference = if now.count > 0 {
                now.luminance() - before.luminance()
            } else {
                0.0
            };
            let relative = |x: f64| ratio(x, mean.luminance().powi(2) + offset);
            let variance = mean.sample_variance();
            [difference * difference, variance * before.share, variance * now.share].map(relative)
        });
        // The image is (1 - w) before + w now, of variance (1 - w)^2 v + w^2 v', and the difference has v + v'. Which part of that is which is
        // told by the samples.
        let [before, now] = [1, 2].map(|k| rows.iter().map(|row| row[k]).sum::<f64>());
        let w = block / (earlier + block);
        let part = ratio((1.0 - w).powi(2) * before + w * w * now, before + now);
        let mut moments = Moments::default();
        rows.iter().for_each(|row| moments.push(part * row[0]));
        let relmse = moments.mean();
        // Of a single pixel nothing is known but that its squared difference is a chi-square variable of one degree of freedom.
        let standard_error = match rows.len() {
            1 => relmse * std::f64::consts::SQRT_2,
            _ => moments.standard_error(),
        };
        let half_width = student_t_quantile(0.5 + 0.5 * CONFIDENCE, (rows.len() - 1).max(1)) * standard_error;
        Some(ErrorEstimate {
            relmse,
            low: (relmse - half_width).max(0.0),
            high: relmse + half_width,
        })
    }

    /// Share of the pixels whose own relative squared error is below `bound` with 95 % confidence, by the chi-square bound on a variance: M. E.
    /// Lee, R. A. Redner and S. P. Uselton, "Statistically optimized sampling for distributed ray tracing" (1985).
    pub fn converged(&self, bound: f64) -> f64 {
        let offset = self.offset();
        let means = self.to_rows((0, 0.0), |tile, i| {
            let mean = self.mean(tile, i);
            (mean.count, ratio(mean.variance(), mean.luminance().powi(2) + offset))
        });
        let mut quantiles = HashMap::new();
        let converged = means.iter().filter(|(count, relative)| {
            let dof = count.saturating_sub(1) as usize;
            let quantile = quantiles
                .entry(dof)
                .or_insert_with(|| chi_square_quantile(1.0 - CONFIDENCE, dof));
            dof > 0 && relative * dof as f64 <= bound * *quantile
        });
        converged.count() as f64 / means.len() as f64
    }

    /// How the samples are spread over the pixels.
    pub fn sample_counts(&self) -> SampleCounts {
        let mut counts = self.samples();
        let sum: u64 = counts.iter().copied().map(u64::from).sum();
        let frames = self.frames.max(1) as f64 * counts.len() as f64;
        let middle = (counts.len() - 1) / 2;
        let (_, median, _) = counts.select_nth_unstable(middle);
        let median = *median;
        SampleCounts {
            least: counts.iter().copied().min().unwrap_or_default(),
            median,
            most: counts.iter().copied().max().unwrap_or_default(),
            mean: sum as f64 / counts.len() as f64,
            skipped: (self.skipped + self.skipped_in_block()) as f64 / frames,
        }
    }

    /// Samples of every pixel, row 0 first.
    pub fn samples(&self) -> Vec<u32> {
        self.to_rows(0, |tile, i| {
            tile.pixels[i].count + tile.earlier.get(i).map_or(0, |earlier| earlier.count)
        })
    }

    /// (Pixel, frame) of the current block without a sample.
    fn skipped_in_block(&self) -> u64 {
        let frames = self.block_frames();
        let rates = self.tiles.iter().flat_map(|tile| &tile.rates);
        rates.map(|rate| u64::from(rate.skipped(frames))).sum()
    }
}

/// `a / b`; 0 where both are zero.
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// The mean of each value and those beside, above and below it, in rows of `width`.
fn around(values: &[f64], width: usize) -> Vec<f64> {
    let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
    let height = values.len() / width;
    let mean = |i: usize| {
        let (columns, rows) = (near(i % width, width), near(i / width, height));
        let count = columns.len() * rows.len();
        let sums = rows.map(|row| values[row * width..][columns.clone()].iter().sum::<f64>());
        sums.sum::<f64>() / count as f64
    };
    (0..values.len()).into_par_iter().map(mean).collect()
}

#[cfg(test)]
mod tests;

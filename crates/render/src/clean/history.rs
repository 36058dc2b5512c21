//! What earlier pictures knew about the light on the surfaces of this one.
//!
//! Temporal accumulation of SVGF (Schied et al. 2017, section 4.1): each pixel's surface is looked up where the camera
//! before saw it, and its light is averaged with what was known there, unless another surface was seen at that place. Differs:
//! averages are weighed by the number of samples, so that a picture that is refined takes over; the jitter of the samples within
//! their pixels does not move the history; nothing moves but the camera, so that surfaces are told apart by their planes,
//! not by numbers of objects; and history that contradicts the new samples is shortened, block by block, in the spirit of
//! A-SVGF (Schied et al. 2018), by a test of means in place of samples that are shaded twice.

use super::frame::{Frame, Guide, luminance_of};
use super::projection::Projection;
use super::row::{Past, Row, kept};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;
use scene::Camera;

/// Least cosine between normals of one surface.
const ALIKE_NORMALS: f32 = 0.9;
/// Greatest distance between planes of one surface, in edges of a pixel.
const ALIKE_PLANES: f32 = 1.0;
/// Side of the blocks in which history is tested against the new samples, in pixels.
const BLOCK: usize = 8;
/// A block with fewer pixels that have a history is not tested.
const LEAST_TESTED: f32 = 16.0;
/// Standard errors by which the means of a block may differ. Higher values trust history for longer; lower values take
/// noise for change.
const CONTRADICTION: f32 = 4.0;
/// From so many samples on their variance is known: from two, less what rounding takes when they are looked up.
const TWO_SAMPLES: f32 = 1.999;

/// What was known in earlier pictures.
#[derive(Debug, Default)]
pub(super) struct History(Row<Known>);

/// What is known about the light on a pixel's surface.
#[derive(Clone, Copy, Debug)]
struct Known {
    guide: Guide,
    /// As in [`Frame::light`], without the variance.
    irradiance: Vec3,
    /// Mean of the luminance's square over the samples.
    luminance_sq: f32,
    /// Samples that it rests on; 0: nothing is known.
    samples: f32,
    /// Sum of the squares of the samples' shares: the variance of the mean over that of a sample.
    spread: f32,
}

impl History {
    /// Averages `frame`'s light with what was known, and estimates its variance where there are enough samples for that.
    pub(super) fn accumulate(&mut self, frame: &mut Frame, camera: &Camera) {
        let projection = Projection::new(camera, frame.width as f32 / frame.height as f32);
        let known: Vec<Known> = match self.0.begin(frame, &projection) {
            Some(past) => past.looked_up(frame, &projection),
            None => frame.guides.iter().map(|&guide| Known::nothing(guide)).collect(),
        };
        let trust = trust(frame, &known);
        let spp = frame.spp as f32;
        let blocks_per_row = (frame.width as usize).div_ceil(BLOCK);
        let width = frame.width as usize;
        let pixels = known
            .into_par_iter()
            .zip(&mut frame.light)
            .enumerate()
            .map(|(i, (known, light))| {
                let trust = trust[i / width / BLOCK * blocks_per_row + i % width / BLOCK];
                let now = known.with(*light, spp, kept(known.samples, spp) * trust);
                *light = now.irradiance.extend(now.variance());
                now
            });
        let pixels = pixels.collect();
        self.0.keep(frame, projection, pixels);
    }
}

impl Known {
    /// About this surface.
    fn nothing(guide: Guide) -> Self {
        Self {
            guide,
            irradiance: Vec3::ZERO,
            luminance_sq: 0.0,
            samples: 0.0,
            spread: 0.0,
        }
    }

    /// With the light of `spp` samples more, where what was known counts as `kept` samples.
    fn with(self, light: Vec4, spp: f32, kept: f32) -> Self {
        if !self.guide.is_surface() {
            return self;
        }
        let share = spp / (spp + kept);
        let y = luminance_of(light);
        let y_sq = y * y + light.w * spp;
        let old = 1.0 - share;
        Self {
            guide: self.guide,
            irradiance: self.irradiance * old + light.truncate() * share,
            luminance_sq: self.luminance_sq * old + y_sq * share,
            samples: spp + kept,
            spread: self.spread * old * old + share * share / spp,
        }
    }

    /// Of the mean's luminance; 0 after one sample.
    fn variance(&self) -> f32 {
        if self.samples < TWO_SAMPLES {
            return 0.0;
        }
        let y = luminance_of(self.irradiance.extend(0.0));
        // The mean comes from the same samples: their spread around it is too small by its own variance.
        let unbiased = (1.0 - self.spread).max(0.5);
        (self.luminance_sq - y * y).max(0.0) * self.spread / unbiased
    }
}

impl Past<Known> {
    /// What was known about each surface of `frame`.
    fn looked_up(&self, frame: &Frame, projection: &Projection) -> Vec<Known> {
        let size = Vec2::new(frame.width as f32, frame.height as f32);
        let here = Vec2::new(self.width as f32, self.height as f32);
        // Samples of coarser pixels are shared by several of the finer ones.
        let finer = (here.x * here.y / (size.x * size.y)).min(1.0);
        let pixel = |i: usize| {
            let guide = frame.guides[i];
            let nothing = Known::nothing(guide);
            if !guide.is_surface() {
                return nothing;
            }
            let (column, row) = (i as u32 % frame.width, i as u32 / frame.width);
            let center = (Vec2::new(column as f32, row as f32) + 0.5) / size;
            let now = projection.share(guide.position);
            let before = self.projection.share(guide.position);
            let (Some(now), Some(before)) = (now, before) else {
                return nothing;
            };
            // The pixel's centre, and not the sample within it: else every picture would shift its history by the jitter.
            let at = (before + center - now) * here;
            match self.bilinear(at, &guide).or_else(|| self.near(at, &guide)) {
                Some(known) => Known {
                    samples: known.samples * finer,
                    ..known
                },
                None => nothing,
            }
        };
        (0..frame.guides.len()).into_par_iter().map(pixel).collect()
    }

    /// What is known about the surface `guide` at `at`, in pixels, between the four pixels around it.
    fn bilinear(&self, at: Vec2, guide: &Guide) -> Option<Known> {
        /// Weight of pixels that show the surface, of 1; below it they lie too far aside.
        const LEAST: f32 = 0.05;
        let corner = (at - 0.5).floor();
        let f = at - 0.5 - corner;
        let taps = [
            (0, 0, (1.0 - f.x) * (1.0 - f.y)),
            (1, 0, f.x * (1.0 - f.y)),
            (0, 1, (1.0 - f.x) * f.y),
            (1, 1, f.x * f.y),
        ];
        self.mean(corner, &taps, guide, LEAST)
    }

    /// What is known about it in the three by three pixels around `at`: at the edges of things, where samples fall on either side.
    fn near(&self, at: Vec2, guide: &Guide) -> Option<Known> {
        let taps: [(i32, i32, f32); 9] = std::array::from_fn(|i| (i as i32 % 3 - 1, i as i32 / 3 - 1, 1.0));
        self.mean(at.floor(), &taps, guide, 0.5)
    }

    /// The mean of the pixels at offsets from `corner` that show the surface; `None` if their weights sum to less than `least`.
    #[inline]
    fn mean(&self, corner: Vec2, taps: &[(i32, i32, f32)], guide: &Guide, least: f32) -> Option<Known> {
        let (width, height) = (self.width as i32, self.height as i32);
        // A cast to integer saturates: what lies far aside stays outside.
        let (x, y) = (corner.x as i32, corner.y as i32);
        let mut mean = Known::nothing(*guide);
        let mut weights = 0.0;
        for &(dx, dy, weight) in taps {
            let (u, v) = (x.saturating_add(dx), y.saturating_add(dy));
            if u < 0 || v < 0 || u >= width || v >= height {
                continue;
            }
            let tap = &self.pixels[(v * width + u) as usize];
            if tap.samples > 0.0 && is_same(guide, &tap.guide) {
                weights += weight;
                mean.irradiance += tap.irradiance * weight;
                mean.luminance_sq += tap.luminance_sq * weight;
                mean.samples += tap.samples * weight;
                mean.spread += tap.spread * weight;
            }
        }
        if weights < least {
            return None;
        }
        let scale = 1.0 / weights;
        mean.irradiance *= scale;
        mean.luminance_sq *= scale;
        mean.samples *= scale;
        mean.spread *= scale;
        Some(mean)
    }
}

/// Whether two pixels show one surface.
#[inline]
fn is_same(a: &Guide, b: &Guide) -> bool {
    let coarser = if a.footprint > b.footprint { a } else { b };
    let other = if a.footprint > b.footprint { b } else { a };
    a.normal.dot(b.normal) >= ALIKE_NORMALS && coarser.off_plane(other.position) <= ALIKE_PLANES
}

/// How far history is to be trusted, 0..1, block by block.
///
/// In each block the mean of the new samples is tested against that of the history. The history's own noise is part of the
/// differences between them, from which the standard error is estimated.
fn trust(frame: &Frame, known: &[Known]) -> Vec<f32> {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let block = |block: usize| {
        let (x0, y0) = (block % columns * BLOCK, block / columns * BLOCK);
        let (mut count, mut sum, mut sum_sq) = (0.0_f32, 0.0_f32, 0.0_f32);
        for y in y0..(y0 + BLOCK).min(height) {
            for x in x0..(x0 + BLOCK).min(width) {
                let i = y * width + x;
                if known[i].samples > 0.0 {
                    let difference = luminance_of(frame.light[i]) - luminance_of(known[i].irradiance.extend(0.0));
                    count += 1.0;
                    sum += difference;
                    sum_sq += difference * difference;
                }
            }
        }
        if count < LEAST_TESTED {
            return 1.0;
        }
        let mean = sum / count;
        let error_sq = (sum_sq / count - mean * mean).max(0.0) / count;
        // Never above 1, and 1 where both are the same.
        (CONTRADICTION * CONTRADICTION * error_sq / (mean * mean).max(1e-20)).min(1.0)
    };
    (0..columns * rows).into_par_iter().map(block).collect()
}

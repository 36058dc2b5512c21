//! Progressive accumulation: sums per pixel in double precision, kept tile by tile.
//!
//! Sums of `f32` samples in `f64` hold every finite radiance and its square without overflow, and lose less than 4e-9 of
//! their value in 2^25 frames: a compensated pair of `f32` takes as much memory, more time, and ends at 1e38.
//!
//! A tile owns its pixels, so tiles are rendered in parallel without sharing, and a sample touches one cache line or two.

mod blocks;
mod rates;
mod sound;
mod tile;

use crate::RenderError;
use crate::metric::EPSILON;
use blocks::EarlierRecord;
pub use blocks::{ErrorEstimate, SampleCounts};
use glam::Vec3;
use rayon::prelude::*;
use scene::luminance;
use serde::{Deserialize, Serialize};
use tile::PixelRecord;
pub(crate) use tile::{AovRecord, AovSample, Tile};

/// Side of a tile in pixels. Higher values make neighbours share more of the caches; lower values balance the work of
/// many threads better.
pub const TILE_SIZE: u32 = 16;

/// Most pixels of a tile, one for each value of a byte.
const TILE_AREA: usize = (TILE_SIZE * TILE_SIZE) as usize;

/// A finished image: linear RGB, Rec. 709 primaries, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

/// Auxiliary images. Albedo, normal and emission are means over all samples (zero where nothing was hit); position and depth are
/// means over the samples that hit something; the chosen light is that of the last sample, unfiltered.
#[derive(Clone, Debug)]
pub struct Aovs {
    /// Diffuse albedo plus specular reflectance at normal incidence.
    pub albedo: Image,
    /// Shading normal, world space, on the viewer's side.
    pub normal: Image,
    /// World position, metres; zero where nothing was hit.
    pub position: Image,
    /// Radiance that the first surface emits itself.
    pub emitted: Image,
    /// Distance from the camera, metres; infinite where nothing was hit.
    pub depth: Vec<f32>,
    /// Index of the light chosen at the first hit by the last sample; -1 for none.
    pub light: Vec<f32>,
}

/// [`luminance`] in double precision, in which it cannot overflow.
#[inline]
fn luminance_of(r: f64, g: f64, b: f64) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Sums of samples per pixel, stored tile by tile so that tiles can be rendered in parallel.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Film {
    width: u32,
    height: u32,
    frames: u64,
    /// Sum of the frames' weights, and of their squares.
    weights: [f64; 2],
    /// The same of the blocks before the current one, see `blocks`.
    earlier_weights: [f64; 2],
    /// Frames in those.
    block_start: u64,
    /// (Pixel, frame) in those without a sample.
    skipped: u64,
    has_aovs: bool,
    has_rates: bool,
    tiles: Vec<Tile>,
}

/// Left column and top row of each tile of a film.
fn corners(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    let starts = |end: u32| (0..end).step_by(TILE_SIZE as usize);
    starts(height).flat_map(move |y0| starts(width).map(move |x0| (x0, y0)))
}

/// Columns and rows of the tile that begins at (`x0`, `y0`).
fn tile_size(width: u32, height: u32, x0: u32, y0: u32) -> (u32, u32) {
    (TILE_SIZE.min(width - x0), TILE_SIZE.min(height - y0))
}

impl Film {
    /// An empty film; with `aovs`, auxiliary images are kept too.
    pub fn new(width: u32, height: u32, aovs: bool) -> Self {
        let tiles = corners(width, height)
            .map(|(x0, y0)| {
                let (w, h) = tile_size(width, height, x0, y0);
                let len = (w * h) as usize;
                Tile {
                    x0,
                    y0,
                    width: w,
                    height: h,
                    weight: 1.0,
                    block_frame: 0,
                    pixels: vec![PixelRecord::default(); len].into(),
                    earlier: Box::default(),
                    rates: Box::default(),
                    aovs: vec![AovRecord::EMPTY; if aovs { len } else { 0 }].into(),
                }
            })
            .collect();
        Self {
            width,
            height,
            frames: 0,
            weights: [0.0; 2],
            earlier_weights: [0.0; 2],
            block_start: 0,
            skipped: 0,
            has_aovs: aovs,
            has_rates: false,
            tiles,
        }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let of_tile = |tile: &Tile| {
            size_of_val(&*tile.pixels)
                + size_of_val(&*tile.earlier)
                + size_of_val(&*tile.rates)
                + size_of_val(&*tile.aovs)
        };
        size_of_val(&*self.tiles) + self.tiles.iter().map(of_tile).sum::<usize>()
    }

    /// The tiles, top row first, to be rendered in parallel.
    pub(crate) fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Pixels of each tile.
    pub(crate) fn tile_areas(&self) -> impl Iterator<Item = usize> {
        self.tiles.iter().map(|tile| tile.pixels.len())
    }

    /// Number of tiles.
    pub(crate) fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// From now on samples are added with this weight, above 0. Weights must not depend on the samples that
    /// they weigh, or the mean is biased.
    pub(crate) fn set_weight(&mut self, weight: f32) {
        self.tiles.iter_mut().for_each(|tile| tile.weight = weight);
    }

    /// Counts one more frame.
    pub(crate) fn advance(&mut self) {
        let weight = f64::from(self.tiles[0].weight);
        self.weights = [self.weights[0] + weight, self.weights[1] + weight * weight];
        self.frames += 1;
        self.tiles
            .iter_mut()
            .for_each(|tile| tile.block_frame = tile.block_frame.wrapping_add(1));
    }

    /// Adds a frame of `weight` (finite, above 0), whose samples are `radiance(x, y)`. Returns how many were not finite and were left out.
    pub fn add_frame(&mut self, weight: f32, radiance: impl Fn(u32, u32) -> Vec3) -> u64 {
        self.set_weight(weight);
        let mut left_out = 0;
        for tile in self.tiles_mut() {
            for i in 0..tile.width * tile.height {
                let (x, y) = (tile.x0 + i % tile.width, tile.y0 + i / tile.width);
                left_out += u64::from(!tile.add(i as usize, radiance(x, y)));
            }
        }
        self.advance();
        left_out
    }

    /// Whether the film has the size of `other`, and the same layers.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let shape = |film: &Self| (film.width, film.height, film.has_aovs, film.has_rates);
        shape(self) == shape(other)
    }

    /// Adds all samples of `other`: the mean image becomes that of both, each weighed as its frames are.
    ///
    /// # Errors
    /// [`RenderError::State`] if the films differ in size or layers, or their pixels take samples where the error is.
    pub fn merge(&mut self, other: &Self) -> Result<(), RenderError> {
        if !self.is_like(other) {
            return Err(RenderError::State {
                what: "films of different sizes or layers cannot be joined".into(),
            });
        }
        if self.has_rates {
            return Err(RenderError::State {
                what: "films whose pixels take different numbers of samples cannot be joined".into(),
            });
        }
        self.frames = self.frames.saturating_add(other.frames);
        for (weight, others) in self.weights.iter_mut().zip(other.weights) {
            *weight += others;
        }
        for (tile, others) in self.tiles.iter_mut().zip(&other.tiles) {
            for (pixel, other) in tile.pixels.iter_mut().zip(&others.pixels) {
                pixel.count = pixel.count.saturating_add(other.count);
                pixel.weight += other.weight;
                pixel
                    .sums
                    .iter_mut()
                    .zip(other.sums)
                    .for_each(|(sum, other)| *sum += other);
            }
            for (pixel, other) in tile.aovs.iter_mut().zip(&others.aovs) {
                pixel.count = pixel.count.saturating_add(other.count);
                pixel.hits = pixel.hits.saturating_add(other.hits);
                pixel.light = other.light;
                pixel
                    .sums
                    .iter_mut()
                    .zip(other.sums)
                    .for_each(|(sum, other)| *sum += other);
            }
        }
        Ok(())
    }

    /// Takes the sums that somebody else has accumulated, by pixel, row 0 first: R, G, B, luminance squared, each times the weight of its
    /// frame; number of samples; sum of their weights.
    pub(crate) fn load(&mut self, of: impl Fn(usize) -> ([f64; 4], u32, f64)) {
        let width = self.width;
        for tile in &mut self.tiles {
            let places = tile.places(width);
            for (pixel, place) in tile.pixels.iter_mut().zip(places) {
                let (sums, count, weight) = of(place);
                *pixel = PixelRecord { sums, count, weight };
            }
        }
    }

    /// Likewise the auxiliary sums, if they are kept.
    pub(crate) fn load_aovs(&mut self, of: impl Fn(usize) -> AovRecord) {
        let width = self.width;
        for tile in &mut self.tiles {
            let places = tile.places(width);
            for (pixel, place) in tile.aovs.iter_mut().zip(places) {
                *pixel = of(place);
            }
        }
    }

    /// Whether auxiliary images are kept.
    pub(crate) fn has_aovs(&self) -> bool {
        self.has_aovs
    }

    /// The mean image so far; black before the first frame.
    pub fn image(&self) -> Image {
        self.to_image(|tile, i| {
            let [r, g, b, _] = self.mean(tile, i).values;
            [r, g, b].map(|value| value as f32)
        })
    }

    /// Per pixel the variance of the mean's luminance, row 0 first; 0 before the second frame. Never negative. Where frames
    /// have weights: that of samples that vary alike, (sum of the squared weights) / (sum of the weights)^2 x their variance; a
    /// little more than the truth if it is those of little weight that vary more. At most the largest `f32`.
    pub fn variance(&self) -> Vec<f32> {
        let variances = self.variances().into_iter();
        variances.map(|v| v.min(f64::from(f32::MAX)) as f32).collect()
    }

    fn variances(&self) -> Vec<f64> {
        self.to_rows(0.0, |tile, i| self.mean(tile, i).variance())
    }

    /// The relMSE that the image is estimated to have, from the variances of its own pixels: the mean of variance / (Y^2 + 0.01 mean(Y)^2), Y being
    /// luminance. Infinite before the second frame. Samples that are spread evenly do better than their variance says, so it is rather too
    /// high.
    pub fn estimated_relmse(&self) -> f64 {
        if self.frames < 2 {
            return f64::INFINITY;
        }
        let image = self.image();
        let luminance = |pixel: &[f32; 3]| f64::from(luminance(Vec3::from(*pixel)));
        let count = image.pixels.len() as f64;
        let mean = image.pixels.iter().map(luminance).sum::<f64>() / count;
        let offset = EPSILON * mean * mean;
        if offset <= 0.0 {
            // Black all over: nothing has varied.
            return 0.0;
        }
        let variances = self.variances();
        let pixels = image.pixels.iter().zip(&variances);
        pixels
            .map(|(pixel, variance)| variance / (luminance(pixel).powi(2) + offset))
            .sum::<f64>()
            / count
    }

    /// Frames so far: samples per pixel, or, where pixels take different numbers of them, about their mean.
    pub fn spp(&self) -> u64 {
        self.frames
    }

    /// The auxiliary images, if they were asked for.
    pub fn aovs(&self) -> Option<Aovs> {
        if !self.has_aovs {
            return None;
        }
        let mean = |first: usize, per_hit: bool| {
            self.to_image(|tile, i| {
                let pixel = &tile.aovs[i];
                let count = if per_hit { pixel.hits } else { pixel.count };
                let scale = 1.0 / f64::from(count.max(1));
                [0, 1, 2].map(|c| (pixel.sums[first + c] * scale) as f32)
            })
        };
        Some(Aovs {
            albedo: mean(0, false),
            normal: mean(3, false),
            position: mean(6, true),
            emitted: mean(9, false),
            depth: self.to_rows(0.0, |tile, i| {
                let pixel = &tile.aovs[i];
                match pixel.hits {
                    0 => f32::INFINITY,
                    hits => (pixel.sums[12] / f64::from(hits)) as f32,
                }
            }),
            light: self.to_rows(0.0, |tile, i| tile.aovs[i].light as f32),
        })
    }

    fn to_image(&self, value: impl Fn(&Tile, usize) -> [f32; 3] + Sync) -> Image {
        Image {
            width: self.width,
            height: self.height,
            pixels: self.to_rows([0.0; 3], value),
        }
    }

    /// One value per pixel, from tile order to rows.
    fn to_rows<T: Copy + Send + Sync>(&self, fill: T, value: impl Fn(&Tile, usize) -> T + Sync) -> Vec<T> {
        let width = self.width as usize;
        let mut rows = vec![fill; width * self.height as usize];
        let tiles_per_row = self.width.div_ceil(TILE_SIZE) as usize;
        rows.par_chunks_mut(width * TILE_SIZE as usize)
            .zip(self.tiles.par_chunks(tiles_per_row))
            .for_each(|(rows, tiles)| {
                for tile in tiles {
                    for i in 0..tile.pixels.len() {
                        let (x, y) = (i % tile.width as usize, i / tile.width as usize);
                        rows[y * width + tile.x0 as usize + x] = value(tile, i);
                    }
                }
            });
        rows
    }
}

#[cfg(test)]
mod tests;

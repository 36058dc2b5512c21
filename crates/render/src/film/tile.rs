//! Tiles: what their pixels have summed up, and what one sample adds to it.

use super::blocks::EarlierRecord;
use super::luminance_of;
use super::rates::Rate;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// What one sample adds to the auxiliary images.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AovSample {
    pub(crate) albedo: Vec3,
    pub(crate) normal_ws: Vec3,
    pub(crate) position_ws: Vec3,
    pub(crate) emitted: Vec3,
    /// Metres; infinite if nothing was hit.
    pub(crate) depth: f32,
    /// -1 for none.
    pub(crate) light: i64,
}

impl AovSample {
    /// A sample that hits nothing.
    pub(crate) const NONE: Self = Self {
        albedo: Vec3::ZERO,
        normal_ws: Vec3::ZERO,
        position_ws: Vec3::ZERO,
        emitted: Vec3::ZERO,
        depth: f32::INFINITY,
        light: -1,
    };
}

/// Sums of one pixel, in the current block.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct PixelRecord {
    /// R, G, B, luminance squared, each times the weight of its frame.
    pub(super) sums: [f64; 4],
    /// Samples in the sums; those that were not finite are not among them.
    pub(super) count: u32,
    /// Sum of their weights.
    pub(super) weight: f64,
}

/// Auxiliary sums of one pixel: albedo, normal, position, emission, depth.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct AovRecord {
    pub(crate) sums: [f64; 13],
    /// Samples.
    pub(crate) count: u32,
    /// Those that hit something.
    pub(crate) hits: u32,
    /// Chosen by the last one; -1 for none.
    pub(crate) light: i64,
}

impl AovRecord {
    /// Nothing yet.
    pub(super) const EMPTY: Self = Self {
        sums: [0.0; 13],
        count: 0,
        hits: 0,
        light: -1,
    };
}

/// A rectangle of the film.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Tile {
    /// Left column.
    pub(crate) x0: u32,
    /// Top row.
    pub(crate) y0: u32,
    /// Columns, at most [`super::TILE_SIZE`].
    pub(crate) width: u32,
    /// Rows, at most [`super::TILE_SIZE`].
    pub(crate) height: u32,
    /// Weight of the samples that are being added.
    pub(super) weight: f32,
    /// Frames of the current block that are done.
    pub(super) block_frame: u32,
    pub(super) pixels: Box<[PixelRecord]>,
    /// Empty unless pixels take different numbers of samples.
    pub(super) earlier: Box<[EarlierRecord]>,
    /// Likewise.
    pub(super) rates: Box<[Rate]>,
    /// Empty unless auxiliary images are kept.
    pub(super) aovs: Box<[AovRecord]>,
}

impl Tile {
    /// Where its pixels lie in a film of `film_width` columns, counted row by row.
    pub(super) fn places(&self, film_width: u32) -> impl Iterator<Item = usize> + use<> {
        let (x0, y0, width) = (self.x0, self.y0, self.width);
        let rows = y0..y0 + self.height;
        rows.flat_map(move |y| (x0..x0 + width).map(move |x| (y * film_width + x) as usize))
    }

    /// Adds a sample to the tile's pixel `index`, counted row by row. Samples that are not finite are left out;
    /// returns whether it was finite.
    #[inline]
    pub(crate) fn add(&mut self, index: usize, radiance: Vec3) -> bool {
        if !radiance.is_finite() {
            return false;
        }
        let [r, g, b] = radiance.to_array().map(f64::from);
        let y = luminance_of(r, g, b);
        let weight = f64::from(self.weight);
        let pixel = &mut self.pixels[index];
        for (sum, value) in pixel.sums.iter_mut().zip([r, g, b, y * y]) {
            *sum += value * weight;
        }
        pixel.count += 1;
        pixel.weight += weight;
        true
    }

    /// Adds the auxiliary values of a sample to the tile's pixel `index`.
    pub(crate) fn add_aovs(&mut self, index: usize, sample: &AovSample) {
        let pixel = &mut self.aovs[index];
        pixel.count += 1;
        pixel.light = sample.light;
        if sample.depth.is_finite() {
            pixel.hits += 1;
            let values = [sample.albedo, sample.normal_ws, sample.position_ws, sample.emitted];
            for (sum, value) in pixel.sums.iter_mut().zip(values.iter().flat_map(|v| v.to_array())) {
                *sum += f64::from(value);
            }
            pixel.sums[12] += f64::from(sample.depth);
        }
    }
}

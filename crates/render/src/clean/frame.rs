//! A picture taken apart: what falls on the surfaces, and what is known of the surfaces.

use super::projection::Projection;
use crate::Film;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use scene::{Camera, luminance};

/// What reflects less than this is shown as it is: lamps, and nothing at all.
const BLACK: f32 = 0.02;

/// The surface that a pixel shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guide {
    /// World space.
    pub(super) normal: Vec3,
    /// World space, metres; of lamps too.
    pub(super) position: Vec3,
    /// Edge of the pixel there, metres, seen head-on; 0 where there is no surface that reflects.
    pub(super) footprint: f32,
}

impl Guide {
    /// Whether there is a surface that reflects.
    #[inline]
    pub(super) fn is_surface(&self) -> bool {
        self.footprint > 0.0
    }

    /// How far `other` lies off this surface, in edges of a pixel.
    #[inline]
    pub(super) fn off_plane(&self, other: Vec3) -> f32 {
        self.normal.dot(other - self.position).abs() / self.footprint
    }
}

/// A picture, row 0 at the top.
#[derive(Debug)]
pub(super) struct Frame {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Samples per pixel.
    pub(super) spp: u64,
    pub(super) guides: Vec<Guide>,
    /// Metres from the camera; infinite where there is nothing.
    pub(super) depth: Vec<f32>,
    /// What falls on each surface: radiance less its emission, over its albedo; w is the variance of its luminance, 0 where
    /// that is not known yet.
    pub(super) light: Vec<Vec4>,
    /// As it came from the film.
    raw: Vec<Vec3>,
    albedo: Vec<Vec3>,
    emitted: Vec<Vec3>,
}

impl Frame {
    /// Takes the film's picture apart; `None` where it has no auxiliary images.
    pub(super) fn new(film: &Film, camera: &Camera) -> Option<Self> {
        let aovs = film.aovs()?;
        let (width, height) = (film.width(), film.height());
        let pixel_size = Projection::new(camera, width as f32 / height as f32).pixel_size(height);
        let vectors = |image: crate::Image| -> Vec<Vec3> { image.pixels.into_iter().map(Vec3::from).collect() };
        let raw = vectors(film.image());
        let emitted = vectors(aovs.emitted);
        let albedo: Vec<Vec3> = vectors(aovs.albedo);
        let depth = &aovs.depth;
        let guides = (0..raw.len()).into_par_iter().map(|i| {
            let depth = depth[i];
            let reflects = depth.is_finite() && luminance(albedo[i]) >= BLACK;
            Guide {
                normal: Vec3::from(aovs.normal.pixels[i]).normalize_or_zero(),
                position: aovs.position.pixels[i].into(),
                footprint: if reflects { depth * pixel_size } else { 0.0 },
            }
        });
        let guides = guides.collect();
        let variance = film.variance();
        let light = (0..raw.len()).into_par_iter().map(|i| {
            let scale = luminance(albedo[i]).max(BLACK);
            let irradiance = (raw[i] - emitted[i]).max(Vec3::ZERO) / reflected(albedo[i]);
            irradiance.extend(variance[i] / (scale * scale))
        });
        Some(Self {
            width,
            height,
            spp: film.spp(),
            guides,
            depth: aovs.depth,
            light: light.collect(),
            raw,
            albedo,
            emitted,
        })
    }

    /// The picture put together again.
    pub(super) fn assembled(&self) -> Vec<Vec3> {
        let pixel = |i: usize| {
            if self.guides[i].is_surface() {
                self.emitted[i] + self.light[i].truncate() * reflected(self.albedo[i])
            } else {
                self.raw[i]
            }
        };
        (0..self.raw.len()).into_par_iter().map(pixel).collect()
    }
}

/// What is divided out of the reflected light.
fn reflected(albedo: Vec3) -> Vec3 {
    albedo.max(Vec3::splat(BLACK))
}

/// The luminance of what falls on a surface.
#[inline]
pub(super) fn luminance_of(light: Vec4) -> f32 {
    luminance(light.truncate())
}

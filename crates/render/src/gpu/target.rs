//! What frames of one size write, and reading it back.

use super::buffers::{read_start, written};
use super::device::Gpu;
use super::layout::{AovPixel, FilmPixel, PackedObservation};
use super::lessons::{LessonPasses, Lessons};
use super::path_pass::PathPass;
use crate::path::Counters;
use crate::{Film, RenderError};
use std::sync::Arc;

/// What a rendering has accumulated, as it lies on its device.
pub struct DeviceFilm<'f> {
    pub(super) gpu: &'f Arc<Gpu>,
    /// [`FilmPixel`]s.
    pub(super) film: &'f wgpu::Buffer,
    /// [`AovPixel`]s; `None` where there are no auxiliary images.
    pub(super) aovs: Option<&'f wgpu::Buffer>,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Samples per pixel.
    pub(super) spp: u64,
    /// The variance of a pixel's mean over what its samples' mean square exceeds its own square by; 0 for one sample.
    pub(super) variance_scale: f32,
}

impl DeviceFilm<'_> {
    /// Why the device does not work any more, if so.
    pub fn fault(&self) -> Option<RenderError> {
        self.gpu.error()
    }

    pub(super) fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// What a frame of one size writes.
pub(super) struct Target {
    pub(super) film: wgpu::Buffer,
    pub(super) observations: wgpu::Buffer,
    /// `None` where no auxiliary images are asked for.
    aovs: Option<wgpu::Buffer>,
    pub(super) group: wgpu::BindGroup,
    /// Columns, rows, and observations that a pixel has room for.
    pub(super) size: [u32; 3],
    pub(super) lessons: Option<Lessons>,
}

impl Target {
    /// Makes room for frames of `size`: columns, rows, and observations per pixel. `lesson_passes`: `None` for samplers that do not learn.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the device has too little room.
    pub(super) fn new(
        gpu: &Gpu,
        pass: &PathPass,
        lesson_passes: Option<&LessonPasses>,
        size: [u32; 3],
        aovs: bool,
    ) -> Result<Self, RenderError> {
        let [width, height, slots] = size;
        let pixels = u64::from(width) * u64::from(height);
        let film = written(gpu, "film", pixels * size_of::<FilmPixel>() as u64)?;
        let observations = written(
            gpu,
            "observations of a frame",
            pixels * u64::from(slots) * size_of::<PackedObservation>() as u64,
        )?;
        let aovs = aovs
            .then(|| written(gpu, "auxiliary images", pixels * size_of::<AovPixel>() as u64))
            .transpose()?;
        let lessons = match lesson_passes {
            Some(passes) => Some(Lessons::new(gpu, passes, &pass.params, &observations, size)?),
            None => None,
        };
        Ok(Self {
            group: pass.target_group(gpu, &film, &observations, aovs.as_ref()),
            film,
            observations,
            aovs,
            size,
            lessons,
        })
    }

    /// `pass` may have another pipeline than before, with the same layers.
    pub(super) fn bind(&mut self, gpu: &Gpu, pass: &PathPass) {
        self.group = pass.target_group(gpu, &self.film, &self.observations, self.aovs.as_ref());
    }

    /// Whether frames of this size, with these layers, write to it.
    pub(super) fn is_for(&self, size: [u32; 3], aovs: bool) -> bool {
        self.size == size && self.aovs.is_some() == aovs
    }

    /// What the device has accumulated, as it lies there; `film` has the number and the weights of the frames.
    pub(super) fn on_device<'t>(&'t self, gpu: &'t Arc<Gpu>, film: &Film) -> DeviceFilm<'t> {
        let share = film.even_share();
        DeviceFilm {
            gpu,
            film: &self.film,
            aovs: self.aovs.as_ref(),
            width: self.size[0],
            height: self.size[1],
            spp: film.spp(),
            variance_scale: if film.spp() > 1 {
                (share / (1.0 - share)) as f32
            } else {
                0.0
            },
        }
    }

    /// What the device has accumulated; `film` has the number and the weights of the frames. Nothing of a device that is lost.
    pub(super) fn read(&self, gpu: &Gpu, film: &Film) -> (Film, Counters) {
        let mut read_back = film.clone();
        let mut counters = Counters::default();
        let pixels = self.size[0] as usize * self.size[1] as usize;
        read_start(gpu, &self.film, pixels * size_of::<FilmPixel>(), |bytes| {
            let pixels: &[FilmPixel] = bytemuck::cast_slice(bytes);
            if film.spp() > 0 {
                read_back.load(|pixel| (pixels[pixel].sums(), pixels[pixel].count, pixels[pixel].weight()));
            }
            for pixel in pixels {
                counters.rays_nearest += u64::from(pixel.rays_nearest);
                counters.rays_occluded += u64::from(pixel.rays_occluded);
                counters.nonfinite += u64::from(pixel.nonfinite);
            }
        });
        if let (Some(aovs), true) = (&self.aovs, film.spp() > 0) {
            let count = u32::try_from(film.spp()).unwrap_or(u32::MAX);
            read_start(gpu, aovs, pixels * size_of::<AovPixel>(), |bytes| {
                let pixels: &[AovPixel] = bytemuck::cast_slice(bytes);
                read_back.load_aovs(|pixel| pixels[pixel].get(count));
            });
        }
        (read_back, counters)
    }
}

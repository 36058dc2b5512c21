//! A rendering as it is shown, made by the device from the film that it holds: what is read back is the picture, 16 bytes a pixel.
//!
//! The twin of [`crate::Cleaner`]: the same steps in the same order, as passes over all pixels, and the same rules for what earlier
//! pictures tell. Pictures differ by rounding, and where a difference within rounding decides.

mod images;
mod layout;
mod passes;

pub use layout::{CleanParams, GuidePixel, KnownPixel, Seen, TintPixel};
pub(super) use passes::Compute;

use super::buffers::{uniform, written};
use super::device::Gpu;
use super::target::DeviceFilm;
use super::timing::{Pass, Timer};
use crate::clean::STEPS;
use crate::{Projection, RenderError};
use images::{Grown, Kept, KeptBuffers, Past, Readback};
use passes::Passes;
use rayon::prelude::*;
use scene::Camera;
use std::sync::Arc;
use std::time::Instant;

/// Side of the workgroups of all passes over pixels.
const SIDE: u32 = 8;
/// In their order.
const STAGES: [Pass; 3] = [Pass::History, Pass::Filter, Pass::Resolve];

/// Takes the noise away from picture after picture of a device's films. Nothing is compiled before the first.
#[derive(Debug, Default)]
pub struct Cleaner {
    /// Of the device of the last film.
    on_device: Option<OnDevice>,
}

/// A picture that a device has made.
#[derive(Clone, Debug)]
pub struct DevicePicture {
    /// Linear radiance, alpha 1, row 0 at the top.
    pub texels: Vec<[f32; 4]>,
    /// Milliseconds of taking over what earlier pictures knew, by the device's clock; 0 if it has none.
    pub history_ms: f64,
    /// Milliseconds of filtering, likewise.
    pub filter_ms: f64,
    /// Milliseconds of all else: waiting, and reading the picture back.
    pub read_ms: f64,
}

impl Cleaner {
    /// The film's image, seen through `camera`, without most of its noise; as it is where the film has no auxiliary images.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the device has too little room, or is lost.
    pub fn clean(&mut self, film: &DeviceFilm<'_>, camera: &Camera) -> Result<DevicePicture, RenderError> {
        match film.aovs {
            Some(aovs) => self.on(film.gpu)?.clean(film, aovs, camera),
            None => self.image(film),
        }
    }

    /// The film's image as it is.
    ///
    /// # Errors
    /// As [`Cleaner::clean`].
    pub fn image(&mut self, film: &DeviceFilm<'_>) -> Result<DevicePicture, RenderError> {
        self.on(film.gpu)?.image(film)
    }

    /// Forgets what earlier pictures knew: another scene.
    pub fn forget(&mut self) {
        if let Some(on_device) = &mut self.on_device {
            (on_device.before, on_device.newest) = (None, None);
        }
    }

    /// What there is on `gpu`; what there was on another is given up.
    fn on(&mut self, gpu: &Arc<Gpu>) -> Result<&mut OnDevice, RenderError> {
        match self.on_device.take().filter(|there| Arc::ptr_eq(&there.gpu, gpu)) {
            Some(there) => Ok(self.on_device.insert(there)),
            None => Ok(self.on_device.insert(OnDevice::new(gpu)?)),
        }
    }
}

/// Passes and images on one device.
#[derive(Debug)]
struct OnDevice {
    gpu: Arc<Gpu>,
    /// `None` until they are needed.
    passes: Option<Passes>,
    mean: Option<Compute>,
    clock: Option<Timer>,
    /// [`CleanParams`].
    params: wgpu::Buffer,
    /// Of the passes of the filter: the distance between their taps.
    steps: [wgpu::Buffer; STEPS.len()],
    /// What passes read where there is no picture before.
    nothing: wgpu::Buffer,
    typical: wgpu::Buffer,
    brightness: Grown,
    tints: Grown,
    light: [Grown; 2],
    /// The last picture through another camera, or before the film began anew.
    before: Option<Past>,
    newest: Option<Past>,
    readback: Readback,
}

impl OnDevice {
    fn new(gpu: &Arc<Gpu>) -> Result<Self, RenderError> {
        let step = |step: usize| uniform(gpu, "distance of taps", bytemuck::bytes_of(&[step as u32, 0, 0, 0]));
        Ok(Self {
            passes: None,
            mean: None,
            clock: Timer::new(gpu),
            params: uniform(gpu, "picture", bytemuck::bytes_of(&CleanParams::default())),
            steps: STEPS.map(step),
            nothing: written(gpu, "no picture", 0)?,
            typical: written(gpu, "typical luminance", size_of::<f32>() as u64)?,
            brightness: Grown::default(),
            tints: Grown::default(),
            light: [Grown::default(), Grown::default()],
            before: None,
            newest: None,
            readback: Readback::default(),
            gpu: gpu.clone(),
        })
    }

    fn image(&mut self, film: &DeviceFilm<'_>) -> Result<DevicePicture, RenderError> {
        let start = Instant::now();
        let gpu = self.gpu.clone();
        let mean = match self.mean.take() {
            Some(mean) => mean,
            None => Compute::new(&gpu, "mean")?,
        };
        let mean = self.mean.insert(mean);
        let params = CleanParams {
            now: Seen {
                width: film.width,
                height: film.height,
                ..Seen::default()
            },
            ..CleanParams::default()
        };
        gpu.queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        let shown = self.light[0].room::<[f32; 4]>(&gpu, "light", film.pixels())?;
        let mut encoder = gpu.device.create_command_encoder(&encoding());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            mean.encode(
                &gpu,
                &mut pass,
                &[&self.params, film.film, &shown],
                groups(film.width, film.height),
            );
        }
        let texels = self.read(encoder, &shown, film.pixels())?;
        Ok(DevicePicture {
            texels,
            history_ms: 0.0,
            filter_ms: 0.0,
            read_ms: start.elapsed().as_secs_f64() * 1e3,
        })
    }

    fn clean(
        &mut self,
        film: &DeviceFilm<'_>,
        aovs: &wgpu::Buffer,
        camera: &Camera,
    ) -> Result<DevicePicture, RenderError> {
        let start = Instant::now();
        let gpu = self.gpu.clone();
        let passes = match self.passes.take() {
            Some(passes) => passes,
            None => Passes::new(&gpu)?,
        };
        let projection = Projection::new(camera, film.width as f32 / film.height as f32);
        let seen = Seen::new(&projection, film.width, film.height);
        let mut kept = self.begin(&seen, film.spp);
        let buffers = kept.room(&gpu, film.pixels())?;
        let params = CleanParams {
            now: seen,
            before: self.before.as_ref().map_or(Seen::default(), |past| past.seen),
            spp: film.spp as f32,
            pixel_size: projection.pixel_size(film.height),
            variance_scale: film.variance_scale,
            pad: 0.0,
        };
        gpu.queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));

        let mut encoder = gpu.device.create_command_encoder(&encoding());
        self.encode(&passes, &mut encoder, film, aovs, &buffers)?;
        if let Some(clock) = &self.clock {
            clock.resolve(&mut encoder, &STAGES);
        }
        let texels = self.read(encoder, &buffers.shown, film.pixels())?;
        let times = self.clock.as_mut().map(|clock| clock.note(&gpu, &STAGES));
        let [history_ms, filter_ms, resolve_ms] = times.unwrap_or_default().try_into().unwrap_or_default();
        self.passes = Some(passes);
        self.newest = Some(Past {
            seen,
            spp: film.spp,
            kept,
            buffers,
        });
        Ok(DevicePicture {
            texels,
            history_ms,
            filter_ms: filter_ms + resolve_ms,
            read_ms: (start.elapsed().as_secs_f64() * 1e3 - history_ms - filter_ms - resolve_ms).max(0.0),
        })
    }

    /// Decides which picture is the one before. Returns room for the new one.
    // twin: crates/render/src/clean/row.rs begin
    fn begin(&mut self, seen: &Seen, spp: u64) -> Kept {
        match self.newest.take() {
            Some(newest) if newest.seen == *seen && newest.spp < spp => newest.kept,
            Some(newest) => self.before.replace(newest).map_or_else(Kept::default, |past| past.kept),
            None => Kept::default(),
        }
    }

    /// All passes, top to bottom.
    fn encode(
        &mut self,
        passes: &Passes,
        encoder: &mut wgpu::CommandEncoder,
        film: &DeviceFilm<'_>,
        aovs: &wgpu::Buffer,
        now: &KeptBuffers,
    ) -> Result<(), RenderError> {
        let (gpu, params, pixels) = (&self.gpu, &self.params, film.pixels());
        let groups = groups(film.width, film.height);
        let brightness =
            self.brightness
                .room::<[f32; 2]>(gpu, "brightness", u64::from(groups[0]) * u64::from(groups[1]))?;
        let tints = self.tints.room::<TintPixel>(gpu, "tints", pixels)?;
        let mut room = |light: usize| self.light[light].room::<[f32; 4]>(gpu, "light", pixels);
        let (light, other) = (room(0)?, room(1)?);
        let before = self.before.as_ref().map_or_else(
            || KeptBuffers {
                guides: self.nothing.clone(),
                known: self.nothing.clone(),
                shown: self.nothing.clone(),
            },
            |past| past.buffers.clone(),
        );
        let clock = self.clock.as_ref();
        {
            let pass = &mut Pass::History.begin(encoder, clock);
            let split = [params, film.film, aovs, &now.guides, &tints, &light];
            passes.split.encode(gpu, pass, &split, groups);
            let recall = [params, &now.guides, &before.guides, &before.known, &now.known, &light];
            passes.recall.encode(gpu, pass, &recall, groups);
        }
        let [mut from, mut to] = [&light, &other];
        {
            let pass = &mut Pass::Filter.begin(encoder, clock);
            passes.vary.encode(gpu, pass, &[params, &now.guides, from, to], groups);
            for step in &self.steps {
                (from, to) = (to, from);
                let atrous = [params, &now.guides, from, to, step];
                passes.atrous.encode(gpu, pass, &atrous, groups);
            }
            (from, to) = (to, from);
        }
        let pass = &mut Pass::Resolve.begin(encoder, clock);
        passes
            .assemble
            .encode(gpu, pass, &[params, &tints, from, to, &brightness], groups);
        passes
            .typical
            .encode(gpu, pass, &[params, &brightness, &self.typical], [1, 1]);
        let resolve = [params, &now.guides, to, &self.typical, &before.shown, &now.shown];
        passes.resolve.encode(gpu, pass, &resolve, groups);
        Ok(())
    }

    /// Submits all, and reads the picture.
    fn read(
        &mut self,
        encoder: wgpu::CommandEncoder,
        shown: &wgpu::Buffer,
        pixels: u64,
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        let gpu = &self.gpu;
        let size = pixels * size_of::<[f32; 4]>() as u64;
        let texels = self.readback.finish(gpu, encoder, shown, size, |bytes| {
            let pixels: &[[f32; 4]] = bytemuck::cast_slice(bytes);
            pixels.par_iter().map(|&[r, g, b, _]| [r, g, b, 1.0]).collect()
        });
        match (texels, gpu.error()) {
            (Some(texels), None) => Ok(texels),
            (_, error) => Err(error.unwrap_or_else(|| gpu.gone())),
        }
    }
}

fn encoding() -> wgpu::CommandEncoderDescriptor<'static> {
    wgpu::CommandEncoderDescriptor { label: Some("picture") }
}

/// Workgroups of a pass over so many columns and rows.
fn groups(width: u32, height: u32) -> [u32; 2] {
    [width.div_ceil(SIDE), height.div_ceil(SIDE)]
}

//! The GPU back end: the estimator of [`crate::renderer`] through wgpu.
//!
//! The scene is uploaded once, in the CPU's own records and with the CPU's own tree; a frame is one dispatch of
//! `shaders/pass/path.wgsl`, whose functions are twins of those in `path.rs` and `direct.rs`. The random numbers are the same
//! integers, and samplers draw from the same tables, so both back ends draw the same lights; images differ by rounding. The film stays on the
//! device until somebody looks at it. Samplers learn on the CPU, from observations that the device has written down and thinned; they are
//! read when an epoch is over, and what was learned is uploaded. Pictures for the eyes are made there too ([`Cleaner`]), so that windows need not
//! read the film.
//!
//! Needs WebGPU's default limits and no feature; larger limits are used where the adapter has them. Auxiliary images alone need one storage
//! buffer more than the default.

mod buffers;
mod clean;
mod count;
mod device;
mod frames;
mod kernel;
mod layout;
mod lessons;
mod path_pass;
mod pipelines;
mod scene;
mod shader;
mod target;
mod timing;

pub use clean::{CleanParams, Cleaner, DevicePicture, GuidePixel, KnownPixel, Seen, TintPixel};
pub use count::Count;
pub use device::{AdapterInfo, Gpu, adapters};
pub use kernel::Kernel;
pub use layout::{
    AovPixel, FilmPixel, FrameParams, LessonCounters, LessonParams, PackedObservation, PixelControl, Run,
};
pub use shader::{files, link};
pub use target::DeviceFilm;
pub use timing::PassTime;

use crate::frame::{Rendering, SceneRef};
use crate::{FrameLoop, Method, PixelFilter, RenderError, Settings};
use ::scene::Camera;
use frames::GpuFrames;
use light_cache::{LightSampler, Recording, SamplerKind, Visitor};
use sampling::PixelSampler;
use std::sync::Arc;
use std::time::Instant;

/// Samplers that it has.
pub const SAMPLERS: [SamplerKind; 5] = [
    SamplerKind::Uniform,
    SamplerKind::Power,
    SamplerKind::Tree,
    SamplerKind::Table,
    SamplerKind::Adaptive,
];

/// Starts a rendering on `gpu`.
///
/// # Errors
/// [`RenderError::Setting`] for a setting out of range, or one that this back end lacks; [`RenderError::Gpu`] for a scene that does not
/// fit.
pub fn renderer<'s>(
    gpu: &Arc<Gpu>,
    scene: impl Into<SceneRef<'s>>,
    camera: &Camera,
    settings: &Settings,
) -> Result<Box<dyn FrameLoop<'s> + 's>, RenderError> {
    let kind = check(settings)?;
    let scene = scene.into();
    let starter = Starter {
        gpu: gpu.clone(),
        scene: scene.clone(),
        camera,
        settings,
        start: Instant::now(),
    };
    light_cache::build(&scene, &settings.light, kind, starter)
}

/// The sampler that `settings` ask for, if this back end can do what they say.
///
/// # Errors
/// [`RenderError::Setting`] for a setting out of range, or one that this back end lacks.
pub fn check(settings: &Settings) -> Result<SamplerKind, RenderError> {
    settings.check()?;
    let kind = match settings.method {
        Method::Sampled(kind) if SAMPLERS.contains(&kind) => kind,
        _ => return Err(refusal(format!("the sampler '{}'", settings.method.name()))),
    };
    if settings.pixel_sampler != PixelSampler::Sobol {
        return Err(refusal(format!(
            "the pixel sampler '{}'",
            settings.pixel_sampler.name()
        )));
    }
    if settings.pixel_filter != PixelFilter::Box {
        return Err(refusal("a pixel filter other than 'box'".into()));
    }
    if settings.adaptive_pixels {
        return Err(refusal(
            "different numbers of samples per pixel (--target-error)".into(),
        ));
    }
    Ok(kind)
}

/// What is told of something that only the CPU has.
fn refusal(what: String) -> RenderError {
    RenderError::Setting {
        what: format!("the GPU back end lacks {what}"),
        remedy: "render it with --backend cpu".into(),
    }
}

/// Starts a rendering with whatever sampler was built.
struct Starter<'s, 'a> {
    gpu: Arc<Gpu>,
    scene: SceneRef<'s>,
    camera: &'a Camera,
    settings: &'a Settings,
    start: Instant,
}

impl<'s> Starter<'s, '_> {
    fn start<S: LightSampler + 'static>(self, sampler: S) -> Result<Box<dyn FrameLoop<'s> + 's>, RenderError> {
        let frames = GpuFrames::new(self.gpu, &self.scene, sampler, self.settings)?;
        let rendering = Rendering::new(self.scene, self.camera, self.settings, frames, self.start);
        match rendering.error() {
            Some(error) => Err(error),
            None => Ok(Box::new(rendering)),
        }
    }
}

impl<'s> Visitor for Starter<'s, '_> {
    type Output = Result<Box<dyn FrameLoop<'s> + 's>, RenderError>;

    fn visit<S: LightSampler + 'static>(self, sampler: S) -> Self::Output {
        if self.settings.record_lights {
            let recording = Recording::new(sampler, &self.scene, self.settings.light.table_decay);
            self.start(recording)
        } else {
            self.start(sampler)
        }
    }
}

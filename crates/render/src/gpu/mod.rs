//! The GPU back end: the estimator of [`crate::renderer`] through wgpu.
//!
//! The scene is uploaded once, in the CPU's own records and with the CPU's own tree; a frame is one dispatch of
//! `shaders/pass/path.wgsl`, whose functions are twins of those in `path.rs` and `direct.rs`. The random numbers are the same
//! integers, and samplers draw from the same tables, so both back ends draw the same lights; images differ by rounding. The film stays on the
//! device until somebody looks at it. Samplers learn on the CPU, from observations that the device has written down, and what they
//! have learned is uploaded.
//!
//! `adaptive` draws without its control variate here.
//!
//! Needs WebGPU's default limits and no feature; larger limits are used where the adapter has them.

mod buffers;
mod device;
mod frames;
mod kernel;
mod layout;
mod scene;
mod shader;

pub use device::{AdapterInfo, Gpu, adapters};
pub use kernel::Kernel;
pub use layout::{FilmPixel, FrameParams, PackedObservation};
pub use shader::{files, link};

use crate::frame::{Rendering, SceneRef};
use crate::{FrameLoop, Method, PixelFilter, RenderError, Settings};
use ::scene::Camera;
use frames::GpuFrames;
use light_cache::{LightSampler, Recording, Visitor};
use sampling::PixelSampler;
use std::sync::Arc;
use std::time::Instant;

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
    settings.check()?;
    let Method::Sampled(kind) = settings.method else {
        return Err(refusal(format!("the sampler '{}'", settings.method.name())));
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
    if settings.aovs {
        return Err(refusal("auxiliary images".into()));
    }
    let scene = scene.into();
    let starter = Starter {
        gpu: gpu.clone(),
        scene: scene.clone(),
        camera,
        settings,
        start: Instant::now(),
    };
    let light = light_cache::Settings {
        control_variate: false,
        ..settings.light.clone()
    };
    light_cache::build(&scene, &light, kind, starter)
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

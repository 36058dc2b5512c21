//! Rendering frame by frame, as the rest of the program sees it. A rendering in progress is in `frame::rendering`, its frames are in
//! `frame::drawn`, and what happens inside a frame is in `path`.

use crate::choosing::Choosing;
use crate::direct::OneLight;
use crate::exact::AllLights;
use crate::gpu::{DeviceFilm, PassTime};
use crate::oracle::Oracle;
use crate::restir::Restir;
use crate::{Film, Method, RenderError, Settings};
pub(crate) use drawn::Drawn;
pub(crate) use frames::Frames;
use light_cache::{CellRecord, LightRecord, LightSampler, Recording, SamplerKind, SamplerStats, ShadingPoint, Visitor};
pub(crate) use rendering::{Eye, Rendering};
use scene::{Camera, Scene};
pub use state::film_of;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Counters of a rendering.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct RenderStats {
    /// Frames done (= samples per pixel).
    pub frames: u64,
    /// Seconds of rendering frames, learning included; loading and building excluded.
    pub render_s: f64,
    /// Seconds of building the light structures.
    pub light_build_s: f64,
    /// Seconds in which `oracle` found out what is best. In no other figure; 0 for all others.
    pub prepare_s: f64,
    /// Rays traced for the nearest hit.
    pub rays_nearest: u64,
    /// Shadow rays traced.
    pub rays_occluded: u64,
    /// Samples that came out NaN or infinite, counted and left out: always 0 unless there is a bug.
    pub nonfinite_samples: u64,
    /// The sampler's own figures; `None` for `exact`.
    pub sampler: Option<SamplerStats>,
    /// What the integrator left out because the scene does not need it.
    pub skipped: Vec<String>,
}

/// The scene of a rendering: it outlives the rendering, or is shared with it, so that a long walk can go from one state
/// of a scene to the next without keeping them all.
#[derive(Clone, Debug)]
pub enum SceneRef<'s> {
    /// Somebody else's.
    Borrowed(&'s Scene),
    /// Kept as long as anyone needs it. Where a rendering has it alone, the budget of [`Scene::set_memory_budget`] is kept too.
    Shared(Arc<Scene>),
}

impl Deref for SceneRef<'_> {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        match self {
            Self::Borrowed(scene) => scene,
            Self::Shared(scene) => scene,
        }
    }
}

impl SceneRef<'_> {
    /// Drops what the scene has made on demand and may not keep ([`Scene::make_room`]). Returns whether it could: only whoever has the scene alone
    /// can.
    pub(crate) fn make_room(&mut self) -> bool {
        let alone = match self {
            Self::Borrowed(_) => None,
            Self::Shared(scene) => Arc::get_mut(scene),
        };
        alone.map(Scene::make_room).is_some()
    }
}

impl<'s> From<&'s Scene> for SceneRef<'s> {
    fn from(scene: &'s Scene) -> Self {
        Self::Borrowed(scene)
    }
}

impl From<Arc<Scene>> for SceneRef<'_> {
    fn from(scene: Arc<Scene>) -> Self {
        Self::Shared(scene)
    }
}

/// A rendering in progress, of scenes that live as long as `'s`.
///
/// Camera, size and scene may change between frames: the image then starts anew, and the sampler keeps what it has learned.
pub trait FrameLoop<'s>: Send {
    /// Renders one frame, one sample per pixel, on rayon's current thread pool, and lets the sampler learn from it.
    fn render_frame(&mut self) {
        self.render_frame_unless(&AtomicBool::new(false));
    }

    /// [`FrameLoop::render_frame`], given up as soon as `stop` is set: some tiles then have a sample more than others, the
    /// frame does not count, and nothing is learned. Returns whether the frame was finished.
    fn render_frame_unless(&mut self, stop: &AtomicBool) -> bool;

    /// What has been accumulated. What a device holds is read back when it is asked for.
    fn film(&self) -> &Film;

    /// What a device has accumulated, for [`crate::gpu::Cleaner`]: nothing is read back for that, nor for counters from then on. `None` for
    /// the CPU, and before the first frame.
    fn device_film(&self) -> Option<DeviceFilm<'_>> {
        None
    }

    /// Width and height of the film, which is not read back for that.
    fn size(&self) -> (u32, u32);

    /// The scene that it renders.
    fn scene(&self) -> &Scene;

    /// [`Film::spp`], likewise.
    fn spp(&self) -> u64;

    /// [`RenderStats::sampler`] alone, likewise.
    fn sampler_stats(&self) -> Option<SamplerStats>;

    /// Why frames are not what they should be, if so: the device that made them is gone, or a mesh of the scene could not be read when a ray first
    /// came near it.
    fn error(&self) -> Option<RenderError> {
        None
    }

    /// Waits until every frame is done: a device may still be at work on the last one. Nothing to do for the CPU.
    fn wait(&mut self) {}

    /// From the next frame on measures how long passes take on the device, which slows it down. Returns whether it can.
    fn time_passes(&mut self) -> bool {
        false
    }

    /// What was measured since [`FrameLoop::time_passes`].
    fn pass_times(&self) -> Vec<PassTime> {
        Vec::new()
    }

    /// Starts the image anew. No random number is drawn again.
    fn restart(&mut self);

    /// Looks through another camera from now on.
    fn set_camera(&mut self, camera: &Camera);

    /// Makes images of another size from now on, 1..=32,768 pixels each way, with auxiliary images or without.
    ///
    /// # Errors
    /// [`RenderError::Setting`] for a size out of range.
    fn set_film(&mut self, width: u32, height: u32, aovs: bool) -> Result<(), RenderError>;

    /// Goes on with another state of the scene: the same lights in the same order, some of which may shine otherwise, and
    /// any geometry.
    ///
    /// # Errors
    /// [`RenderError::Setting`] if there are more or fewer lights.
    fn set_scene(&mut self, scene: SceneRef<'s>) -> Result<(), RenderError>;

    /// The whole state: film, counters and what was learned, for [`FrameLoop::restore`].
    ///
    /// # Errors
    /// [`RenderError::State`] if this renderer cannot tell its state.
    fn save(&self) -> Result<Vec<u8>, RenderError> {
        Err(state::unable())
    }

    /// Takes over what [`FrameLoop::save`] has told, in a rendering of the same scene, camera and settings: it goes on to the bit as the other
    /// would have. Bytes that were damaged on the way may be taken for another rendering's: check them before.
    ///
    /// # Errors
    /// [`RenderError::State`] if the bytes are no such state, or if this renderer cannot take one over.
    fn restore(&mut self, _state: &[u8]) -> Result<(), RenderError> {
        Err(state::unable())
    }

    /// Leaves out the next `count` frames: their random numbers are for somebody else, who renders them.
    ///
    /// # Errors
    /// [`RenderError::State`] if this renderer cannot.
    fn skip_frames(&mut self, _count: u32) -> Result<(), RenderError> {
        Err(state::unable())
    }

    /// Counters so far.
    fn stats(&self) -> RenderStats;

    /// What the sampler knows about each light; empty for methods without one. Whole with [`Settings::record_lights`]
    /// only.
    fn light_records(&self) -> Vec<LightRecord>;

    /// What the sampler has learned about each cell; empty for samplers without cells.
    fn cells(&self) -> Vec<CellRecord>;

    /// The number of the cell that serves each point, as in [`CellRecord::cell`]; `None` where none does.
    fn cells_at(&self, points: &[ShadingPoint]) -> Vec<Option<u64>>;

    /// The probability with which each light is drawn now, mean over `points`; empty for methods without a sampler.
    fn light_probabilities(&self, points: &[ShadingPoint]) -> Vec<f64>;

    /// Measures what the choice of lights costs, by making all choices of one frame again and nothing else; `None` for
    /// methods without a sampler.
    fn choosing(&self) -> Option<Choosing>;
}

/// Starts a rendering: builds the light structures that `settings.method` needs.
///
/// # Errors
/// [`RenderError::Setting`] for a setting out of range.
pub fn renderer<'s>(
    scene: impl Into<SceneRef<'s>>,
    camera: &Camera,
    settings: &Settings,
) -> Result<Box<dyn FrameLoop<'s> + 's>, RenderError> {
    settings.check()?;
    let scene = scene.into();
    let start = Instant::now();
    Ok(match settings.method {
        Method::Exact => {
            let frames = Drawn::new(AllLights::new(&scene.lights));
            Box::new(Rendering::new(scene, camera, settings, frames, start))
        }
        Method::Oracle => Box::new(Rendering::new(scene, camera, settings, Oracle::new(settings), start)),
        Method::Restir if scene.lights.len() > 1 => {
            let restir = Restir::new(&scene, settings);
            Box::new(Rendering::new(scene, camera, settings, restir, start))
        }
        Method::Sampled(_) | Method::Restir => {
            // Of one light there is nothing to be kept: `restir` is then what its candidates are drawn by.
            let kind = match settings.method {
                Method::Sampled(kind) => kind,
                _ => SamplerKind::Tree,
            };
            let starter = Starter {
                scene: scene.clone(),
                camera,
                settings,
                start,
            };
            light_cache::build(&scene, &settings.light, kind, starter)
        }
    })
}

/// Starts a rendering with whatever sampler was built.
struct Starter<'s, 'a> {
    scene: SceneRef<'s>,
    camera: &'a Camera,
    settings: &'a Settings,
    start: Instant,
}

impl<'s> Visitor for Starter<'s, '_> {
    type Output = Box<dyn FrameLoop<'s> + 's>;

    fn visit<S: LightSampler + 'static>(self, sampler: S) -> Self::Output {
        let Self {
            scene,
            camera,
            settings,
            start,
        } = self;
        if settings.record_lights {
            let recording = Recording::new(sampler, &scene, settings.light.table_decay);
            let frames = Drawn::new(OneLight(recording));
            Box::new(Rendering::new(scene, camera, settings, frames, start))
        } else {
            let frames = Drawn::new(OneLight(sampler));
            Box::new(Rendering::new(scene, camera, settings, frames, start))
        }
    }
}

mod drawn;
mod frames;
mod rendering;
mod state;
#[cfg(test)]
mod tests;

//! From arguments to frames: loading, choosing the camera, rendering until the budget is spent.

use crate::cli::{Backend, BudgetArgs};
use crate::exit::Refusal;
use crate::interrupt::Watch;
use crate::progress::Progress;
use crate::{machine, message, output};
use anyhow::{Context, Result, bail};
use render::gpu::Gpu;
use render::{Film, FrameLoop, GpuFault, Method, RenderError, SceneRef, Settings};
use scene::{Camera, Scene};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// A scene with how it came to be.
#[derive(Debug)]
pub(crate) struct Loaded {
    /// The scene.
    pub(crate) scene: Scene,
    /// What was asked for: path or `demo:...`.
    pub(crate) what: String,
    /// Seconds of reading or generating, the BVH excluded.
    pub(crate) load_s: f64,
}

impl Loaded {
    /// Builds what otherwise waits until a ray needs it, see [`Scene::build_all`].
    pub(crate) fn build_all(&mut self) {
        let start = Instant::now();
        self.scene.build_all();
        self.scene.build_s += start.elapsed().as_secs_f64();
    }

    /// The scene for a rendering to have alone, as a memory budget asks for, and what is known of it.
    pub(crate) fn give(self) -> (Arc<Scene>, Origin) {
        let Self { scene, what, load_s } = self;
        (Arc::new(scene), Origin { what, load_s })
    }
}

/// What is known of a scene besides the scene itself.
#[derive(Debug)]
pub(crate) struct Origin {
    /// [`Loaded::what`].
    pub(crate) what: String,
    /// [`Loaded::load_s`].
    pub(crate) load_s: f64,
}

/// Whether `word` looks like a scene rather than a mistyped command.
pub(crate) fn looks_like_scene(word: &str) -> bool {
    let extension = Path::new(word).extension().and_then(|e| e.to_str()).unwrap_or_default();
    word.starts_with("demo:") || ["glb", "gltf"].contains(&extension) || Path::new(word).exists()
}

/// Sets up the threads for the whole process; call it before anything runs in parallel.
///
/// # Errors
/// If the system gives no threads.
pub(crate) fn use_threads(threads: Option<u16>) -> Result<()> {
    // 0 lets rayon decide: RAYON_NUM_THREADS, else all processors.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0).into());
    pool.build_global()
        .context("cannot start the threads; try a smaller --threads")
}

/// Loads a scene and warns of what was ignored in it.
///
/// # Errors
/// Those of [`scene::load`].
pub(crate) fn load(what: &str) -> Result<Loaded> {
    let start = Instant::now();
    let scene = scene::load(what)?;
    let load_s = (start.elapsed().as_secs_f64() - scene.build_s).max(0.0);
    Ok(Loaded {
        scene,
        what: what.into(),
        load_s,
    })
}

/// [`load`], and tells on stderr what was ignored and repaired.
///
/// # Errors
/// Those of [`scene::load`].
pub(crate) fn load_with_warnings(what: &str) -> Result<Loaded> {
    const SHOWN: usize = 5;
    let loaded = load(what)?;
    let report = &loaded.scene.parts.report;
    let ignored = report
        .ignored
        .iter()
        .map(|(what, count)| format!("ignored: {what} ({count}x)"));
    let all: Vec<String> = ignored.chain(report.warnings.iter().cloned()).collect();
    for text in all.iter().take(SHOWN) {
        message::warn(text);
    }
    if all.len() > SHOWN {
        message::warn(format!(
            "{} more; `manylight info {what}` lists them",
            all.len() - SHOWN
        ));
    }
    if loaded.scene.lights.is_empty() {
        message::warn("the scene has no lights: the image will be black");
    }
    Ok(loaded)
}

/// The camera of that name or index; the first if none is asked for.
///
/// # Errors
/// If there is no such camera; tells which there are.
pub(crate) fn camera<'s>(scene: &'s Scene, wanted: Option<&str>) -> Result<&'s Camera> {
    let cameras = &scene.parts.cameras;
    let found = match wanted {
        None => cameras.first(),
        Some(wanted) => {
            let by_index = || wanted.parse().ok().and_then(|index: usize| cameras.get(index));
            cameras.iter().find(|camera| camera.name == wanted).or_else(by_index)
        }
    };
    let Some(camera) = found else {
        let known: Vec<String> = cameras
            .iter()
            .enumerate()
            .map(|(i, c)| format!("{i} '{}'", c.name))
            .collect();
        bail!(
            "no camera '{}' in the scene; there is: {}",
            wanted.unwrap_or_default(),
            known.join(", ")
        );
    };
    Ok(camera)
}

/// Starts a rendering, provided that its film fits into memory.
///
/// # Errors
/// Settings out of range; [`Refusal::OutOfMemory`].
pub(crate) fn start<'s>(
    scene: impl Into<SceneRef<'s>>,
    camera: &Camera,
    settings: &Settings,
) -> Result<Box<dyn FrameLoop<'s> + 's>> {
    // Compensated sums, moments, finished image and what the file writer copies; auxiliary images about double it.
    let bytes_per_pixel = if settings.aovs { 256 } else { 128 }
        + if settings.adaptive_pixels { 64 } else { 0 }
        + if settings.method == Method::Restir { 128 } else { 0 };
    let bytes = u64::from(settings.width) * u64::from(settings.height) * bytes_per_pixel;
    if machine::available_memory_bytes().is_some_and(|available| bytes > available) {
        let (gib, size) = (bytes as f64 / (1u64 << 30) as f64, (settings.width, settings.height));
        let text = format!(
            "an image of {} x {} pixels needs about {gib:.1} GiB, more than is free; ask for a smaller one",
            size.0, size.1
        );
        return Err(Refusal::OutOfMemory(text).into());
    }
    Ok(render::renderer(scene, camera, settings)?)
}

/// What renders, ready for use.
#[derive(Clone, Debug)]
pub(crate) enum BackEnd {
    /// The processor.
    Cpu,
    /// An open device.
    Gpu(Arc<Gpu>),
}

impl BackEnd {
    /// Opens the device if there is one to open.
    ///
    /// # Errors
    /// [`Refusal::NoGpu`].
    pub(crate) fn open(backend: Backend) -> Result<Self> {
        Ok(match backend {
            Backend::Cpu => Self::Cpu,
            Backend::Gpu => {
                let folder = output::cache_folder().map(|folder| folder.join("pipelines"));
                Self::Gpu(Gpu::open_with(folder.as_deref()).map_err(of_gpu)?)
            }
        })
    }

    /// [`start`] there.
    ///
    /// # Errors
    /// Those of [`start`]; what the GPU lacks.
    pub(crate) fn start<'s>(
        &self,
        scene: impl Into<SceneRef<'s>>,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<Box<dyn FrameLoop<'s> + 's>> {
        match self {
            Self::Cpu => start(scene, camera, settings),
            Self::Gpu(gpu) => render::gpu::renderer(gpu, scene, camera, settings).map_err(of_gpu),
        }
    }
}

/// "cpu", or "gpu: " and the adapter.
impl std::fmt::Display for BackEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Cpu => f.write_str("cpu"),
            Self::Gpu(gpu) => write!(f, "gpu: {}", gpu.info()),
        }
    }
}

/// Gives faults of the GPU their exit codes.
pub(crate) fn of_gpu(error: RenderError) -> anyhow::Error {
    match error {
        RenderError::Gpu { fault, what } => match fault {
            GpuFault::NoAdapter => Refusal::NoGpu(what).into(),
            GpuFault::Lost(_) | GpuFault::OutOfMemory => Refusal::OutOfMemory(what).into(),
        },
        other => other.into(),
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// After so many frames.
    pub(crate) frames: Option<u64>,
    /// After so many seconds of rendering.
    pub(crate) seconds: Option<f64>,
    /// When the relMSE is below this, as far as can be told.
    pub(crate) target_error: Option<f64>,
}

/// Frames before the first look at the estimated error: variances of fewer are not worth a decision.
const FIRST_LOOK: u64 = 16;

/// Looks at the estimated error while the number of frames doubles; a power of two. Each is one more chance to stop by mistake.
const LOOKS: u64 = 8;

impl Budget {
    /// What the options say; `default` frames if they say nothing.
    pub(crate) fn new(args: &BudgetArgs, default: u64) -> Self {
        let frames = args.spp.or(if args.time.is_none() { Some(default) } else { None });
        Self {
            frames,
            seconds: args.time,
            target_error: None,
        }
    }

    /// The same, or as soon as the relMSE is below `target_error`.
    pub(crate) fn until(self, target_error: Option<f64>, args: &BudgetArgs) -> Self {
        // The default number of frames is for those who do not say when to stop.
        let frames = if target_error.is_some() { args.spp } else { self.frames };
        Self {
            frames,
            target_error,
            ..self
        }
    }

    /// The part of the way to the error asked for that is done, 1 when it is reached for all that can be told: when the upper end of its
    /// confidence interval is below it. 0 between looks.
    fn precision(&self, film: &Film) -> f64 {
        let frames = film.spp();
        // By the number of frames alone: a rendering that was stopped and goes on looks as if it had not been.
        let step = (1 << frames.max(1).ilog2()) / LOOKS;
        match self.target_error {
            Some(target) if frames >= FIRST_LOOK && frames.is_multiple_of(step) => {
                // The error falls at least in proportion to the frames.
                film.estimated_error()
                    .map_or(0.0, |error| (target / error.high).min(1.0))
            }
            _ => 0.0,
        }
    }

    /// Whether `film` has the error that was asked for, if any was.
    pub(crate) fn is_met(&self, film: &Film) -> bool {
        self.precision(film) >= 1.0
    }

    /// The part that is done, 1 at the end.
    pub(crate) fn done(&self, frames: u64, seconds: f64) -> f64 {
        let by_frames = self.frames.map_or(0.0, |all| frames as f64 / all as f64);
        let by_time = self.seconds.map_or(0.0, |all| seconds / all);
        by_frames.max(by_time).min(1.0)
    }
}

/// Renders until the budget is spent or a signal comes; at least one frame. `each` sees the state after every frame,
/// its time does not count. Returns the seconds spent in frames.
///
/// # Errors
/// If the GPU that renders is lost.
pub(crate) fn render_frames(
    frame_loop: &mut dyn FrameLoop<'_>,
    budget: Budget,
    watch: &Watch,
    what: &str,
    mut each: impl FnMut(&dyn FrameLoop<'_>),
) -> Result<f64> {
    let pixels = u64::from(frame_loop.film().width()) * u64::from(frame_loop.film().height());
    let mut progress = Progress::new(what);
    let (mut frames, mut seconds) = (0, 0.0);
    loop {
        let start = Instant::now();
        frame_loop.render_frame();
        if let Some(error) = frame_loop.error() {
            return Err(of_gpu(error));
        }
        seconds += start.elapsed().as_secs_f64();
        frames += 1;
        let mut done = budget.done(frames, seconds);
        if budget.target_error.is_some() {
            let start = Instant::now();
            done = done.max(budget.precision(frame_loop.film()));
            seconds += start.elapsed().as_secs_f64();
        }
        progress.update(done, frames, pixels);
        each(frame_loop);
        if done >= 1.0 || watch.stopped() {
            // A device may still be at work, or may have failed just now.
            let start = Instant::now();
            frame_loop.wait();
            return match frame_loop.error() {
                Some(error) => Err(of_gpu(error)),
                None => Ok(seconds + start.elapsed().as_secs_f64()),
            };
        }
    }
}

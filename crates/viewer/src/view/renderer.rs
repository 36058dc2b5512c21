//! The thread that renders: it owns the rendering, takes commands, and hands finished pictures to the window.
//!
//! While the camera moves, frames are small enough to keep the frame time; once it rests the picture is rendered in full
//! and refined. A command that makes the picture worthless stops a frame in full size at once.

mod device;
mod messages;

pub(super) use messages::{Command, Figures, Picture, Report, Stages};

use super::inspector;
use super::resolution::Resolution;
use super::views::{Shown, View};
use crate::clean::Cleaner;
use crate::cli::Backend;
use crate::machine;
use device::Device;
use glam::{Vec2, Vec3};
use light_cache::{SamplerKind, ShadingPoint};
use render::image::{self, Channel};
use render::{FrameLoop, Image, Method, RenderError, Settings};
use scene::{Camera, PrimitiveId, Ray, Scene};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The picture is moving until the camera has rested for so long.
const REST: Duration = Duration::from_millis(150);
/// Least time between two pictures of the same view in full size: they differ little, and uploading takes time.
const BETWEEN_REFINEMENTS: Duration = Duration::from_millis(120);
/// A picture of so many samples per pixel is finished.
const FINISHED_SPP: u64 = 1 << 16;
/// From so many samples per pixel on the picture is shown as it is.
const CLEAN_SPP: u64 = 128;
/// Least time between two reports of what lights matter.
const BETWEEN_IMPORTANCES: Duration = Duration::from_millis(500);

/// The window's side of the thread.
#[derive(Debug)]
pub(super) struct Renderer {
    commands: Option<Sender<Command>>,
    stop: Arc<AtomicBool>,
    latest: Arc<Mutex<Option<Picture>>>,
    thread: Option<JoinHandle<()>>,
}

impl Renderer {
    /// Starts the thread; `tell` is called from it.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(super) fn start(
        settings: Settings,
        backend: Backend,
        tell: impl Fn(Report) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (commands, receiver) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let latest = Arc::new(Mutex::new(None));
        let mut worker = Worker {
            commands: receiver,
            stop: stop.clone(),
            latest: latest.clone(),
            tell: Box::new(tell),
            settings,
            view: View::Image,
            denoise: true,
            window: (0, 0),
            paused: false,
            wants_importance: false,
            resolution: Resolution::new(30.0),
            cleaner: Cleaner::default(),
            device: Device::new(backend),
            stage: None,
        };
        let thread = std::thread::Builder::new()
            .name("renderer".into())
            .spawn(move || worker.run())?;
        Ok(Self {
            commands: Some(commands),
            stop,
            latest,
            thread: Some(thread),
        })
    }

    /// Sends a command; whether anybody listens.
    pub(super) fn send(&self, command: Command) -> bool {
        let urgent = command.is_urgent();
        let sent = self
            .commands
            .as_ref()
            .is_some_and(|commands| commands.send(command).is_ok());
        // After sending, so that the frame that is stopped is never one that knows the command already.
        if urgent {
            self.stop.store(true, Ordering::Relaxed);
        }
        sent
    }

    /// The newest picture, once.
    pub(super) fn take_picture(&self) -> Option<Picture> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        self.commands = None;
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has said so on stderr.
            let _ = thread.join();
        }
    }
}

/// The thread's side.
struct Worker {
    commands: Receiver<Command>,
    stop: Arc<AtomicBool>,
    latest: Arc<Mutex<Option<Picture>>>,
    tell: Box<dyn Fn(Report) + Send>,
    settings: Settings,
    view: View,
    denoise: bool,
    window: (u32, u32),
    paused: bool,
    wants_importance: bool,
    resolution: Resolution,
    /// What earlier pictures knew, for the eyes.
    cleaner: Cleaner,
    device: Device,
    stage: Option<Stage>,
}

/// What is rendered.
struct Stage {
    /// As it was loaded.
    base: Arc<Scene>,
    /// As it is now.
    scene: Arc<Scene>,
    camera: Camera,
    frames: Box<dyn FrameLoop<'static>>,
    /// When the picture last became worthless.
    changed: Instant,
    /// The first input that no picture shows yet.
    input: Option<Instant>,
    published: Option<Instant>,
    importance_told: Option<Instant>,
    /// Rays traced until the last picture.
    rays: u64,
    /// What the last frames took.
    seconds: f64,
    /// What it took to make the last picture of what was rendered.
    showing: Duration,
    /// Seconds of learning until the last frames, and in them.
    learned: [f64; 2],
    /// A part of the scene could not be read, and that was told.
    incomplete: bool,
}

impl Worker {
    /// Until nobody sends commands any more.
    fn run(&mut self) {
        while self.take_commands() {
            self.render();
        }
    }

    /// Obeys all commands that have come; waits for one if there is nothing to render. False at the end.
    fn take_commands(&mut self) -> bool {
        loop {
            self.stop.store(false, Ordering::Relaxed);
            let mut look = None;
            loop {
                match self.commands.try_recv() {
                    // Only the last of several cameras will be seen.
                    Ok(Command::Look(camera, since)) => {
                        look = Some((camera, look.map_or(since, |(_, first)| first)));
                    }
                    Ok(command) => self.obey(command),
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => return false,
                }
            }
            if let Some((camera, since)) = look {
                self.obey(Command::Look(camera, since));
            }
            if self.has_work() {
                return true;
            }
            match self.commands.recv() {
                Ok(command) => self.obey(command),
                Err(_) => return false,
            }
        }
    }

    fn has_work(&self) -> bool {
        let unfinished = |stage: &Stage| stage.frames.spp() < FINISHED_SPP || self.size(stage).is_some();
        !self.paused && self.window.0 > 0 && self.window.1 > 0 && self.stage.as_ref().is_some_and(unfinished)
    }

    fn obey(&mut self, command: Command) {
        let outcome = match command {
            Command::Scene(scene, camera) => {
                self.cleaner.forget();
                self.enter(scene.clone(), scene, camera)
            }
            Command::Look(camera, since) => {
                if let Some(stage) = &mut self.stage {
                    stage.camera.clone_from(&camera);
                    stage.frames.set_camera(&camera);
                    stage.changed = Instant::now();
                    stage.input.get_or_insert(since);
                }
                Ok(())
            }
            Command::Resize(width, height) => {
                self.window = (width, height);
                self.touch();
                Ok(())
            }
            Command::Render(settings) => {
                let before = std::mem::replace(&mut self.settings, *settings);
                if before == self.settings {
                    Ok(())
                } else {
                    self.cleaner.forget();
                    self.begin_anew()
                }
            }
            Command::Device(backend) => {
                self.device = Device::new(backend);
                self.cleaner.forget();
                self.begin_anew()
            }
            Command::Show(view) => self.show(view, self.denoise),
            Command::Denoise(denoise) => self.show(self.view, denoise),
            Command::Budget(milliseconds) => {
                self.resolution.set_budget(milliseconds);
                Ok(())
            }
            Command::Relight(factors) => self.relight(&factors),
            Command::Importance(wanted) => {
                self.wants_importance = wanted;
                Ok(())
            }
            Command::Pause(paused) => {
                self.paused = paused;
                // What has been rendered since the last picture is shown too.
                if paused && self.stage.as_ref().is_some_and(|stage| stage.frames.spp() > 0) {
                    self.publish();
                }
                Ok(())
            }
            Command::Inspect(at) => {
                let stage = self.stage.as_ref();
                let found = stage.and_then(|stage| {
                    inspector::inspect(&stage.scene, &stage.camera, self.window, at, stage.frames.as_ref())
                });
                (self.tell)(Report::Inspected(found.map(Box::new)));
                Ok(())
            }
            Command::SaveExr(path) => {
                let written = self
                    .save_exr(&path)
                    .map(|()| path)
                    .map_err(|error| format!("{error:#}"));
                (self.tell)(Report::Saved(written));
                Ok(())
            }
        };
        if let Err(error) = outcome {
            (self.tell)(Report::Trouble(format!("{error:#}")));
        }
    }

    /// Starts to render `scene`, having learned nothing.
    fn enter(&mut self, base: Arc<Scene>, scene: Arc<Scene>, camera: Camera) -> anyhow::Result<()> {
        self.stage = None;
        self.resolution.forget();
        let (width, height) = self.resolution.moving_size(self.window);
        let settings = Settings {
            width,
            height,
            aovs: self.wants_aovs(),
            ..self.settings.clone()
        };
        let frames = self.device.start(&scene, &camera, &settings, &self.tell)?;
        self.stage = Some(Stage {
            base,
            scene,
            camera,
            frames,
            changed: Instant::now(),
            input: None,
            published: None,
            importance_told: None,
            rays: 0,
            seconds: 0.0,
            showing: Duration::ZERO,
            learned: [0.0; 2],
            incomplete: false,
        });
        Ok(())
    }

    /// [`Worker::enter`] with what is there.
    fn begin_anew(&mut self) -> anyhow::Result<()> {
        match self.stage.take() {
            Some(Stage {
                base, scene, camera, ..
            }) => self.enter(base, scene, camera),
            None => Ok(()),
        }
    }

    /// The picture has become worthless.
    fn touch(&mut self) {
        if let Some(stage) = &mut self.stage {
            stage.frames.restart();
            stage.changed = Instant::now();
        }
    }

    /// Whether the film keeps auxiliary images.
    fn needs_aovs(&self) -> bool {
        self.wants_aovs() && !self.device.renders()
    }

    fn wants_aovs(&self) -> bool {
        self.view.needs_aovs() || (self.denoise && self.view == View::Image)
    }

    fn show(&mut self, view: View, denoise: bool) -> anyhow::Result<()> {
        let before = self.needs_aovs();
        (self.view, self.denoise) = (view, denoise);
        let now = self.needs_aovs();
        if view.needs_aovs() && self.device.renders() {
            (self.tell)(Report::Trouble(
                "this view needs auxiliary images, which the GPU does not keep: choose the CPU in the settings".into(),
            ));
        }
        let Some(stage) = &mut self.stage else { return Ok(()) };
        stage.published = None;
        if before != now {
            let (width, height) = stage.frames.size();
            stage.frames.set_film(width, height, now)?;
            stage.changed = Instant::now();
        }
        Ok(())
    }

    /// Goes on under other light. What was learned stays, where the sampler can use it.
    fn relight(&mut self, factors: &[(u32, Vec3)]) -> anyhow::Result<()> {
        let Some(stage) = &mut self.stage else { return Ok(()) };
        stage.scene = if factors.is_empty() {
            stage.base.clone()
        } else {
            Arc::new(stage.base.relit(factors))
        };
        // What these know of the lights is fixed when they are built, and they lose nothing when they are built again.
        let built_anew = matches!(
            self.settings.method,
            Method::Sampled(SamplerKind::Uniform | SamplerKind::Power | SamplerKind::Tree)
        );
        if built_anew {
            return self.begin_anew();
        }
        stage.frames.set_scene(stage.scene.clone().into())?;
        stage.changed = Instant::now();
        Ok(())
    }

    /// The size that the film should get, if it has another.
    fn size(&self, stage: &Stage) -> Option<(u32, u32)> {
        let now = stage.frames.size();
        let wanted = if stage.changed.elapsed() >= REST {
            self.window
        } else if stage.frames.spp() == 0 {
            self.resolution.clone().moving_size(self.window)
        } else {
            now
        };
        (wanted != now).then_some(wanted)
    }

    /// One picture, or as much of it as the time allows, top to bottom.
    fn render(&mut self) {
        let still = self.stage.as_ref().is_some_and(|stage| stage.changed.elapsed() >= REST);
        let size = self.stage.as_ref().and_then(|stage| self.size(stage));
        let aovs = self.needs_aovs();
        // Keeps the scale that it has decided on.
        self.resolution.moving_size(self.window);
        let Some(stage) = &mut self.stage else { return };
        if let Some((width, height)) = size
            && let Err(error) = stage.frames.set_film(width, height, aovs)
        {
            (self.tell)(Report::Trouble(error.to_string()));
            self.paused = true;
            return;
        }

        let start = Instant::now();
        let (width, height) = stage.frames.size();
        let pixels = u64::from(width) * u64::from(height);
        let count = self.resolution.frames_in_budget(pixels);
        for _ in 0..count {
            if still {
                if !stage.frames.render_frame_unless(&self.stop) {
                    return;
                }
            } else {
                stage.frames.render_frame();
            }
        }
        stage.frames.wait();
        let error = stage.frames.error();
        if let Some(RenderError::Scene(text)) = error {
            // Beginning anew would not mend the file: told once, and shown without what is missing.
            if !std::mem::replace(&mut stage.incomplete, true) {
                (self.tell)(Report::Trouble(text));
            }
        } else if let Some(error) = error {
            self.device.give_up(&error.to_string(), &self.tell);
            if let Err(error) = self.begin_anew() {
                (self.tell)(Report::Trouble(format!("{error:#}")));
            }
            return;
        }
        let seconds = start.elapsed().as_secs_f64();
        stage.seconds = seconds;
        let learn_s = stage.frames.sampler_stats().map_or(0.0, |sampler| sampler.learn_s);
        stage.learned = [learn_s, learn_s - stage.learned[0]];

        // Making a picture of what was rendered is to take a third of the time at most.
        let between = BETWEEN_REFINEMENTS.max(stage.showing * 2);
        let due = stage.published.is_none_or(|at| at.elapsed() >= between);
        if due || !still || stage.frames.spp() <= 2 {
            self.publish();
        }
        // What is done to the picture for the eyes counts while it moves: then it is done for every frame.
        let seconds = if still { seconds } else { start.elapsed().as_secs_f64() };
        self.resolution.measured(pixels * u64::from(count), seconds * 1e3);
        self.tell_importance();
    }

    /// Hands the picture over.
    fn publish(&mut self) {
        let start = Instant::now();
        let Some(stage) = &mut self.stage else { return };
        let film = stage.frames.film();
        let (width, height) = (film.width(), film.height());
        let still = (width, height) == self.window && stage.changed.elapsed() >= REST;
        let learn_ms = stage.learned[1] * 1e3;
        let mut stages = Stages {
            trace_ms: stage.seconds * 1e3 - learn_ms,
            learn_ms,
            ..Stages::default()
        };
        let shown = if self.view == View::Image && self.denoise && film.spp() < CLEAN_SPP {
            let cleaned = self.cleaner.clean(film, &stage.camera);
            (stages.history_ms, stages.denoise_ms) = (cleaned.history_ms, cleaned.filter_ms);
            Shown::image(&cleaned.pixels)
        } else {
            self.view.of(stage.frames.as_ref())
        };
        let stats = stage.frames.stats();
        let rays = stats.rays_nearest + stats.rays_occluded;
        let sampler = stats.sampler.unwrap_or_default();
        let picture = Picture {
            width,
            height,
            exposure: (self.view == View::Image).then(|| exposure_of(&shown.texels, width, height)),
            shown,
            figures: Figures {
                spp: film.spp(),
                still,
                view: self.view,
                on_gpu: self.device.renders(),
                size: (width, height),
                frame_ms: stage.seconds * 1e3,
                stages,
                rays_per_s: (rays - stage.rays) as f64
                    / stage.published.map_or(stage.seconds, |at| at.elapsed().as_secs_f64()),
                cells: sampler.cells,
                sampler_bytes: sampler.bytes,
                input: stage.input.take(),
            },
        };
        stage.rays = rays;
        stage.published = Some(Instant::now());
        stage.showing = start.elapsed();
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner) = Some(picture);
        (self.tell)(Report::Picture);
    }

    /// Tells how probable each light is now, if anybody wants to know.
    fn tell_importance(&mut self) {
        /// Rays through the picture, each way: more points are a better mean, fewer are sooner done.
        const GRID: u32 = 16;
        /// With very many lights fewer points are looked at.
        const MOST_QUERIES: usize = 4_000_000;
        let Some(stage) = &mut self.stage else { return };
        if !self.wants_importance
            || stage
                .importance_told
                .is_some_and(|at| at.elapsed() < BETWEEN_IMPORTANCES)
        {
            return;
        }
        let rays = stage.camera.rays(self.window.0, self.window.1);
        let window = Vec2::new(self.window.0 as f32, self.window.1 as f32);
        let centers = (0..GRID * GRID).map(|i| (Vec2::new((i % GRID) as f32, (i / GRID) as f32) + 0.5) / GRID as f32);
        let points = centers.filter_map(|share| {
            let ray = Ray {
                origin_ws: rays.origin_ws,
                direction_ws: rays.direction_ws(share * window),
                t_max: f32::INFINITY,
            };
            let hit = stage.scene.nearest(&ray, PrimitiveId::NONE)?;
            Some(shading_point(&stage.scene, &ray, &hit))
        });
        let points: Vec<ShadingPoint> = points.collect();
        let most = (MOST_QUERIES / stage.scene.lights.len().max(1)).max(1);
        let step = points.len().div_ceil(most).max(1);
        let points: Vec<ShadingPoint> = points.into_iter().step_by(step).collect();
        let importance = stage.frames.light_probabilities(&points);
        stage.importance_told = Some(Instant::now());
        (self.tell)(Report::Importance(importance));
    }

    fn save_exr(&self, path: &std::path::Path) -> anyhow::Result<()> {
        let Some(stage) = &self.stage else {
            anyhow::bail!("there is no picture yet")
        };
        let film = stage.frames.film();
        let mut channels = Channel::rgb("", &film.image()).to_vec();
        channels.push(Channel {
            name: "variance.V".into(),
            values: film.variance(),
        });
        let settings = Settings {
            width: film.width(),
            height: film.height(),
            ..self.settings.clone()
        };
        let pose = stage.camera.world_from_camera;
        let entry = |name: &str, value: String| (format!("manylight.{name}"), value);
        let metadata = [
            entry("version", machine::VERSION.into()),
            entry("scene", stage.scene.parts.name.clone()),
            entry("sampler", settings.method.name().into()),
            entry("spp", film.spp().to_string()),
            entry("world_from_camera", format!("{:?}", pose.to_cols_array())),
            entry("fov_y", stage.camera.fov_y.to_string()),
            entry("settings", serde_json::to_string(&settings)?),
        ];
        image::write_exr(path, film.width(), film.height(), &channels, &metadata)?;
        Ok(())
    }
}

/// The point that `hit` shades.
pub(super) fn shading_point(scene: &Scene, ray: &Ray, hit: &scene::Hit) -> ShadingPoint {
    let surface = scene.surface(ray, hit);
    ShadingPoint {
        position_ws: surface.position_ws,
        normal_ws: surface.bsdf.normal_ws,
        primary: true,
    }
}

/// The exposure that suits a picture: by the means of blocks, so that noise of single pixels does not count.
fn exposure_of(texels: &[[f32; 4]], width: u32, height: u32) -> f32 {
    const BLOCKS: u32 = 24;
    let (columns, rows) = (BLOCKS.min(width), BLOCKS.min(height));
    let block = |column: u32, row: u32| {
        let mut sum = Vec3::ZERO;
        let mut count = 0.0;
        for y in row * height / rows..(row + 1) * height / rows {
            for x in column * width / columns..(column + 1) * width / columns {
                let [r, g, b, _] = texels[(y * width + x) as usize];
                sum += Vec3::new(r, g, b);
                count += 1.0;
            }
        }
        (sum / count).to_array()
    };
    image::auto_exposure(&Image {
        width: columns,
        height: rows,
        pixels: (0..rows * columns).map(|i| block(i % columns, i / columns)).collect(),
    })
}

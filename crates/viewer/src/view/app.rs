//! The window's state, and its frame from top to bottom.

mod act;
mod opening;

use super::ViewArgs;
use super::camera_control::FlyCamera;
use super::display::{Display, Panels};
use super::drive::Driver;
use super::frame_times::FrameTimes;
use super::inspector::Inspection;
use super::lamps::{self, Lamp};
use super::panels::{self, PanelState};
use super::renderer::{Command, Figures, Renderer, Report};
use super::script::Script;
use super::settings_file::Remembered;
use super::views::View;
use crate::cli::Backend;
use crate::exit::Status;
use crate::{message, session};
use anyhow::{Result, anyhow};
use glam::Vec3;
use render::Settings;
use scene::{Camera, Scene};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::Window;

/// Seconds in which automatic exposure comes about two thirds of the way.
const ADAPTATION_S: f32 = 0.25;
/// A message is shown for so long.
const MESSAGE_TIME: Duration = Duration::from_secs(6);

/// What other threads tell the window.
#[derive(Debug)]
pub(super) enum Event {
    Renderer(Report),
    /// A scene was loaded, or why not, in words.
    Loaded(String, Box<Result<Scene, String>>),
}

/// A scene in the window.
pub(super) struct Stage {
    /// What was asked for: path or `demo:...`.
    pub(super) what: String,
    pub(super) scene: Arc<Scene>,
    pub(super) home: Camera,
    pub(super) lamps: Vec<Lamp>,
    pub(super) selected: Option<usize>,
}

/// How bright the picture is shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exposure {
    /// Stops that are used now.
    pub(super) now: f32,
    /// What suits the picture; `None` before the first.
    pub(super) fitting: Option<f32>,
    /// What the user adds.
    pub(super) offset: f32,
    /// Follows what suits.
    pub(super) automatic: bool,
}

/// The window.
pub(super) struct App {
    pub(super) window: Option<Arc<Window>>,
    pub(super) display: Option<Display>,
    /// The device that draws was lost, and another took its place.
    replaced: bool,
    pub(super) egui: egui::Context,
    pub(super) egui_input: Option<egui_winit::State>,
    proxy: EventLoopProxy<Event>,
    pub(super) renderer: Renderer,
    pub(super) settings: Settings,
    /// What renders.
    pub(super) backend: Backend,
    pub(super) budget_ms: f64,
    wanted_camera: Option<String>,
    window_size: (u32, u32),
    /// Size of the drawable surface in pixels; 0 while minimised.
    pub(super) size: (u32, u32),
    pub(super) stage: Option<Stage>,
    pub(super) loading: Option<(String, Instant)>,
    pub(super) fly: FlyCamera,
    /// Since when the camera differs from what the renderer was told.
    pub(super) unseen_input: Option<Instant>,
    pub(super) view: View,
    pub(super) legend: String,
    pub(super) exposure: Exposure,
    pub(super) figures: Figures,
    pub(super) times: FrameTimes,
    pub(super) inspection: Option<Inspection>,
    pub(super) panels: PanelState,
    pub(super) messages: Vec<(Instant, String)>,
    pub(super) paused: bool,
    /// The noise is taken away, for the eyes only.
    pub(super) denoise: bool,
    pub(super) driver: Driver,
    pub(super) bookmarks: BTreeMap<usize, Camera>,
    /// What is kept for the next run; `None` if nothing is.
    pub(super) remembered: Option<Remembered>,
    pub(super) looking: bool,
    pub(super) pointer: Option<egui::Pos2>,
    pub(super) modifiers: winit::keyboard::ModifiersState,
    capture_to: Vec<PathBuf>,
    /// Files that the renderer is writing.
    pub(super) being_written: usize,
    idle: bool,
    egui_repaint_at: Option<Instant>,
    outcome: Result<Status>,
}

impl App {
    /// Opens nothing yet: the window comes with the event loop.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(super) fn new(
        args: &ViewArgs,
        settings: Settings,
        backend: Backend,
        script: Option<Script>,
        proxy: EventLoopProxy<Event>,
    ) -> Result<Self> {
        let to_window = proxy.clone();
        // If the window has gone nobody wants to know.
        let tell = move |report| drop(to_window.send_event(Event::Renderer(report)));
        let renderer = Renderer::start(settings.clone(), backend, tell)?;
        renderer.send(Command::Budget(args.frame_time));
        let egui = egui::Context::default();
        panels::use_theme(&egui);
        // A script finds the window as at the first run, and leaves no trace.
        let remembered = if script.is_some() {
            None
        } else {
            Some(Remembered::read())
        };
        let Remembered {
            overlay,
            settings: settings_open,
            view,
            ..
        } = remembered.clone().unwrap_or_default();
        renderer.send(Command::Show(view));
        let mut app = Self {
            window: None,
            display: None,
            replaced: false,
            egui,
            egui_input: None,
            proxy,
            renderer,
            settings,
            backend,
            budget_ms: args.frame_time,
            wanted_camera: args.light.camera.clone(),
            window_size: (args.width, args.height),
            size: (0, 0),
            stage: None,
            loading: None,
            fly: FlyCamera::new(&Camera::look_at("none", Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0), 1.0),
            unseen_input: None,
            view,
            legend: String::new(),
            exposure: Exposure {
                now: 0.0,
                fitting: None,
                offset: 0.0,
                automatic: true,
            },
            figures: Figures::default(),
            times: FrameTimes::default(),
            inspection: None,
            panels: PanelState {
                overlay,
                settings: settings_open,
                ..PanelState::default()
            },
            messages: Vec::new(),
            paused: false,
            denoise: true,
            driver: Driver::new(script),
            bookmarks: BTreeMap::new(),
            remembered,
            looking: false,
            pointer: None,
            modifiers: Default::default(),
            capture_to: Vec::new(),
            being_written: 0,
            idle: true,
            egui_repaint_at: None,
            outcome: Ok(Status::Done),
        };
        match &args.scene {
            Some(what) => app.open(what.clone()),
            None => app.panels.open_dialog = true,
        }
        Ok(app)
    }

    /// How it ended; what is to be remembered is written.
    pub(super) fn outcome(mut self) -> Result<Status> {
        self.remember();
        self.outcome
    }

    /// Ends with an error.
    pub(super) fn fail(&mut self, event_loop: &ActiveEventLoop, error: anyhow::Error) {
        self.outcome = Err(error);
        event_loop.exit();
    }

    /// The window has another size; nothing is drawn while it has none.
    pub(super) fn resize(&mut self, width: u32, height: u32) {
        self.size = (width, height);
        if let Some(display) = &mut self.display {
            display.resize(width, height);
        }
        self.renderer.send(Command::Resize(width, height));
        self.request_frame();
    }

    pub(super) fn request_frame(&self) {
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }

    /// A message for people; it goes away by itself.
    pub(super) fn say(&mut self, text: impl Into<String>) {
        // Nobody looks on, and what a script captures is not to have traces of what it captured before.
        if self.driver.scripted {
            return message::note(text.into());
        }
        self.messages.push((Instant::now(), text.into()));
    }

    /// One frame of the window, from top to bottom.
    pub(super) fn frame(&mut self, event_loop: &ActiveEventLoop) {
        let seconds = self.times.begin(self.idle);
        self.drive(event_loop);
        self.take_picture();
        self.walk(seconds);
        self.expose(seconds);
        self.messages.retain(|(at, _)| at.elapsed() < MESSAGE_TIME);
        let Some(panels) = self.run_panels(event_loop) else {
            return;
        };
        self.draw(&panels);
        self.go_on(event_loop);
    }

    /// Takes the renderer's newest picture.
    fn take_picture(&mut self) {
        let Some(picture) = self.renderer.take_picture() else {
            return;
        };
        let start = Instant::now();
        if let Some(display) = &mut self.display
            && !display.show(&picture)
        {
            self.say("the picture is larger than the GPU's textures; make the window smaller");
        }
        self.legend.clone_from(&picture.shown.legend);
        self.figures = picture.figures;
        self.figures.stages.upload_ms = start.elapsed().as_secs_f64() * 1e3;
        self.times.render.push(picture.figures.frame_ms);
        if picture.exposure.is_some() {
            self.exposure.fitting = picture.exposure;
        }
    }

    /// Moves the camera, and tells the renderer.
    fn walk(&mut self, seconds: f32) {
        if let Some(camera) = self.driver.path_camera() {
            self.fly.jump(&camera);
            self.unseen_input.get_or_insert_with(Instant::now);
        }
        if self.fly.advance(seconds) {
            self.unseen_input.get_or_insert_with(Instant::now);
        }
        if let Some(since) = self.unseen_input.take() {
            self.renderer.send(Command::Look(self.fly.camera().clone(), since));
        }
        self.driver.record(self.fly.camera());
    }

    /// Brings the exposure nearer to where it should be.
    fn expose(&mut self, seconds: f32) {
        let Exposure {
            now,
            fitting,
            offset,
            automatic,
        } = &mut self.exposure;
        let (Some(fitting), true) = (*fitting, *automatic) else {
            return;
        };
        let target = fitting + *offset;
        // The first picture is shown as it should be at once.
        let share = if self.times.render.values().len() <= 1 {
            1.0
        } else {
            1.0 - (-seconds / ADAPTATION_S).exp()
        };
        *now += (target - *now) * share;
        if (target - *now).abs() < 0.01 {
            *now = target;
        }
    }

    /// Whether the exposure is still on its way.
    fn is_adapting(&self) -> bool {
        let Exposure {
            now,
            fitting,
            offset,
            automatic,
        } = self.exposure;
        automatic && fitting.is_some_and(|fitting| fitting + offset != now)
    }

    /// Lays out the panels, and does what they ask for.
    fn run_panels(&mut self, event_loop: &ActiveEventLoop) -> Option<Panels> {
        let (window, input) = (self.window.clone()?, self.egui_input.as_mut()?);
        let raw = self.driver.add_events(input.take_egui_input(&window));
        let egui = self.egui.clone();
        let mut actions = Vec::new();
        let output = egui.run_ui(raw, |ui| panels::show(ui, self, &mut actions));
        if let Some(input) = &mut self.egui_input {
            input.handle_platform_output(&window, output.platform_output);
        }
        let root = output.viewport_output.get(&egui::ViewportId::ROOT);
        let delay = root.map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        self.egui_repaint_at = Instant::now().checked_add(delay.max(Duration::from_millis(1)));
        if delay > Duration::from_secs(3600) {
            self.egui_repaint_at = None;
        }
        for action in actions {
            self.act(event_loop, action);
        }
        Some(Panels {
            shapes: egui.tessellate(output.shapes, output.pixels_per_point),
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
        })
    }

    /// Draws picture and panels, and writes what was to be captured.
    fn draw(&mut self, panels: &Panels) {
        let Some(display) = &mut self.display else { return };
        let capture = display.draw(panels, self.exposure.now, !self.capture_to.is_empty());
        if let Some(since) = self.figures.input.take() {
            self.times.latency.push(since.elapsed().as_secs_f64() * 1e3);
        }
        let Some(capture) = capture else { return };
        for path in std::mem::take(&mut self.capture_to) {
            let written = capture.write(&path);
            self.say(match written {
                Ok(()) => format!("{} written", path.display()),
                Err(error) => format!("{error:#}"),
            });
        }
    }

    /// Whether a frame is due because the time has come.
    pub(super) fn wakes_now(&self) -> bool {
        self.egui_repaint_at.is_some_and(|at| at <= Instant::now())
    }

    /// Decides when the next frame comes.
    fn go_on(&mut self, event_loop: &ActiveEventLoop) {
        if self.display.as_ref().is_some_and(Display::is_lost)
            && let Err(error) = self.replace_display(event_loop)
        {
            return self.fail(event_loop, error);
        }
        let busy = self.fly.is_flying() || self.driver.is_busy() || self.is_adapting();
        self.idle = !busy;
        let message = self.messages.iter().map(|(at, _)| *at + MESSAGE_TIME).min();
        event_loop.set_control_flow(match (busy, self.egui_repaint_at.into_iter().chain(message).min()) {
            (true, _) => winit::event_loop::ControlFlow::Poll,
            (false, Some(at)) => winit::event_loop::ControlFlow::WaitUntil(at),
            (false, None) => winit::event_loop::ControlFlow::Wait,
        });
        if busy {
            self.request_frame();
        }
    }

    /// What a thread tells.
    pub(super) fn hear(&mut self, event_loop: &ActiveEventLoop, event: Event) {
        match event {
            Event::Renderer(Report::Picture) => {}
            Event::Renderer(Report::Inspected(found)) => self.inspection = found.map(|found| *found),
            Event::Renderer(Report::Importance(probabilities)) => {
                if let Some(stage) = &mut self.stage {
                    lamps::set_importance(&mut stage.lamps, &probabilities);
                }
            }
            Event::Renderer(Report::Saved(result)) => {
                self.being_written = self.being_written.saturating_sub(1);
                self.say(result.map_or_else(|text| text, |path| format!("{} written", path.display())));
            }
            Event::Renderer(Report::Trouble(text)) => self.say(text),
            Event::Renderer(Report::Device(backend)) => self.backend = backend,
            Event::Renderer(Report::Failed) => {
                self.fail(
                    event_loop,
                    anyhow!("the renderer has failed, which is a defect of this program"),
                );
            }
            Event::Loaded(what, result) => self.enter(what, *result),
        }
        self.request_frame();
    }

    /// Begins to load a scene; the one that is there stays until then.
    pub(super) fn open(&mut self, what: String) {
        self.loading = Some((what.clone(), Instant::now()));
        let proxy = self.proxy.clone();
        let load = move || {
            let scene = session::load(&what).map(|loaded| loaded.scene);
            let event = Event::Loaded(what, Box::new(scene.map_err(|error| format!("{error:#}"))));
            let _ = proxy.send_event(event);
        };
        if let Err(error) = std::thread::Builder::new().name("loader".into()).spawn(load) {
            self.loading = None;
            self.say(format!("the scene cannot be loaded: {error}"));
        }
    }

    /// A scene is there, or cannot be had.
    fn enter(&mut self, what: String, result: Result<Scene, String>) {
        // An older request that ends late.
        if self.loading.as_ref().is_none_or(|(wanted, _)| *wanted != what) {
            return;
        }
        self.loading = None;
        let same = self.stage.as_ref().is_some_and(|stage| stage.what == what);
        let wanted = self.wanted_camera.take();
        let scene = result.and_then(|scene| {
            let camera = session::camera(&scene, wanted.as_deref())
                .map_err(|error| format!("{error:#}"))?
                .clone();
            Ok((scene, camera))
        });
        let (scene, home) = match scene {
            Ok(found) => found,
            Err(text) => {
                self.panels.error = Some(text);
                return;
            }
        };
        let scene = Arc::new(scene);
        // A scene that is read again is seen from where one was.
        if !same {
            self.fly = FlyCamera::new(&home, scene.radius);
            self.exposure.fitting = None;
            self.exposure.automatic = true;
        }
        self.inspection = None;
        self.recall_scene(&what);
        for warning in scene.parts.report.warnings.iter().take(3) {
            self.say(warning.clone());
        }
        if scene.lights.is_empty() {
            self.say("the scene has no lights: the picture is black");
        }
        self.renderer
            .send(Command::Scene(scene.clone(), self.fly.camera().clone()));
        if let Some(window) = &self.window {
            window.set_title(&format!("{} - manylight", scene.parts.name));
        }
        self.stage = Some(Stage {
            lamps: lamps::lamps(&scene),
            what,
            scene,
            home,
            selected: None,
        });
    }
}

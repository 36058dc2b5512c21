//! Hands that are not there: scripts, and cameras that follow a recorded path.

use super::actions::{Action, KEY_NAMES, Part, With, action_of};
use super::app::App;
use super::frame_times::Summary;
use super::renderer::{Command, Stages};
use super::script::{Script, Step, Which};
use super::views::View;
use crate::output;
use glam::{Vec2, Vec3};
use render::Method;
use sampling::hash::hash3;
use scene::Camera;
use serde::Serialize;
use std::path::Path;
use std::time::Instant;
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::KeyCode;

/// Random inputs that come with one frame.
const INPUTS_PER_FRAME: u32 = 25;

/// What acts instead of the user.
#[derive(Debug, Default)]
pub(super) struct Driver {
    script: Option<Script>,
    /// Driven by a script, from beginning to end.
    pub(super) scripted: bool,
    /// The script waits for a picture: no need to hurry.
    waits: bool,
    /// Keys that the script holds, with the frames that are left.
    held: Vec<(KeyCode, With, u64)>,
    /// Pointer events for the panels.
    events: Vec<egui::Event>,
    /// Random inputs done, of the step that is at work.
    random_done: u32,
    pub(super) recording: Option<Vec<Camera>>,
    pub(super) path: Vec<Camera>,
    pub(super) playing: Option<usize>,
}

/// What `report` writes.
#[derive(Debug, Serialize)]
struct Report {
    width: u32,
    height: u32,
    adapter: String,
    /// Stops.
    exposure: f32,
    spp: u64,
    /// What rendered the newest picture: "cpu" or "gpu".
    rendered_on: &'static str,
    window_frame_ms: Option<Summary>,
    render_frame_ms: Option<Summary>,
    input_to_picture_ms: Option<Summary>,
    /// Of the newest picture.
    stages: Stages,
    /// Read back from the device since the picture before.
    bytes_read: u64,
}

impl Driver {
    pub(super) fn new(script: Option<Script>) -> Self {
        Self {
            scripted: script.is_some(),
            script,
            ..Self::default()
        }
    }

    /// Whether frames are needed to go on.
    pub(super) fn is_busy(&self) -> bool {
        (self.script.is_some() && !self.waits) || self.playing.is_some() || self.recording.is_some()
    }

    /// Adds what the script does with the pointer.
    pub(super) fn add_events(&mut self, mut input: egui::RawInput) -> egui::RawInput {
        input.events.append(&mut self.events);
        input
    }

    /// The next camera of the path that is played, if one is.
    pub(super) fn path_camera(&mut self) -> Option<Camera> {
        let at = self.playing?;
        let camera = self.path.get(at).cloned();
        self.playing = camera.as_ref().map(|_| at + 1);
        camera
    }

    /// Keeps the camera of this frame, if a path is recorded.
    pub(super) fn record(&mut self, camera: &Camera) {
        if let Some(path) = &mut self.recording {
            path.push(camera.clone());
        }
    }
}

impl App {
    /// Does what the script has for this frame.
    pub(super) fn drive(&mut self, event_loop: &ActiveEventLoop) {
        let Some(mut script) = self.driver.script.take() else {
            return;
        };
        // The script begins with the first picture, and waits for each that is loading.
        let ready = self.loading.is_none() && (self.figures.spp > 0 || self.stage.is_none());
        if !ready {
            self.driver.script = Some(script);
            self.driver.waits = true;
            return;
        }
        let mut waits = false;
        self.driver.waits = false;
        while let Some(step) = script.due() {
            if !self.perform(event_loop, &step) {
                self.driver.waits = matches!(step, Step::Settle(_));
                script.wait_for(step);
                waits = true;
                break;
            }
        }
        let goes_on = waits || script.advance();
        self.release_keys(event_loop);
        if goes_on || !self.driver.held.is_empty() || self.is_capturing() {
            self.driver.script = Some(script);
        }
    }

    /// Does one step; false if it has to go on in the next frame.
    fn perform(&mut self, event_loop: &ActiveEventLoop, step: &Step) -> bool {
        // A file is complete before anything else happens.
        if self.being_written > 0 {
            return false;
        }
        match step {
            Step::Camera(eye, target) => {
                let fov_y = self.fly.camera().fov_y;
                self.jump(&Camera::look_at("script", *eye, *target, Vec3::Y, fov_y));
            }
            Step::Key { key, with, frames } => {
                self.press(event_loop, *key, *with, true);
                self.driver.held.push((*key, *with, *frames));
            }
            Step::Look(pixels) => self.act(event_loop, Action::Look(*pixels)),
            Step::Wheel(notches) => self.act(event_loop, Action::Speed(*notches)),
            Step::Click(at) => self.act(event_loop, Action::Inspect(*at)),
            Step::Show(view) => self.act(event_loop, Action::Show(*view)),
            Step::Sample(method) => self.act(event_loop, Action::Sample(*method)),
            Step::Resize(width, height) => {
                let size = winit::dpi::PhysicalSize::new(*width, *height);
                if let Some(window) = &self.window
                    && *width > 0
                    && *height > 0
                {
                    let _ = window.request_inner_size(size);
                } else {
                    self.resize(*width, *height);
                }
            }
            Step::Open(what) => self.act(event_loop, Action::Open(what.clone())),
            Step::Settle(spp) => {
                let figures = self.figures;
                let settled = figures.still && figures.spp >= *spp && self.size == figures.size;
                return (settled && self.renderer.is_newest(&figures)) || self.panels.error.is_some();
            }
            Step::Random { count, seed } => {
                let first = self.driver.random_done;
                let last = count.min(&(first + INPUTS_PER_FRAME)).to_owned();
                (first..last).for_each(|i| self.random_input(event_loop, hash3(*seed, i, 0), hash3(*seed, i, 1)));
                self.driver.random_done = if last == *count { 0 } else { last };
                return last == *count;
            }
            Step::Screenshot(path) => self.save(path),
            Step::Report(path) => {
                if let Err(error) = self.write_report(path) {
                    self.fail(event_loop, error);
                }
            }
            Step::Render(backend) => self.act(event_loop, Action::Device(*backend)),
            Step::LoseDevice(Which::Window) => {
                if let Some(display) = &self.display {
                    display.lose();
                }
            }
            Step::LoseDevice(Which::Renderer) => {
                self.renderer.send(Command::LoseDevice);
            }
            Step::Quit => {
                // What was asked for is written first.
                if self.is_capturing() {
                    return false;
                }
                event_loop.exit();
            }
        }
        true
    }

    fn press(&mut self, event_loop: &ActiveEventLoop, key: KeyCode, with: With, down: bool) {
        if let Some(action) = action_of(key, with, down) {
            if matches!(action, Action::Fly(..)) {
                self.unseen_input.get_or_insert_with(Instant::now);
            }
            self.act(event_loop, action);
        }
    }

    /// Lets go of the keys whose time is over.
    fn release_keys(&mut self, event_loop: &ActiveEventLoop) {
        let held = std::mem::take(&mut self.driver.held);
        for (key, with, frames) in held {
            if frames == 0 {
                self.press(event_loop, key, with, false);
            } else {
                self.driver.held.push((key, with, frames - 1));
            }
        }
    }

    /// Something that a user might do, or a cat. Files are not written, and the window is not closed.
    fn random_input(&mut self, event_loop: &ActiveEventLoop, what: u32, how: u32) {
        let share = |bits: u32| (bits & 0xffff) as f32 / 65_536.0;
        let (x, y) = (share(how), share(how >> 16));
        match what % 100 {
            0..40 => {
                let (_, key) = KEY_NAMES[how as usize % KEY_NAMES.len()];
                let with = [With::Nothing, With::Nothing, With::Alt][how as usize / 64 % 3];
                let writes = [KeyCode::F12, KeyCode::KeyK, KeyCode::F11];
                if !writes.contains(&key) && (key != KeyCode::F5 || (what / 100).is_multiple_of(8)) {
                    self.press(event_loop, key, with, (what / 800).is_multiple_of(2));
                }
            }
            40..55 => self.act(event_loop, Action::Look(Vec2::new(x - 0.5, y - 0.5) * 300.0)),
            55..60 => self.act(event_loop, Action::Speed(x * 20.0 - 10.0)),
            60..82 => {
                let size = self.egui.content_rect().size();
                let pos = egui::pos2(x * size.x, y * size.y);
                let pressed = (what / 100).is_multiple_of(2);
                self.driver.events.push(egui::Event::PointerMoved(pos));
                self.driver.events.push(egui::Event::PointerButton {
                    pos,
                    button: egui::PointerButton::Primary,
                    pressed,
                    modifiers: egui::Modifiers::default(),
                });
            }
            82..88 => self.act(event_loop, Action::Inspect(Vec2::new(x, y))),
            88..90 => {
                let size = [(0, 0), (1, 1), (64, 900), (320, 240), (0, 300), (641, 359)][how as usize % 6];
                self.resize(size.0, size.1);
            }
            90..93 => self.act(event_loop, Action::Show(View::ALL[how as usize % View::ALL.len()])),
            93..94 => {
                let all: Vec<Method> = Method::all().collect();
                self.act(event_loop, Action::Sample(all[how as usize % all.len()]));
            }
            94..97 => {
                let lamps = self.stage.as_ref().map_or(0, |stage| stage.lamps.len()).max(1);
                let factor = if (what / 100).is_multiple_of(2) {
                    Vec3::ZERO
                } else {
                    Vec3::new(x, y, 1.0) * 3.0
                };
                self.act(event_loop, Action::Select(Some(how as usize % lamps)));
                self.act(event_loop, Action::Relight(how as usize % lamps, factor));
            }
            97 => self.act(
                event_loop,
                Action::Toggle([Part::Help, Part::Lights, Part::Settings][how as usize % 3]),
            ),
            98 => self.act(event_loop, Action::Budget(f64::from(1.0 + x * 60.0))),
            _ => self.fly.release_all(),
        }
    }

    fn write_report(&self, path: &Path) -> anyhow::Result<()> {
        let report = Report {
            width: self.size.0,
            height: self.size.1,
            adapter: self
                .display
                .as_ref()
                .map(|display| display.adapter().to_owned())
                .unwrap_or_default(),
            exposure: self.exposure.now,
            spp: self.figures.spp,
            rendered_on: if self.figures.on_gpu { "gpu" } else { "cpu" },
            window_frame_ms: self.times.window.summary(),
            render_frame_ms: self.times.render.summary(),
            input_to_picture_ms: self.times.latency.summary(),
            stages: self.figures.stages,
            bytes_read: self.figures.bytes_read,
        };
        output::write(path, (serde_json::to_string_pretty(&report)? + "\n").as_bytes())
    }
}

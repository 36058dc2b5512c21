//! What the window does when it is asked to, by a key, a panel or a script.

use super::App;
use crate::view::actions::{Action, Part};
use crate::view::lamps::{self, Lamp};
use crate::view::renderer::Command;
use glam::Vec3;
use render::{Method, Settings};
use scene::Camera;
use std::path::{Path, PathBuf};
use std::time::Instant;
use winit::event_loop::ActiveEventLoop;
use winit::window::Fullscreen;

impl App {
    /// Does it.
    pub(in crate::view) fn act(&mut self, event_loop: &ActiveEventLoop, action: Action) {
        match action {
            Action::Fly(motion, down) => self.fly.hold(motion, down),
            Action::Look(pixels) => {
                self.fly.look(pixels, self.size.1 as f32);
                self.unseen_input.get_or_insert_with(Instant::now);
            }
            Action::Speed(notches) => self.fly.change_speed(notches),
            Action::Home => {
                if let Some(stage) = &self.stage {
                    let home = stage.home.clone();
                    self.jump(&home);
                }
            }
            Action::Toggle(part) => self.toggle(part),
            Action::Close => self.close_top(),
            Action::Show(view) => {
                self.view = view;
                self.renderer.send(Command::Show(view));
            }
            Action::Sample(method) => self.change(|settings| settings.method = method),
            Action::NextSampler => {
                let all: Vec<Method> = Method::all().collect();
                let now = all
                    .iter()
                    .position(|&method| method == self.settings.method)
                    .unwrap_or(0);
                let next = all[(now + 1) % all.len()];
                self.change(|settings| settings.method = next);
                self.say(format!("sampler: {}", next.name()));
            }
            Action::Device(backend) => {
                self.backend = backend;
                self.renderer.send(Command::Device(backend));
            }
            Action::Bounces(bounces) => self.change(|settings| settings.max_bounces = bounces),
            Action::LightSamples(samples) => self.change(|settings| settings.light_samples = samples),
            Action::Budget(milliseconds) => {
                self.budget_ms = milliseconds;
                self.renderer.send(Command::Budget(milliseconds));
            }
            Action::Expose(stops) => {
                self.exposure.offset = (self.exposure.offset + stops).clamp(-20.0, 20.0);
                if !self.exposure.automatic {
                    self.exposure.now += stops;
                }
            }
            Action::Denoise => {
                self.denoise = !self.denoise;
                self.renderer.send(Command::Denoise(self.denoise));
            }
            Action::AutoExposure => {
                self.exposure.automatic = !self.exposure.automatic;
                self.exposure.offset = 0.0;
            }
            Action::Pause => {
                self.paused = !self.paused;
                self.renderer.send(Command::Pause(self.paused));
            }
            Action::Inspect(at) => {
                self.renderer.send(Command::Inspect(at));
            }
            Action::Select(lamp) => {
                if let Some(stage) = &mut self.stage {
                    stage.selected = lamp.filter(|&lamp| lamp < stage.lamps.len());
                }
            }
            Action::Relight(lamp, factor) => self.relight(|lamps| {
                if let Some(lamp) = lamps.get_mut(lamp) {
                    lamp.factor = factor;
                }
            }),
            Action::RelightAll => self.relight(|lamps| lamps.iter_mut().for_each(|lamp| lamp.factor = Vec3::ONE)),
            Action::Store(number) => self.store_bookmark(number),
            Action::Recall(number) => self.recall_bookmark(number),
            Action::Record => self.toggle_record(),
            Action::Play => self.toggle_play(),
            Action::CopyCamera => self.copy_camera(),
            Action::Open(what) => self.open(what),
            Action::Reload => {
                if let Some(stage) = &self.stage {
                    self.open(stage.what.clone());
                }
            }
            Action::Screenshot => self.screenshot(),
            Action::Fullscreen => {
                if let Some(window) = &self.window {
                    let now = window.fullscreen();
                    window.set_fullscreen(now.is_none().then_some(Fullscreen::Borderless(None)));
                }
            }
            Action::Quit => event_loop.exit(),
        }
        self.request_frame();
    }

    /// Looks from elsewhere at once.
    pub(in crate::view) fn jump(&mut self, camera: &Camera) {
        self.fly.jump(camera);
        self.unseen_input.get_or_insert_with(Instant::now);
    }

    fn change(&mut self, change: impl FnOnce(&mut Settings)) {
        change(&mut self.settings);
        self.renderer.send(Command::Render(Box::new(self.settings.clone())));
    }

    fn relight(&mut self, change: impl FnOnce(&mut [Lamp])) {
        let Some(stage) = &mut self.stage else { return };
        change(&mut stage.lamps);
        self.renderer.send(Command::Relight(lamps::factors(&stage.lamps)));
    }

    fn toggle(&mut self, part: Part) {
        let panels = &mut self.panels;
        match part {
            Part::Help => panels.help = !panels.help,
            Part::Settings => panels.settings = !panels.settings,
            Part::Lights => panels.lights = !panels.lights,
            Part::Overlay => panels.overlay = !panels.overlay,
            Part::OpenDialog => panels.open_dialog = !panels.open_dialog,
            Part::All => panels.hidden = !panels.hidden,
        }
        self.renderer.send(Command::Importance(self.panels.lights));
    }

    /// Closes what lies on top.
    fn close_top(&mut self) {
        let panels = &mut self.panels;
        let open = [&mut panels.help, &mut panels.open_dialog, &mut panels.hidden];
        if panels.error.take().is_some() {
            return;
        }
        if let Some(open) = open.into_iter().find(|open| **open) {
            *open = false;
        } else if self.inspection.is_some() {
            self.inspection = None;
        } else if panels.lights {
            panels.lights = false;
            self.renderer.send(Command::Importance(false));
        } else {
            panels.settings = false;
        }
    }

    fn screenshot(&mut self) {
        let Some(stage) = &self.stage else { return };
        let stem = |number: u32| PathBuf::from(format!("manylight-{}-{number:04}", stage.scene.parts.name));
        let free = (1..)
            .map(stem)
            .find(|stem| !stem.with_extension("png").exists() && !stem.with_extension("exr").exists());
        if let Some(stem) = free {
            self.save(&stem.with_extension("png"));
            self.save(&stem.with_extension("exr"));
        }
    }

    /// Writes the window (PNG, with the next frame) or the picture (EXR).
    pub(in crate::view) fn save(&mut self, path: &Path) {
        if path.extension().is_some_and(|extension| extension == "exr") {
            self.being_written += usize::from(self.renderer.send(Command::SaveExr(path.into())));
        } else {
            self.capture_to.push(path.into());
        }
    }

    /// Whether a PNG is still to be written.
    pub(in crate::view) fn is_capturing(&self) -> bool {
        !self.capture_to.is_empty()
    }
}

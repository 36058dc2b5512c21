//! What the thread is told, and what it does then.

use super::stage::Stage;
use super::{Command, Device, Report, Worker, device};
use crate::view::inspector;
use crate::view::views::View;
use std::sync::atomic::Ordering;
use std::sync::mpsc::TryRecvError;
use std::time::Instant;

/// A picture of so many samples per pixel is finished.
const FINISHED_SPP: u64 = 1 << 16;

impl Worker {
    /// Until nobody sends commands any more.
    pub(super) fn run(&mut self) {
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
                        self.received += u64::from(look.is_some());
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
        self.received += u64::from(command.asks_for_picture());
        let outcome = match command {
            Command::Scene(scene, camera) => {
                self.forget();
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
                    self.forget();
                    self.begin_anew()
                }
            }
            Command::Device(backend) => {
                self.device = Device::new(backend);
                self.cleaner.forget();
                self.begin_anew()
            }
            Command::LoseDevice => {
                self.device.lose();
                Ok(())
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

    /// Forgets what earlier pictures knew.
    fn forget(&mut self) {
        self.cleaner.forget();
        self.device.forget();
    }

    /// Whether the film keeps auxiliary images.
    pub(super) fn needs_aovs(&self) -> bool {
        self.view.needs_aovs() || (self.denoise && self.view == View::Image)
    }

    fn show(&mut self, view: View, denoise: bool) -> anyhow::Result<()> {
        let before = self.needs_aovs();
        (self.view, self.denoise) = (view, denoise);
        let now = self.needs_aovs();
        let Some(stage) = &mut self.stage else { return Ok(()) };
        stage.published = None;
        if before != now {
            if self.device.renders() {
                (self.tell)(Report::Trouble(device::COMPILING.into()));
            }
            let (width, height) = stage.frames.size();
            stage.frames.set_film(width, height, now)?;
            stage.changed = Instant::now();
        } else if stage.frames.spp() > 0 && !self.has_work() {
            self.publish();
        }
        Ok(())
    }
}

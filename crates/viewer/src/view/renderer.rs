//! The thread that renders: it owns the rendering, takes commands, and hands finished pictures to the window.
//!
//! While the camera moves, frames are small enough to keep the frame time; once it rests the picture is rendered in full
//! and refined. A command that makes the picture worthless stops a frame in full size at once.

mod commands;
mod device;
mod messages;
mod pace;
mod picture;
mod stage;

pub(super) use messages::{Command, Figures, Picture, Report, Stages};
pub(super) use picture::shading_point;

use super::resolution::Resolution;
use super::views::View;
use crate::cli::Backend;
use device::Device;
use render::Cleaner;
use render::Settings;
use stage::Stage;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// The window's side of the thread.
#[derive(Debug)]
pub(super) struct Renderer {
    commands: Option<Sender<Command>>,
    /// Commands so far that ask for another picture.
    sent: Cell<u64>,
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
            received: 0,
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
        let thread = std::thread::Builder::new().name("renderer".into()).spawn(move || {
            // The message of a panic is on stderr by then.
            if catch_unwind(AssertUnwindSafe(|| worker.run())).is_err() {
                (worker.tell)(Report::Failed);
            }
        })?;
        Ok(Self {
            commands: Some(commands),
            sent: Cell::new(0),
            stop,
            latest,
            thread: Some(thread),
        })
    }

    /// Sends a command; whether anybody listens.
    pub(super) fn send(&self, command: Command) -> bool {
        let urgent = command.is_urgent();
        self.sent.set(self.sent.get() + u64::from(command.asks_for_picture()));
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

    /// Whether a picture of these figures is what was asked for, all commands obeyed.
    pub(super) fn is_newest(&self, figures: &Figures) -> bool {
        figures.commands == self.sent.get()
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
    /// Commands so far that ask for another picture.
    received: u64,
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

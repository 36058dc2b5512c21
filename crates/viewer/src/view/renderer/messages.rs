//! What the window and the thread that renders tell each other.

use crate::cli::Backend;
use crate::view::inspector::Inspection;
use crate::view::views::{Shown, View};
use glam::{Vec2, Vec3};
use render::Settings;
use scene::{Camera, Scene};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// What the window wants.
#[derive(Debug)]
pub(in crate::view) enum Command {
    /// Another scene, seen from there.
    Scene(Arc<Scene>, Camera),
    /// Another camera, because of an input at that time.
    Look(Camera, Instant),
    /// Another size of the window, in pixels.
    Resize(u32, u32),
    /// Something else renders.
    Device(Backend),
    /// The device that renders is taken away, for tests.
    LoseDevice,
    /// Another way of rendering; size and auxiliary images are not looked at.
    Render(Box<Settings>),
    /// Another view.
    Show(View),
    /// Milliseconds for a frame while the picture moves.
    Budget(f64),
    /// Whether noise is taken away, for the eyes only.
    Denoise(bool),
    /// Lights that shine by a factor of what the scene says; all others as it says.
    Relight(Vec<(u32, Vec3)>),
    /// Whether the probabilities of all lights are wanted.
    Importance(bool),
    /// Stops or goes on.
    Pause(bool),
    /// Tells about the pixel at this share of width and height.
    Inspect(Vec2),
    /// Writes the picture as it is, linear.
    SaveExr(PathBuf),
}

impl Command {
    /// Whether the picture is another one, or made anew, when it is obeyed.
    pub(super) fn asks_for_picture(&self) -> bool {
        !matches!(
            self,
            Self::Budget(_)
                | Self::Importance(_)
                | Self::Pause(_)
                | Self::Inspect(_)
                | Self::SaveExr(_)
                | Self::LoseDevice
        )
    }

    /// Whether it is not to wait until a frame in full size has ended.
    pub(super) fn is_urgent(&self) -> bool {
        !matches!(
            self,
            Self::Budget(_) | Self::Importance(_) | Self::SaveExr(_) | Self::LoseDevice
        )
    }
}

/// What the window is told.
#[derive(Debug)]
pub(in crate::view) enum Report {
    /// [`Renderer::take_picture`] has something.
    Picture,
    /// The answer to [`Command::Inspect`]; `None` where there is nothing.
    Inspected(Option<Box<Inspection>>),
    /// The probability of each light, mean over the picture; empty where lights are not chosen.
    Importance(Vec<f64>),
    /// A file was written, or why not.
    Saved(Result<PathBuf, String>),
    /// Something that the user should know.
    Trouble(String),
    /// This renders from now on: what was asked for cannot.
    Device(Backend),
    /// The thread has panicked: there will be no more pictures.
    Failed,
}

/// A picture to be shown.
#[derive(Debug)]
pub(in crate::view) struct Picture {
    pub(in crate::view) width: u32,
    pub(in crate::view) height: u32,
    pub(in crate::view) shown: Shown,
    /// The exposure in stops that suits it; `None` for other views than the image.
    pub(in crate::view) exposure: Option<f32>,
    pub(in crate::view) figures: Figures,
}

/// Figures of a picture.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::view) struct Figures {
    /// Samples per pixel.
    pub(in crate::view) spp: u64,
    /// The camera rests: the picture has its full size.
    pub(in crate::view) still: bool,
    /// Rendered on the GPU.
    pub(in crate::view) on_gpu: bool,
    /// Size in which it was rendered.
    pub(in crate::view) size: (u32, u32),
    /// Milliseconds of rendering per picture.
    pub(in crate::view) frame_ms: f64,
    pub(in crate::view) stages: Stages,
    /// Bytes read back from the device since the picture before.
    pub(in crate::view) bytes_read: u64,
    pub(in crate::view) rays_per_s: f64,
    pub(in crate::view) cells: usize,
    /// Bytes of what the sampler keeps.
    pub(in crate::view) sampler_bytes: usize,
    /// Commands that it obeys, of those that ask for another picture.
    pub(in crate::view) commands: u64,
    /// The first input that it is the first to show.
    pub(in crate::view) input: Option<Instant>,
}

/// Milliseconds of the stages of a picture, in their order.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub(in crate::view) struct Stages {
    /// Tracing and shading paths, choosing lights included.
    pub(in crate::view) trace_ms: f64,
    /// Learning which lights matter.
    pub(in crate::view) learn_ms: f64,
    /// Reading back what a device has accumulated, or the picture that it has made of it.
    pub(in crate::view) read_ms: f64,
    /// Taking over what earlier pictures knew.
    pub(in crate::view) history_ms: f64,
    /// Taking away the noise that is left.
    pub(in crate::view) denoise_ms: f64,
    /// Handing the picture to the graphics driver.
    pub(in crate::view) upload_ms: f64,
}

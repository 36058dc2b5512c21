//! `view`: a window in which people walk through a scene.
//!
//! One thread draws the window and takes input (`app`), one renders (`renderer`); they meet in commands and reports only,
//! so that another back end can take the renderer's place.

mod actions;
mod app;
mod camera_control;
mod display;
mod drive;
mod events;
mod frame_times;
mod inspector;
mod lamps;
mod panels;
mod picture_pass;
mod places;
mod renderer;
mod resolution;
pub(crate) mod script;
pub(crate) mod settings_file;
mod views;

use crate::camera_path;
use crate::cli::{LightArgs, any_method, default_method};
use crate::exit::{Refusal, Status};
use crate::session;
use anyhow::Result;
use app::App;
use clap::Args;
use render::Method;
use script::Script;
use std::path::PathBuf;
use winit::error::EventLoopError;
use winit::event_loop::EventLoop;

/// Options of `view`.
#[derive(Debug, Args)]
#[command(after_help = after_help())]
pub(crate) struct ViewArgs {
    /// A .gltf or .glb file, or demo:NAME[:LIGHTS[:SEED]]; without one, a dialog asks for it
    pub(crate) scene: Option<String>,
    /// How lights are chosen
    #[arg(long, value_name = "NAME", default_value = default_method(), value_parser = any_method())]
    sampler: Method,
    #[command(flatten)]
    light: LightArgs,
    /// Width of the window in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1280, value_parser = clap::value_parser!(u32).range(64..=16_384))]
    width: u32,
    /// Height of the window in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 720, value_parser = clap::value_parser!(u32).range(64..=16_384))]
    height: u32,
    /// Milliseconds that a frame may take while the picture moves
    ///
    /// Higher values give sharper pictures; lower values give more of them.
    #[arg(long, value_name = "MS", default_value_t = 30.0, value_parser = milliseconds)]
    frame_time: f64,
    /// Camera path that P plays: what K has recorded, one camera a frame
    #[arg(long, value_name = "FILE")]
    camera_path: Option<PathBuf>,
    /// Drive the window by a script
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
}

fn after_help() -> String {
    format!(
        "\
Examples:
  manylight demo:rooms                       walk through a building with 2,048 lights; F1 shows all keys
  manylight view hall.glb --sampler tree     start with another sampler
  manylight view demo:rooms --script FILE    drive the window without a hand

Lines of a script, FRAME being the number of the frame at which they are due:
{}

Exit code 3: no display, or no driver that can draw to it.",
        script::SYNTAX
    )
}

fn milliseconds(text: &str) -> Result<f64, String> {
    match text.trim_end_matches("ms").parse::<f64>() {
        Ok(value) if (1.0..=10_000.0).contains(&value) => Ok(value),
        _ => Err("must be 1 to 10,000 milliseconds".into()),
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input; [`Refusal::NoGpu`] if there is no display or nothing to draw to it with.
pub(crate) fn run(args: &ViewArgs) -> Result<Status> {
    let script = args.script.as_deref().map(Script::read).transpose()?;
    let path = args.camera_path.as_deref().map(camera_path::read).transpose()?;
    let settings = args.light.settings(args.sampler, (1, 1));
    let backend = args.light.one_backend()?;
    settings.check()?;
    session::use_threads(args.light.threads)?;
    let event_loop = EventLoop::with_user_event().build().map_err(|error| {
        let why = match error {
            // What the library says names its own source files.
            EventLoopError::Os(_) => "no display answers: are DISPLAY or WAYLAND_DISPLAY set?".into(),
            other => other.to_string(),
        };
        Refusal::NoGpu(format!(
            "no window can be opened here ({why}); run it on a desktop, under `xvfb-run`, or use `manylight render`"
        ))
    })?;
    let mut app = App::new(args, settings, backend, script, event_loop.create_proxy())?;
    app.driver.path = path.unwrap_or_default();
    event_loop.run_app(&mut app)?;
    app.outcome()
}

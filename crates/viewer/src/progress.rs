//! Progress on stderr: a bar on a terminal, a line each 10 % elsewhere, nothing when quiet. Of what nobody knows the end of, the current part.

use crate::{message, table};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// The progress of one job.
pub(crate) struct Progress {
    what: String,
    bar: Option<ProgressBar>,
    tenths: u64,
    start: Instant,
}

/// Whether somebody looks on.
fn shown() -> bool {
    !message::quiet() && std::io::stderr().is_terminal()
}

/// Steps of the bar.
const STEPS: u64 = 1000;

impl Progress {
    /// Starts to tell about `what`.
    pub(crate) fn new(what: &str) -> Self {
        let bar = shown().then(|| {
            let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr_with_hz(10));
            let style = ProgressStyle::with_template("{prefix} [{bar:30}] {percent:>3} %  {msg}  {elapsed} left {eta}");
            bar.set_style(
                style
                    .unwrap_or_else(|_| ProgressStyle::default_bar())
                    .progress_chars("=> "),
            );
            bar.set_prefix(what.to_string());
            bar
        });
        Self {
            what: what.into(),
            bar,
            tenths: 0,
            start: Instant::now(),
        }
    }

    /// `done` of the job (0 to 1) is done, after `frames` frames of `pixels` pixels each.
    pub(crate) fn update(&mut self, done: f64, frames: u64, pixels: u64) {
        let seconds = self.start.elapsed().as_secs_f64().max(1e-9);
        let speed = (frames * pixels) as f64 / seconds * 1e-6;
        self.step(done, &format!("{frames} spp, {speed:.2} Msamples/s"));
    }

    /// `done` of the job (0 to 1) is done; `what` says it in other words.
    pub(crate) fn step(&mut self, done: f64, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_position((done * STEPS as f64) as u64);
            bar.set_message(what.to_string());
        } else if (done * 10.0) as u64 > self.tenths {
            self.tenths = (done * 10.0) as u64;
            let seconds = table::number(self.start.elapsed().as_secs_f64());
            message::note(format!("{}: {} %, {seconds} s, {what}", self.what, self.tenths * 10));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// What is being done just now, in the last line of a terminal; above it, or alone elsewhere, lines that stay.
pub(crate) struct Spinner {
    bar: Option<ProgressBar>,
}

impl Spinner {
    /// Nothing yet.
    pub(crate) fn new() -> Self {
        let bar = shown().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
            let style = ProgressStyle::with_template("{spinner} {elapsed}  {wide_msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Self { bar }
    }

    /// This begins.
    pub(crate) fn now(&self, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(what.to_string());
        }
    }

    /// This is known, and stays to be read.
    pub(crate) fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => message::note(text),
        }
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

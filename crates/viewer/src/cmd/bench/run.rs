//! Runs of samplers that take turns.

use super::contestants::Contestant;
use super::reference::Reference;
use crate::interrupt::Watch;
use crate::message;
use crate::progress::Progress;
use crate::session::{self, BackEnd};
use anyhow::Result;
use render::gpu::PassTime;
use render::{Choosing, FrameLoop, ImageError, Settings};
use scene::{Camera, Scene};
use std::time::Instant;

/// Frames that are timed pass by pass.
const TIMED_FRAMES: u32 = 16;

/// One frame of a run.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// Milliseconds of this frame, learning included.
    pub(super) frame_ms: f64,
    /// Seconds since the start of the run: light build, frames, learning; measuring excluded.
    pub(super) elapsed_s: f64,
    /// The error after this frame, where it was measured.
    pub(super) error: Option<ImageError>,
}

/// One rendering from scratch.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// [`Contestant::name`].
    pub(super) name: String,
    /// Seed.
    pub(super) seed: u64,
    /// Seconds of building the light structures.
    pub(super) light_build_s: f64,
    /// Seconds of learning, part of the frames.
    pub(super) learn_s: f64,
    /// What choosing lights cost after the last frame; `None` for methods without a choice.
    pub(super) choosing: Option<Choosing>,
    /// Rays traced, of both kinds.
    pub(super) rays: u64,
    /// What the passes of further frames took on the device, if that was asked for.
    pub(super) passes: Vec<PassTime>,
    /// All frames.
    pub(super) frames: Vec<Frame>,
}

/// A run that is not finished.
struct Active<'s> {
    run: Run,
    renderer: Box<dyn FrameLoop<'s> + 's>,
    elapsed_s: f64,
    /// The next of the times to be measured at.
    next_time: usize,
}

impl Run {
    /// Renders with every contestant until the last of `times`, its seed being the `nth` after its first. The one that is furthest behind renders the next frame: so
    /// all of them see the same machine, whatever else it does.
    ///
    /// # Errors
    /// Settings out of range.
    #[expect(clippy::too_many_arguments, reason = "all of them differ in type, and are used once")]
    pub(super) fn all(
        scene: &Scene,
        camera: &Camera,
        contestants: &[Contestant],
        nth: u64,
        times: &[f64],
        reference: &Reference,
        watch: &Watch,
        what: &str,
        pass_times: bool,
    ) -> Result<Vec<Self>> {
        let last = *times.last().expect("the command line asks for at least one time");
        let mut active = Vec::with_capacity(contestants.len());
        for contestant in contestants {
            if nth == 0 {
                compile(scene, camera, contestant)?;
            }
            active.push(Active::start(scene, camera, contestant, nth)?);
        }
        let pixels = contestants.first().map_or(0, |Contestant { settings, .. }| {
            u64::from(settings.width) * u64::from(settings.height)
        });
        let mut progress = Progress::new(what);
        while !watch.stopped() {
            let behind = active.iter_mut().filter(|a| a.next_time < times.len());
            let Some(next) = behind.min_by(|a, b| a.elapsed_s.total_cmp(&b.elapsed_s)) else {
                break;
            };
            next.render_frame(times, reference)?;
            let done: f64 = active.iter().map(|a| (a.elapsed_s / last).min(1.0)).sum();
            let frames = active.iter().map(|a| a.run.frames.len() as u64).sum();
            progress.update(done / active.len() as f64, frames, pixels);
        }
        let finish = |(active, contestant): (Active<'_>, &Contestant)| {
            active.finish(pass_times && matches!(contestant.back_end, BackEnd::Gpu(_)))
        };
        Ok(active.into_iter().zip(contestants).map(finish).collect())
    }

    /// Rays per second of the frames.
    pub(super) fn rays_per_s(&self) -> f64 {
        let seconds = self.frames.iter().map(|frame| frame.frame_ms * 1e-3).sum::<f64>();
        self.rays as f64 / seconds.max(f64::MIN_POSITIVE)
    }

    /// Parts of the frames' time that went into learning and into choosing.
    pub(super) fn shares(&self) -> (f64, Option<f64>) {
        let seconds = self.frames.iter().map(|frame| frame.frame_ms * 1e-3).sum::<f64>();
        let frame_s = seconds / self.frames.len().max(1) as f64;
        let choose = self
            .choosing
            .map(|choosing| choosing.share(frame_s, rayon::current_num_threads()));
        (self.learn_s / seconds.max(f64::MIN_POSITIVE), choose)
    }

    /// The measured state at `time`: the first at or after it, if the run came so far.
    pub(super) fn at_time(&self, time: f64) -> Option<&Frame> {
        self.frames
            .iter()
            .find(|frame| frame.elapsed_s >= time && frame.error.is_some())
    }
}

/// Has a device compile what it needs, which is kept for all runs and counts in none.
fn compile(scene: &Scene, camera: &Camera, contestant: &Contestant) -> Result<()> {
    if let BackEnd::Cpu = contestant.back_end {
        return Ok(());
    }
    let start = Instant::now();
    let mut frames = contestant.back_end.start(scene, camera, &contestant.settings)?;
    // Some drivers do it when it is first needed.
    frames.render_frame();
    frames.wait();
    if let Some(error) = frames.error() {
        return Err(session::of_gpu(error));
    }
    let seconds = start.elapsed().as_secs_f64();
    message::note(format!(
        "{}: shaders compiled in {seconds:.1} s, which count in no run",
        contestant.name
    ));
    Ok(())
}

impl<'s> Active<'s> {
    fn start(scene: &'s Scene, camera: &Camera, contestant: &Contestant, nth: u64) -> Result<Self> {
        let settings = Settings {
            seed: contestant.settings.seed + nth,
            ..contestant.settings.clone()
        };
        let renderer = contestant.back_end.start(scene, camera, &settings)?;
        let light_build_s = renderer.stats().light_build_s;
        Ok(Self {
            run: Run {
                name: contestant.name.clone(),
                seed: settings.seed,
                light_build_s,
                learn_s: 0.0,
                choosing: None,
                rays: 0,
                passes: Vec::new(),
                frames: Vec::new(),
            },
            renderer,
            elapsed_s: light_build_s,
            next_time: 0,
        })
    }

    /// Renders a frame, then measures if the number of frames is a power of two or one of the times has come.
    fn render_frame(&mut self, times: &[f64], reference: &Reference) -> Result<()> {
        let start = Instant::now();
        self.renderer.render_frame();
        // The others shall not run at the same time.
        self.renderer.wait();
        if let Some(error) = self.renderer.error() {
            return Err(session::of_gpu(error));
        }
        let frame_s = start.elapsed().as_secs_f64();
        self.elapsed_s += frame_s;
        let count = self.run.frames.len() + 1;
        let passed = times[self.next_time..]
            .iter()
            .take_while(|time| self.elapsed_s >= **time)
            .count();
        self.next_time += passed;
        let due = passed > 0 || count.is_power_of_two();
        let error = if due {
            reference.error(&self.renderer.film().image())
        } else {
            None
        };
        self.run.frames.push(Frame {
            frame_ms: frame_s * 1e3,
            elapsed_s: self.elapsed_s,
            error,
        });
        Ok(())
    }

    fn finish(mut self, pass_times: bool) -> Run {
        self.run.choosing = self.renderer.choosing();
        let stats = self.renderer.stats();
        self.run.learn_s = stats.sampler.map_or(0.0, |sampler| sampler.learn_s);
        self.run.rays = stats.rays_nearest + stats.rays_occluded;
        if pass_times {
            if self.renderer.time_passes() {
                (0..TIMED_FRAMES).for_each(|_| self.renderer.render_frame());
                self.run.passes = self.renderer.pass_times();
            } else {
                message::note(format!(
                    "{}: the adapter has no timestamps: no times of passes",
                    self.run.name
                ));
            }
        }
        self.run
    }
}

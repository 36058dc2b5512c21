//! `bench --skips`: what the renderer saves by leaving out what a scene does not need.
//!
//! Each line is the same image rendered twice: as it is, and with the thing forced. Both take turns frame by frame, so that a busy machine slows both
//! alike, and both images have to be the same. What is made on demand is made once: there it is the time from the name of the scene to its first
//! picture, loading included, and what was made takes memory.

mod needless;
mod report;

use super::BenchArgs;
use crate::cli::{Backend, LightArgs};
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::{machine, message, output, session};
use anyhow::{Result, bail};
use glam::Vec3;
use needless::Skip;
use render::{FrameLoop, Method, Settings};
use scene::{Camera, Scene, luminance};
use serde::Serialize;
use std::time::Instant;

/// Frames of each side before times count: caches fill, the first frames are learned from.
const WARM_UP: u32 = 4;
/// Pairs of pairs of frames that are timed, per seed.
const BLOCKS: u32 = 16;
/// Pairs of pairs of first pictures that are timed, per seed.
const STARTS: u32 = 4;
/// Means that are further apart than this are not those of one image: one in 500,000.
const STANDARD_ERRORS: f64 = 4.75;
/// relMSE between two images that rounding alone makes different.
const ROUNDING: f64 = 1e-6;
/// Less light than this is none.
const BLACK: f64 = 1e-20;

/// What forcing one thing costs in one scene.
#[derive(Clone, Debug, Serialize)]
struct Line {
    scene: String,
    sampler: &'static str,
    skipped: &'static str,
    forced_by: &'static str,
    /// Median time of a frame as it is, or to the first picture, milliseconds.
    frame_ms: f64,
    /// Time of the forced frames over that of the others, by block.
    ratios: Vec<f64>,
    /// Median of `ratios`.
    ratio: f64,
    /// Their first and third quartile.
    quartiles: [f64; 2],
    /// Noise, estimated relMSE at equal samples: forced over as it is; `None` where the image is black or of one frame.
    noise: Option<f64>,
    /// Shadow rays of the forced frames over those of the others; `None` where there are none.
    shadow_rays: Option<f64>,
    /// Bytes made on demand: forced over as it is; `None` where nothing is made beforehand.
    memory: Option<f64>,
    /// Mean squared difference of the images, relative to their mean square.
    difference: f64,
    /// Difference of the mean luminances, in standard errors.
    standard_errors: f64,
    /// Whether both are the same image, but for noise.
    same: bool,
}

/// Runs the comparison.
///
/// # Errors
/// Bad input; files that cannot be written.
pub(super) fn run(args: &BenchArgs) -> Result<Status> {
    if args.light.one_backend()? != Backend::Cpu {
        bail!("--skips renders on the CPU only; leave --backend away");
    }
    super::make_output(&args.output, "skips.json")?;
    session::use_threads(args.light.threads)?;
    let scenes = match args.scenes.as_slice() {
        [] => ["rooms", "points", "one-light"]
            .map(|name| format!("demo:{name}"))
            .to_vec(),
        some => some.to_vec(),
    };
    let methods = match args.samplers.as_slice() {
        [] => vec![Settings::default().method],
        some => some.to_vec(),
    };
    let watch = Watch::rendering();
    let mut lines = Vec::new();
    'all: for what in &scenes {
        let loaded = session::load_with_warnings(what)?;
        for &method in &methods {
            let plan = Plan {
                what,
                scene: &loaded.scene,
                camera: session::camera(&loaded.scene, args.light.camera.as_deref())?,
                settings: settings(&args.light, method, args.size.or((256, 192)))?,
                seeds: args.seeds,
                watch: &watch,
            };
            let applies = |skip: &Skip| (skip.applies)(&loaded.scene);
            let frames = needless::ALL.iter().filter(|skip| applies(skip));
            let starts = applies(&needless::ON_DEMAND).then_some(&needless::ON_DEMAND);
            let starts = starts.into_iter().map(|skip| plan.compare_starts(skip));
            for line in frames.map(|skip| plan.compare(skip)).chain(starts) {
                let Some(line) = line? else {
                    break 'all;
                };
                message::note(format!("{what}, {}: {:.3}", line.skipped, line.ratio));
                lines.push(line);
            }
        }
    }
    let interrupted = watch.writing();
    output::print(&report::table(&lines))?;
    output::write(&args.output.join("skips.json"), report::json(&lines)?.as_bytes())?;
    Ok(if interrupted {
        Status::Interrupted
    } else if lines.iter().all(|line| line.same) {
        Status::Done
    } else {
        Status::Failed
    })
}

fn settings(args: &LightArgs, method: Method, size: (u32, u32)) -> Result<Settings> {
    let settings = args.settings(method, size);
    settings.check()?;
    Ok(settings)
}

/// What is compared.
struct Plan<'a> {
    what: &'a str,
    scene: &'a Scene,
    camera: &'a Camera,
    settings: Settings,
    seeds: u32,
    watch: &'a Watch,
}

impl Plan<'_> {
    /// Measures one line; `None` if it was stopped.
    fn compare(&self, skip: &Skip) -> Result<Option<Line>> {
        let mut changed = Vec::new();
        for change in [skip.skipped, skip.forced] {
            let (mut parts, mut settings) = (self.scene.parts.clone(), self.settings.clone());
            change(&mut parts, &mut settings);
            changed.push((Scene::new(parts)?, settings));
        }
        let mut samples = Samples::default();
        for seed in 0..self.seeds {
            let mut sides = Vec::new();
            for (scene, settings) in &changed {
                let settings = seeded(settings, seed);
                sides.push(render::renderer(scene, self.camera, &settings)?);
            }
            let [one, other] = sides.as_mut_slice() else {
                unreachable!("there are two sides")
            };
            if !samples.take(one.as_mut(), other.as_mut(), self.watch) {
                return Ok(None);
            }
        }
        Ok(Some(samples.line(self.what, changed[0].1.method, skip)))
    }

    /// Measures the line of what is made on demand, by its first pictures; `None` if it was stopped.
    fn compare_starts(&self, skip: &Skip) -> Result<Option<Line>> {
        let mut samples = Samples::default();
        for seed in 0..self.seeds {
            let settings = seeded(&self.settings, seed);
            for start in 1..=STARTS {
                let mut seconds = [0.0; 2];
                let mut sides = [None, None];
                // In this order, what slows down or speeds up steadily meets both alike.
                for build_all in [false, true, true, false] {
                    let side = usize::from(build_all);
                    let (first, took) = timed(|| self.first_picture(&settings, build_all));
                    seconds[side] += took;
                    sides[side] = Some(first?);
                }
                samples.frame_ms.push(500.0 * seconds[0]);
                samples.ratios.push(seconds[1] / seconds[0]);
                if self.watch.stopped() {
                    return Ok(None);
                }
                if let (STARTS, [Some(one), Some(other)]) = (start, &sides) {
                    samples.enter([one.as_ref(), other.as_ref()]);
                }
            }
        }
        Ok(Some(samples.line(self.what, self.settings.method, skip)))
    }

    /// A rendering after its first frame, of the scene loaded anew.
    fn first_picture(&self, settings: &Settings, build_all: bool) -> Result<Box<dyn FrameLoop<'static>>> {
        let mut loaded = session::load(self.what)?;
        if build_all {
            loaded.build_all();
        }
        let mut frames = render::renderer(loaded.give().0, self.camera, settings)?;
        frames.render_frame();
        match frames.error() {
            Some(error) => Err(error.into()),
            None => Ok(frames),
        }
    }
}

fn seeded(settings: &Settings, seed: u32) -> Settings {
    Settings {
        seed: settings.seed + u64::from(seed),
        ..settings.clone()
    }
}

/// What was measured so far, of all seeds.
#[derive(Default)]
struct Samples {
    frame_ms: Vec<f64>,
    ratios: Vec<f64>,
    shadow_rays: [u64; 2],
    memory: [u64; 2],
    noise: [f64; 2],
    mean: [f64; 2],
    variance: [f64; 2],
    squares: f64,
    square_differences: f64,
}

impl Samples {
    /// Renders with both sides in turns; returns false if it was stopped.
    fn take<'s>(&mut self, skipped: &mut dyn FrameLoop<'s>, forced: &mut dyn FrameLoop<'s>, watch: &Watch) -> bool {
        for _ in 0..WARM_UP {
            skipped.render_frame();
            forced.render_frame();
        }
        for _ in 0..BLOCKS {
            // In this order, what slows down or speeds up steadily meets both alike.
            let first = frame_s(skipped);
            let both = frame_s(forced) + frame_s(forced);
            let last = frame_s(skipped);
            self.frame_ms.push(500.0 * (first + last));
            self.ratios.push(both / (first + last));
            if watch.stopped() {
                return false;
            }
        }
        self.enter([skipped, forced]);
        true
    }

    /// Enters what two renderings have come to.
    fn enter(&mut self, [skipped, forced]: [&dyn FrameLoop<'_>; 2]) {
        let films = [skipped.film(), forced.film()];
        for (side, film) in films.into_iter().enumerate() {
            let pixels = film.image().pixels;
            let brightness = |pixel: &[f32; 3]| f64::from(luminance(Vec3::from_array(*pixel)));
            self.mean[side] += pixels.iter().map(brightness).sum::<f64>() / pixels.len() as f64;
            self.variance[side] +=
                film.variance().iter().copied().map(f64::from).sum::<f64>() / (pixels.len() as f64).powi(2);
            self.noise[side] += film.estimated_relmse();
        }
        for (a, b) in films[0].image().pixels.iter().zip(&films[1].image().pixels) {
            let (a, b) = (Vec3::from_array(*a).as_dvec3(), Vec3::from_array(*b).as_dvec3());
            self.squares += a.length_squared();
            self.square_differences += (a - b).length_squared();
        }
        for (side, frames) in [skipped, forced].into_iter().enumerate() {
            self.shadow_rays[side] += frames.stats().rays_occluded;
            self.memory[side] += frames.scene().memory().used().peak_bytes;
        }
    }

    fn line(mut self, scene: &str, method: Method, skip: &Skip) -> Line {
        let standard_error = (self.variance[0] + self.variance[1]).sqrt();
        let apart = (self.mean[0] - self.mean[1]).abs();
        let difference = self.square_differences / self.squares.max(f64::MIN_POSITIVE);
        let standard_errors = if apart == 0.0 { 0.0 } else { apart / standard_error };
        let ratios = self.ratios.clone();
        Line {
            scene: scene.into(),
            sampler: method.name(),
            skipped: skip.name,
            forced_by: skip.forced_by,
            frame_ms: quantile(&mut self.frame_ms, 0.5),
            ratio: quantile(&mut self.ratios, 0.5),
            quartiles: [quantile(&mut self.ratios, 0.25), quantile(&mut self.ratios, 0.75)],
            ratios,
            noise: (self.noise[0] > 0.0 && self.noise[0].is_finite()).then(|| self.noise[1] / self.noise[0]),
            shadow_rays: (self.shadow_rays[0] > 0).then(|| self.shadow_rays[1] as f64 / self.shadow_rays[0] as f64),
            memory: (self.memory[1] > self.memory[0]).then(|| self.memory[1] as f64 / self.memory[0].max(1) as f64),
            difference,
            standard_errors,
            same: difference <= ROUNDING || standard_errors <= STANDARD_ERRORS || apart <= BLACK,
        }
    }
}

/// Seconds of a frame.
fn frame_s<'s>(frames: &mut dyn FrameLoop<'s>) -> f64 {
    timed(|| frames.render_frame()).1
}

/// What `work` returns, and the seconds it took: of processor time where the system tells, which other programs do not lengthen.
fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let (start, before) = (Instant::now(), machine::processor_s());
    let result = work();
    let seconds = match (before, machine::processor_s()) {
        (Some(before), Some(after)) if after > before => after - before,
        _ => start.elapsed().as_secs_f64(),
    };
    (result, seconds)
}

/// The value below which a share of `values` lies.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (values.len().saturating_sub(1)) as f64 * share;
    values.get(at.round() as usize).copied().unwrap_or(f64::NAN)
}

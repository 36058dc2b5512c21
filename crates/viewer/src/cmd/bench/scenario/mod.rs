//! `bench --scenario`: scenes and cameras that change while a sampler learns. Nothing accumulates: the error of each single
//! frame is measured, against `exact` in the state and from the camera of that frame.

mod displayed;
mod plan;
mod report;

use super::BenchArgs;
use super::reference::Reference;
use super::summary::median;
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::progress::Progress;
use crate::{message, output, session};
use anyhow::Result;
use clap::ValueEnum;
use displayed::{Medians, Shown};
use light_cache::SamplerKind;
use plan::Plan;
use render::Cleaner;
use render::{Method, Settings};
use scene::Camera;
use serde::Serialize;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;
use std::time::Instant;

/// What changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Scenario {
    /// the camera walks through the rooms of demo:rooms, demo:points or demo:sun-outside
    Walk,
    /// the lamp that gives the image the most light is off, then switched on
    Lights,
    /// a door of demo:rooms, demo:points or demo:keyhole is shut, then opened
    Door,
}

impl Scenario {
    fn name(self) -> &'static str {
        match self {
            Self::Walk => "walk",
            Self::Lights => "lights",
            Self::Door => "door",
        }
    }
}

/// How much larger than its later, steady value the error may be for a change to count as learned.
const LEARNED: f64 = 1.2;
/// One frame.
#[derive(Clone, Copy, Debug)]
struct Step {
    frame_ms: f64,
    /// relMSE without the worst 0.1 % of the pixels.
    error: f64,
    /// As the window shows it, if that was asked for.
    shown: Option<Shown>,
}

/// What one sampler did.
#[derive(Debug, Serialize)]
struct Curve {
    sampler: &'static str,
    /// Error of each frame, median over the seeds.
    errors: Vec<f64>,
    /// Median of the last quarter of the errors.
    steady: f64,
    /// Frames after the change until the error was within [`LEARNED`] of `steady`; `None` where nothing changes at once.
    learned_after: Option<usize>,
    /// As rendered and as the window shows it, if that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    displayed: Option<Medians>,
    /// By seed.
    #[serde(skip)]
    runs: Vec<(u64, Vec<Step>)>,
}

/// What was measured on one scene.
#[derive(Debug, Serialize)]
struct Outcome {
    what: String,
    scenario: Scenario,
    /// What changed, for people.
    change: String,
    /// Frames before the change; 0 where the change is gradual.
    before: usize,
    curves: Vec<Curve>,
}

/// Runs the scenario on each of `scenes`; a walk goes along `path`, if there is one.
///
/// # Errors
/// Scenes that the scenario does not fit; files that cannot be written.
pub(super) fn run(
    args: &BenchArgs,
    scenario: Scenario,
    path: Option<&[Camera]>,
    scenes: &[String],
    methods: &[Method],
    settings: &Settings,
    cache: &Path,
) -> Result<Status> {
    let mut outcomes = Vec::new();
    let watch = Watch::rendering();
    for what in scenes {
        let plan = match path {
            Some(path) => Plan::along(what, &path[..args.frames.min(path.len())])?,
            None => Plan::new(scenario, what, args.light.camera.as_deref(), settings, args.frames)?,
        };
        message::note(format!("{what}: {}", plan.change));
        let Some(references) = references(&plan, settings, args.reference_spp, cache, &watch)? else {
            break;
        };
        let mut runs: Vec<Vec<(u64, Vec<Step>)>> = vec![Vec::new(); methods.len()];
        for seed in (settings.seed..).take(args.seeds as usize) {
            for (&method, runs) in methods.iter().zip(&mut runs) {
                let settings = Settings {
                    method,
                    seed,
                    // What guides history and filter.
                    aovs: args.displayed,
                    ..settings.clone()
                };
                runs.push((seed, drive(&plan, &references, &settings, what, &watch)?));
            }
        }
        if watch.stopped() {
            break;
        }
        let curves = methods.iter().zip(runs);
        let outcome = Outcome {
            what: what.clone(),
            scenario,
            before: plan.before,
            curves: curves
                .map(|(m, runs)| Curve::new(m.name(), runs, plan.before))
                .collect(),
            change: plan.change,
        };
        output::print(&(report::table(&outcome) + &displayed::table(&outcome)))?;
        outcomes.push(outcome);
    }
    let interrupted = watch.writing();
    report::write_all(&args.output, settings, &outcomes)?;
    message::note(format!(
        "{}: frames.csv, summary.json and plots written",
        args.output.display()
    ));
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}

/// A reference for every state and camera that occurs; `None` if interrupted.
fn references(
    plan: &Plan,
    settings: &Settings,
    spp: u64,
    cache: &Path,
    watch: &Watch,
) -> Result<Option<BTreeMap<(usize, usize), Reference>>> {
    let mut references = BTreeMap::new();
    for &(state, view) in &plan.frames {
        if let Entry::Vacant(missing) = references.entry((state, view)) {
            let (scene, camera) = (&plan.states[state], &plan.views[view]);
            let Some(reference) = Reference::get(scene, camera, settings, spp, cache, watch)? else {
                return Ok(None);
            };
            missing.insert(reference);
        }
    }
    Ok(Some(references))
}

/// Renders and measures all frames, or as many as there are until a signal comes.
fn drive(
    plan: &Plan,
    references: &BTreeMap<(usize, usize), Reference>,
    settings: &Settings,
    what: &str,
    watch: &Watch,
) -> Result<Vec<Step>> {
    // What these know of the lights is fixed when they are built, and they lose nothing when they are built again.
    let built_anew = matches!(
        settings.method,
        Method::Sampled(SamplerKind::Uniform | SamplerKind::Power | SamplerKind::Tree)
    );
    let start = |(state, view): (usize, usize)| session::start(&plan.states[state], &plan.views[view], settings);
    let mut now = plan.frames[0];
    let mut renderer = start(now)?;
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let mut progress = Progress::new(&format!("{what}, {}", settings.method.name()));
    let mut steps = Vec::with_capacity(plan.frames.len());
    let mut cleaner = settings.aovs.then(Cleaner::default);
    for &next in plan.frames.iter().take_while(|_| !watch.stopped()) {
        if next.0 != now.0 {
            if built_anew {
                renderer = start(next)?;
            } else {
                renderer.set_scene((&plan.states[next.0]).into())?;
            }
        }
        if next.1 != now.1 {
            renderer.set_camera(&plan.views[next.1]);
        }
        now = next;
        renderer.restart();
        let start = Instant::now();
        renderer.render_frame();
        let frame_ms = start.elapsed().as_secs_f64() * 1e3;
        let error = references[&now].error(&renderer.film().image());
        steps.push(Step {
            frame_ms,
            error: error.map_or(f64::NAN, |error| error.relmse_trimmed),
            shown: (cleaner.as_mut())
                .map(|cleaner| Shown::measure(cleaner, renderer.film(), &plan.views[now.1], &references[&now])),
        });
        let done = steps.len() as f64 / plan.frames.len() as f64;
        progress.update(done, steps.len() as u64, pixels);
    }
    Ok(steps)
}

impl Curve {
    fn new(sampler: &'static str, runs: Vec<(u64, Vec<Step>)>, before: usize) -> Self {
        let frames = runs.iter().map(|(_, steps)| steps.len()).min().unwrap_or(0);
        let of_frame = |frame: usize| median(runs.iter().map(|(_, steps)| steps[frame].error).collect());
        let errors: Vec<f64> = (0..frames).filter_map(of_frame).collect();
        let after = &errors[before.min(errors.len())..];
        let steady = median(after[after.len() - after.len().div_ceil(4)..].to_vec()).unwrap_or(f64::NAN);
        Self {
            sampler,
            steady,
            learned_after: if before > 0 { learned_after(after, steady) } else { None },
            errors,
            displayed: Medians::of(&runs),
            runs,
        }
    }
}

/// The first frame, counted from 1, at which the error is within reach of the steady one. It is smoothed by the median of
/// three frames in a row: one lucky frame does not count.
fn learned_after(errors: &[f64], steady: f64) -> Option<usize> {
    let last = errors.len().checked_sub(1)?;
    let smoothed = |at: usize| median(errors[at.saturating_sub(1)..=(at + 1).min(last)].to_vec());
    let within = |at: &usize| smoothed(*at).is_some_and(|error| error <= LEARNED * steady);
    (0..=last).find(within).map(|at| at + 1)
}

#[cfg(test)]
mod tests {
    use super::learned_after;

    #[test]
    fn one_lucky_frame_does_not_count() {
        assert_eq!(learned_after(&[9.0, 1.0, 8.0, 7.0, 1.1, 0.9, 1.0, 1.0], 1.0), Some(5));
        assert_eq!(learned_after(&[1.0, 1.0, 1.0], 1.0), Some(1));
        assert_eq!(learned_after(&[9.0, 9.0, 9.0], 1.0), None);
        assert_eq!(learned_after(&[], 1.0), None);
    }
}

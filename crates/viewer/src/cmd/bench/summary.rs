//! From runs to figures: medians over seeds, efficiencies.

use super::contestants::Contestant;
use super::reference::{Facts, Reference};
use super::run::{Frame, Run};
use crate::session::Loaded;
use render::gpu::PassTime;
use render::{ImageError, Method};
use serde::Serialize;

/// All that was measured on one scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneResult {
    /// What was asked for.
    pub(super) what: String,
    /// Name of the scene.
    pub(super) name: String,
    /// Number of lights.
    pub(super) lights: usize,
    /// Number of triangles.
    pub(super) triangles: u64,
    /// Seconds of loading.
    pub(super) load_s: f64,
    /// Seconds of building the BVH.
    pub(super) build_s: f64,
    /// What the errors are measured against.
    pub(super) reference: Facts,
    /// Where efficiencies are compared: the latest of the times at which the reference is good enough to tell the error
    /// of every sampler. `None` if it never is.
    pub(super) efficiency_at_s: Option<f64>,
    /// One entry per sampler.
    pub(super) samplers: Vec<SamplerResult>,
    /// Everything that was measured.
    #[serde(skip)]
    pub(super) runs: Vec<Run>,
}

/// What one sampler did on one scene.
#[derive(Debug, Serialize)]
pub(super) struct SamplerResult {
    /// Its name, and the value of the knob that is compared if there is one.
    pub(super) sampler: String,
    /// "cpu", or "gpu: " and the adapter.
    pub(super) backend: String,
    /// Number of runs.
    pub(super) seeds: usize,
    /// Frames of a run, median.
    pub(super) frames: usize,
    /// Median frame time, milliseconds, learning included.
    pub(super) frame_ms_median: f64,
    /// 95 % of the frames were faster.
    pub(super) frame_ms_p95: f64,
    /// 99 % of the frames were faster.
    pub(super) frame_ms_p99: f64,
    /// The slowest frame.
    pub(super) frame_ms_max: f64,
    /// Seconds of building the light structures, median.
    pub(super) light_build_s: f64,
    /// Seconds of learning, median.
    pub(super) learn_s: f64,
    /// Part of the frames' time that went into learning, median.
    pub(super) learn_share: f64,
    /// Part of the frames' time that went into choosing lights (timed after the last frame), median; `None` for methods
    /// without a choice, or where it is not counted.
    pub(super) choose_share: Option<f64>,
    /// Rays per second of the frames, both kinds, median.
    pub(super) rays_per_s: f64,
    /// What passes took on the device after the last run, by its own clock; empty if not asked for.
    pub(super) passes: Vec<PassTime>,
    /// What must be said of this method, if anything: it is for research.
    pub(super) research: Option<&'static str>,
    /// Errors at equal time.
    pub(super) at_time: Vec<Point>,
    /// Errors at equal numbers of frames.
    pub(super) at_frames: Vec<Point>,
    /// [`Point::efficiency`] at [`SceneResult::efficiency_at_s`].
    pub(super) efficiency: Option<f64>,
    /// Efficiency over that of `uniform`.
    pub(super) to_uniform: Option<f64>,
    /// Efficiency over that of `tree`.
    pub(super) to_tree: Option<f64>,
    /// Efficiency over that of the best other sampler, those for research left out.
    pub(super) to_best_other: Option<f64>,
}

/// The error at one moment: medians over the runs, and the spread over them.
#[derive(Debug, Serialize)]
pub(super) struct Point {
    /// The time or number of frames asked for.
    pub(super) at: f64,
    /// When it was measured, seconds since the start, everything included.
    pub(super) elapsed_s: f64,
    /// relMSE without the worst 0.1 % of the pixels: what tables and plots show.
    pub(super) relmse_trimmed: f64,
    /// Least over the runs.
    pub(super) relmse_trimmed_min: f64,
    /// Largest over the runs.
    pub(super) relmse_trimmed_max: f64,
    /// Standard error of that of one run.
    pub(super) relmse_trimmed_se: f64,
    /// relMSE over all pixels.
    pub(super) relmse: f64,
    /// At equal numbers of frames, `relmse_trimmed` over that of `oracle`; `None` without it, or where one of the two
    /// cannot be told from 0.
    pub(super) to_oracle: Option<f64>,
    /// 1 / (`relmse_trimmed` x `elapsed_s`); `None` where the error is not above 0: lost in the reference's noise.
    pub(super) efficiency: Option<f64>,
}

impl SceneResult {
    /// Works out the figures.
    pub(super) fn new(
        loaded: &Loaded,
        contestants: &[Contestant],
        times: &[f64],
        reference: &Reference,
        runs: Vec<Run>,
    ) -> Self {
        let of = |name: &str| runs.iter().filter(|run| run.name == name).collect::<Vec<_>>();
        let mut samplers: Vec<_> = contestants
            .iter()
            .map(|contestant| SamplerResult::new(contestant, &of(&contestant.name), times))
            .collect();
        let told = |time: &&f64| {
            let mut points = samplers.iter().map(|s| s.at_time.iter().find(|p| p.at == **time));
            points.all(|point| point.is_some_and(|point| !point.is_noise()))
        };
        let efficiency_at_s = times.iter().rev().find(told).copied();
        for sampler in &mut samplers {
            let point = sampler.at_time.iter().find(|point| Some(point.at) == efficiency_at_s);
            sampler.efficiency = point.and_then(|point| point.efficiency);
        }
        let rivals: Vec<Option<f64>> = samplers
            .iter()
            .map(|s| s.efficiency.filter(|_| s.research.is_none()))
            .collect();
        let of_sampler = |name: &str| samplers.iter().find(|s| s.sampler == name).and_then(|s| s.efficiency);
        let (uniform, tree) = (of_sampler("uniform"), of_sampler("tree"));
        for (index, sampler) in samplers.iter_mut().enumerate() {
            let others = rivals.iter().enumerate().filter(|(i, _)| *i != index);
            let best = others.filter_map(|(_, e)| *e).max_by(f64::total_cmp);
            let over = |other: Option<f64>| Some(sampler.efficiency? / other?);
            (sampler.to_uniform, sampler.to_tree, sampler.to_best_other) = (over(uniform), over(tree), over(best));
        }
        compare_to_oracle(&mut samplers);
        Self {
            what: loaded.what.clone(),
            name: loaded.scene.parts.name.clone(),
            lights: loaded.scene.lights.len(),
            triangles: loaded.scene.triangle_count(),
            load_s: loaded.load_s,
            build_s: loaded.scene.build_s,
            reference: reference.facts.clone(),
            efficiency_at_s,
            samplers,
            runs,
        }
    }
}

/// Fills in [`Point::to_oracle`].
fn compare_to_oracle(samplers: &mut [SamplerResult]) {
    let oracle = samplers.iter().find(|s| s.sampler == Method::Oracle.name());
    let told = |points: &[Point]| -> Vec<(f64, f64)> {
        let points = points.iter().filter(|p| !p.is_noise());
        points.map(|p| (p.at, p.relmse_trimmed)).collect()
    };
    let Some(best) = oracle.map(|s| told(&s.at_frames)) else {
        return;
    };
    for point in samplers
        .iter_mut()
        .flat_map(|s| &mut s.at_frames)
        .filter(|p| !p.is_noise())
    {
        let same = best.iter().find(|(at, _)| *at == point.at);
        point.to_oracle = same.map(|(_, error)| point.relmse_trimmed / error);
    }
}

impl SamplerResult {
    fn new(contestant: &Contestant, runs: &[&Run], times: &[f64]) -> Self {
        let mut frame_ms: Vec<f64> = runs
            .iter()
            .flat_map(|run| &run.frames)
            .map(|frame| frame.frame_ms)
            .collect();
        frame_ms.sort_by(f64::total_cmp);
        let most = runs.iter().map(|run| run.frames.len()).max().unwrap_or(0);
        let powers = (0..usize::BITS)
            .map(|bit| 1usize << bit)
            .take_while(|&count| count <= most);
        Self {
            sampler: contestant.name.clone(),
            backend: contestant.back_end.to_string(),
            seeds: runs.len(),
            rays_per_s: median(runs.iter().map(|run| run.rays_per_s()).collect()).unwrap_or(0.0),
            passes: runs.last().map_or_else(Vec::new, |run| run.passes.clone()),
            frames: median(runs.iter().map(|run| run.frames.len() as f64).collect()).unwrap_or(0.0) as usize,
            frame_ms_median: quantile(&frame_ms, 0.5),
            frame_ms_p95: quantile(&frame_ms, 0.95),
            frame_ms_p99: quantile(&frame_ms, 0.99),
            frame_ms_max: quantile(&frame_ms, 1.0),
            light_build_s: median(runs.iter().map(|run| run.light_build_s).collect()).unwrap_or(0.0),
            learn_s: median(runs.iter().map(|run| run.learn_s).collect()).unwrap_or(0.0),
            learn_share: median(runs.iter().map(|run| run.shares().0).collect()).unwrap_or(0.0),
            choose_share: median(runs.iter().filter_map(|run| run.shares().1).collect()),
            research: contestant.settings.method.research_note(),
            at_time: times
                .iter()
                .filter_map(|&time| Point::new(time, runs, |run| run.at_time(time)))
                .collect(),
            at_frames: powers
                .filter_map(|n| Point::new(n as f64, runs, |run| run.frames.get(n - 1)))
                .collect(),
            efficiency: None,
            to_uniform: None,
            to_tree: None,
            to_best_other: None,
        }
    }
}

impl Point {
    /// `None` unless all runs came so far: the slower ones would be missing.
    fn new<'r>(at: f64, runs: &[&'r Run], pick: impl Fn(&'r Run) -> Option<&'r Frame>) -> Option<Self> {
        let frames: Vec<_> = runs
            .iter()
            .filter_map(|run| pick(run))
            .filter_map(|f| Some((f, f.error?)))
            .collect();
        if frames.len() < runs.len() {
            return None;
        }
        let errors = |pick: fn(&ImageError) -> f64| {
            let mut all: Vec<f64> = frames.iter().map(|(_, error)| pick(error)).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let trimmed = errors(|error| error.relmse_trimmed);
        let relmse_trimmed = quantile(&trimmed, 0.5);
        let elapsed_s = median(frames.iter().map(|(frame, _)| frame.elapsed_s).collect())?;
        Some(Self {
            at,
            elapsed_s,
            relmse_trimmed,
            relmse_trimmed_min: quantile(&trimmed, 0.0),
            relmse_trimmed_max: quantile(&trimmed, 1.0),
            relmse_trimmed_se: quantile(&errors(|error| error.relmse_trimmed_se), 0.5),
            relmse: quantile(&errors(|error| error.relmse), 0.5),
            to_oracle: None,
            efficiency: (relmse_trimmed > 0.0).then(|| 1.0 / (relmse_trimmed * elapsed_s)),
        })
    }

    /// Whether the error cannot be told from none: less than two standard errors above 0.
    pub(super) fn is_noise(&self) -> bool {
        self.relmse_trimmed < 2.0 * self.relmse_trimmed_se
    }
}

pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    (!values.is_empty()).then(|| quantile(&values, 0.5))
}

/// The value below which a share `q` of the sorted `values` lies, interpolated; NaN if there are none.
pub(super) fn quantile(values: &[f64], q: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = q * last as f64;
    let (below, rest) = (place.floor() as usize, place.fract());
    let above = values[(below + 1).min(last)];
    values[below] + (above - values[below]) * rest
}

#[cfg(test)]
mod tests {
    use super::{median, quantile};

    #[test]
    fn quantiles_interpolate() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), 2.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.75), 3.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 1.0), 4.0);
        assert!(quantile(&[], 0.5).is_nan());
        assert_eq!(median(vec![3.0, 1.0]), Some(2.0));
        assert_eq!(median(Vec::new()), None);
    }
}

//! What all hazards are checked with: effort, results, and renderings repeated over seeds.

use super::report::Report;
use crate::interrupt::Watch;
use anyhow::Result;
use clap::ValueEnum;
use glam::Vec3;
use light_cache::SamplerKind;
use render::{Method, Settings, renderer};
use sampling::Moments;
use scene::{Camera, Scene, luminance};
use serde::Serialize;
use std::fmt::{self, Display};
use std::path::Path;
use std::time::Instant;

/// How much is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cmd::bench) enum Effort {
    /// seconds: some of each, for tests
    Quick,
    /// minutes
    Standard,
    /// the numbers of rays, frames and lights that the promises are about, and four times the samples wherever noise is compared: an hour
    Long,
}

/// One thing that was checked.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Check {
    /// Family of hazards.
    pub(super) family: &'static str,
    /// What threatens.
    pub(super) hazard: String,
    /// Who has to stand it: a sampler, or a function.
    pub(super) subject: String,
    /// In what the deviation is measured.
    pub(super) measure: &'static str,
    /// How far from the truth.
    pub(super) deviation: f64,
    /// The largest deviation that passes.
    pub(super) limit: f64,
    /// Whether the deviation is a number and within the limit.
    pub(super) passed: bool,
    /// Seconds since the check before it. Where one measurement serves several checks, the first has its time.
    pub(super) seconds: f64,
}

/// Somebody wants no more checks.
#[derive(Debug)]
pub(super) struct Stopped;

impl Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("stopped")
    }
}

impl std::error::Error for Stopped {}

/// Deviations beyond this many standard errors are no chance: one in 500,000, with some hundred checks of the kind.
pub(super) const STANDARD_ERRORS: (&str, f64) = ("standard errors", 4.75);
/// Things that must not happen at all.
pub(super) const NEVER: (&str, f64) = ("occurrences", 0.0);

/// Collects checks, and tells about them.
pub(super) struct Bench<'w> {
    effort: Effort,
    watch: &'w Watch,
    other_program: Option<&'w Path>,
    family: &'static str,
    report: Report,
    checked: Instant,
}

impl<'w> Bench<'w> {
    /// None checked yet.
    pub(super) fn new(effort: Effort, watch: &'w Watch, other_program: Option<&'w Path>, report: Report) -> Self {
        Self {
            effort,
            watch,
            other_program,
            family: "",
            report,
            checked: Instant::now(),
        }
    }

    /// The checks to come are of this family.
    pub(super) fn begin(&mut self, family: &'static str) {
        self.family = family;
    }

    /// Says what is checked from here on, which may take a while.
    ///
    /// # Errors
    /// [`Stopped`]; the file with the results cannot be written.
    pub(super) fn now(&mut self, what: impl Display) -> Result<()> {
        if self.watch.stopped() {
            return Err(Stopped.into());
        }
        self.report.now(&format!("{}: {what}", self.family))
    }

    /// Says something about the checks to come, such as why they are not made.
    pub(super) fn note(&self, text: impl Display) {
        self.report.line(&text.to_string());
    }

    /// All that was found.
    pub(super) fn finish(self) -> Report {
        self.report
    }

    /// One of three values by the effort.
    pub(super) fn pick<T>(&self, quick: T, standard: T, long: T) -> T {
        match self.effort {
            Effort::Quick => quick,
            Effort::Standard => standard,
            Effort::Long => long,
        }
    }

    /// This program as it was built otherwise, if there is one.
    pub(super) fn other_program(&self) -> Option<&'w Path> {
        self.other_program
    }

    /// Enters a result, `deviation` being at least 0.
    pub(super) fn check(
        &mut self,
        hazard: impl Into<String>,
        subject: impl Into<String>,
        (measure, limit): (&'static str, f64),
        deviation: f64,
    ) {
        let now = Instant::now();
        self.report.enter(Check {
            family: self.family,
            hazard: hazard.into(),
            subject: subject.into(),
            measure,
            deviation,
            limit,
            passed: deviation <= limit,
            seconds: (now - self.checked).as_secs_f64(),
        });
        self.checked = now;
    }
}

/// A rendering to be repeated.
#[derive(Clone, Debug)]
pub(super) struct Shot<'s> {
    /// What.
    pub(super) scene: &'s Scene,
    /// From where.
    pub(super) camera: &'s Camera,
    /// How; the seed is that of the first repetition.
    pub(super) settings: Settings,
    /// Frames of each repetition.
    pub(super) frames: u32,
    /// How many with seeds of their own. Learning starts anew in each.
    pub(super) repetitions: u64,
}

/// What the repetitions told.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    /// Mean luminance of the image.
    pub(super) mean: Moments,
    /// Luminance of each pixel.
    pub(super) pixels: Vec<Moments>,
    /// Samples that were not finite, and pixels that are no numbers, or negative where they cannot be.
    pub(super) broken: u64,
}

impl<'s> Shot<'s> {
    /// Of `width` x `height` pixels by `method`.
    pub(super) fn new(scene: &'s Scene, camera: &'s Camera, method: Method, (width, height): (u32, u32)) -> Self {
        Self {
            scene,
            camera,
            settings: Settings {
                width,
                height,
                method,
                ..Settings::default()
            },
            frames: 16,
            repetitions: 8,
        }
    }

    /// With another effort. All lights at every point take as long as many frames of the others, and tell as much: an eighth of them.
    pub(super) fn effort(mut self, frames: u32, repetitions: u64) -> Self {
        let share = if self.settings.method == Method::Exact { 8 } else { 1 };
        (self.frames, self.repetitions) = (frames.div_ceil(share), repetitions);
        self
    }

    /// With another first seed.
    pub(super) fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// Renders.
    ///
    /// # Errors
    /// Settings out of range.
    pub(super) fn estimate(&self) -> Result<Estimate> {
        let pixels = (self.settings.width * self.settings.height) as usize;
        let mut estimate = Estimate {
            mean: Moments::default(),
            pixels: vec![Moments::default(); pixels],
            broken: 0,
        };
        // A control variate takes away what is expected, which may be more than there is: by design, and only there.
        let below_zero =
            self.settings.method == Method::Sampled(SamplerKind::Adaptive) && self.settings.light.control_variate;
        for repetition in 0..self.repetitions {
            let settings = Settings {
                seed: self.settings.seed + repetition,
                ..self.settings.clone()
            };
            let mut rendering = renderer(self.scene, self.camera, &settings)?;
            for _ in 0..self.frames {
                rendering.render_frame();
            }
            estimate.broken += rendering.stats().nonfinite_samples;
            let mut sum = 0.0;
            for (moments, pixel) in estimate.pixels.iter_mut().zip(&rendering.film().image().pixels) {
                estimate.broken += u64::from(!pixel.iter().all(|v| v.is_finite() && (below_zero || *v >= 0.0)));
                let value = f64::from(luminance(Vec3::from_array(*pixel)));
                moments.push(value);
                sum += value;
            }
            estimate.mean.push(sum / pixels as f64);
        }
        Ok(estimate)
    }
}

impl Estimate {
    /// How many standard errors (and single-precision rounding) the mean is away from `expected`.
    pub(super) fn deviation(&self, expected: f64) -> f64 {
        deviation(self.mean.mean() - expected, self.mean.standard_error(), expected)
    }

    /// The same, differences of up to `tolerance` times what is expected being allowed for.
    pub(super) fn deviation_beyond(&self, expected: f64, tolerance: f64) -> f64 {
        let difference = (self.mean.mean() - expected).abs() - tolerance * expected;
        deviation(difference.max(0.0), self.mean.standard_error(), expected)
    }

    /// How many standard errors the mean is away from that of `other`.
    pub(super) fn deviation_from(&self, other: &Self) -> f64 {
        let error = self.mean.standard_error().hypot(other.mean.standard_error());
        deviation(self.mean.mean() - other.mean.mean(), error, other.mean.mean())
    }

    /// Mean over the pixels of the variance of a repetition, over the square of the mean luminance; without the pixels of the largest
    /// variances, a thirtieth of all. Where a few spikes decide the mean over all pixels, it is no property of the sampler: of `table` on
    /// `points` it differed by a factor of 1.7 between the seeds 0 and 1000 at the same place, on `rooms` by 1.4, and without these pixels
    /// by 1.1 and 1.06.
    pub(super) fn relative_variance(&self) -> f64 {
        let mut variances: Vec<f64> = self.pixels.iter().map(Moments::variance).collect();
        variances.sort_unstable_by(f64::total_cmp);
        variances.truncate(variances.len() - variances.len() / 30);
        let variance = variances.iter().sum::<f64>() / variances.len() as f64;
        variance / self.mean.mean().powi(2)
    }
}

/// `difference` in standard errors; one of rounding only is none.
fn deviation(difference: f64, standard_error: f64, expected: f64) -> f64 {
    const ROUNDING: f64 = 2e-6;
    if difference == 0.0 {
        return 0.0;
    }
    difference.abs() / standard_error.hypot(ROUNDING * expected)
}

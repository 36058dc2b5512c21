//! Renderings repeated over seeds, and whether two of them agree.

use glam::Vec3;
use light_cache::SamplerKind;
use render::{Image, Method, Settings, renderer};
use sampling::Moments;
use sampling::statistics::{normal_p_two_sided, sidak};
use scene::{Camera, Scene, luminance};

/// How a picture is estimated.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The renderer's settings; the seed is that of the first repetition.
    pub settings: Settings,
    /// Samples per pixel and repetition. Learning samplers start anew in each.
    pub spp: u32,
    /// Number of renderings with seeds of their own.
    pub repetitions: u64,
}

impl Plan {
    /// A plan for `method` with images of `width` x `height`.
    pub fn new(method: Method, width: u32, height: u32) -> Self {
        Self {
            settings: Settings {
                width,
                height,
                method,
                ..Settings::default()
            },
            spp: 16,
            repetitions: 16,
        }
    }

    /// With another number of bounces.
    pub fn bounces(mut self, max_bounces: u32) -> Self {
        self.settings.max_bounces = max_bounces;
        self
    }

    /// With other numbers of samples and repetitions.
    pub fn effort(mut self, spp: u32, repetitions: u64) -> Self {
        (self.spp, self.repetitions) = (spp, repetitions);
        self
    }

    /// With another first seed; two plans to be compared need seeds that do not overlap.
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }
}

/// What the repetitions of a rendering told: independent, so that their spread is the error, stratification included.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Luminance of each pixel.
    pub pixels: Vec<Moments>,
    /// Mean luminance of the image.
    pub mean: Moments,
    /// Samples that were NaN or infinite.
    pub nonfinite: u64,
}

/// The method that names `kind`.
pub fn sampled(kind: SamplerKind) -> Method {
    Method::Sampled(kind)
}

/// One rendering.
pub fn image(scene: &Scene, camera: &Camera, settings: &Settings, spp: u32) -> Image {
    let mut rendering = renderer(scene, camera, settings).expect("the settings are valid");
    for _ in 0..spp {
        rendering.render_frame();
    }
    assert_eq!(rendering.stats().nonfinite_samples, 0, "samples that are not finite");
    rendering.film().image()
}

/// Carries out `plan`.
pub fn estimate(scene: &Scene, camera: &Camera, plan: &Plan) -> Estimate {
    let size = (plan.settings.width * plan.settings.height) as usize;
    let mut estimate = Estimate {
        pixels: vec![Moments::default(); size],
        mean: Moments::default(),
        nonfinite: 0,
    };
    for repetition in 0..plan.repetitions {
        let settings = Settings {
            seed: plan.settings.seed + repetition,
            ..plan.settings.clone()
        };
        let image = image(scene, camera, &settings, plan.spp);
        let mut sum = 0.0;
        for (moments, &pixel) in estimate.pixels.iter_mut().zip(&image.pixels) {
            let value = f64::from(luminance(Vec3::from_array(pixel)));
            moments.push(value);
            sum += value;
        }
        estimate.mean.push(sum / size as f64);
    }
    estimate
}

/// Standard errors between two estimates; 0 if they agree without spread.
fn z(a: &Moments, b: &Moments) -> f64 {
    // Below this share of the value a difference is rounding, not statistics.
    const ROUNDING: f64 = 2e-6;
    let error = a
        .standard_error()
        .hypot(b.standard_error())
        .hypot(ROUNDING * (a.mean().abs() + b.mean().abs()));
    if a.mean() == b.mean() {
        0.0
    } else {
        (a.mean() - b.mean()) / error
    }
}

/// Asserts that `a` and `b` estimate the same image.
///
/// Mean radiance: within 3 standard errors (a right program fails once in 370). Pixels: z-tests at a significance that
/// Sidak's correction makes 1 % for the whole image if the spreads are normal; since a few repetitions estimate a spread poorly and
/// rare bright samples are no normal noise, 99.75 % of the pixels must pass, the rate at which Mitsuba 3's tests pass.
pub fn assert_same(what: &str, a: &Estimate, b: &Estimate) {
    assert_eq!(a.pixels.len(), b.pixels.len(), "{what}: sizes differ");
    let of_mean = z(&a.mean, &b.mean);
    assert!(
        of_mean.abs() < 3.0,
        "{what}: mean {} +- {} against {} +- {} is {of_mean:.2} standard errors off",
        a.mean.mean(),
        a.mean.standard_error(),
        b.mean.mean(),
        b.mean.standard_error()
    );
    let significance = sidak(0.01, a.pixels.len());
    let scores: Vec<f64> = a.pixels.iter().zip(&b.pixels).map(|(x, y)| z(x, y)).collect();
    let failed = scores.iter().filter(|z| normal_p_two_sided(**z) < significance).count();
    let allowed = a.pixels.len() as f64 * 0.0025;
    let worst = scores
        .iter()
        .fold(0.0, |worst: f64, z| if z.abs() > worst.abs() { *z } else { worst });
    assert!(
        failed as f64 <= allowed,
        "{what}: {failed} of {} pixels differ, the worst by {worst:.1} standard errors",
        a.pixels.len()
    );
}

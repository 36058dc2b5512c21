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
    /// Cameras of frames that are rendered before, one each, and thrown away: what is kept of them counts.
    pub before: Vec<Camera>,
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
            before: Vec::new(),
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

    /// After frames of their own, seen by these cameras.
    pub fn after(mut self, before: Vec<Camera>) -> Self {
        self.before = before;
        self
    }

    /// With another first seed; two plans to be compared need seeds that do not overlap.
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }
}

/// A scene seen by a camera, to be estimated.
#[derive(Clone, Debug)]
pub struct Case<'s> {
    /// What is rendered.
    pub scene: &'s Scene,
    /// From where.
    pub camera: &'s Camera,
    /// How.
    pub plan: Plan,
}

/// A case and what came of it.
#[derive(Clone, Debug)]
pub struct Measured<'s> {
    /// What was asked for.
    pub case: Case<'s>,
    /// What was found.
    pub estimate: Estimate,
}

/// What the repetitions of a rendering told: independent, so that their spread is the error, stratification included.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Luminance of each pixel, row by row.
    pub pixels: Vec<Moments>,
    /// Mean luminance of the image.
    pub mean: Moments,
    width: usize,
}

/// The method that names `kind`.
pub fn sampled(kind: SamplerKind) -> Method {
    Method::Sampled(kind)
}

/// One rendering.
pub fn image(scene: &Scene, camera: &Camera, settings: &Settings, spp: u32) -> Image {
    image_after(scene, &[], camera, settings, spp)
}

/// One rendering after frames seen by other cameras.
fn image_after(scene: &Scene, before: &[Camera], camera: &Camera, settings: &Settings, spp: u32) -> Image {
    let mut rendering = renderer(scene, camera, settings).expect("the settings are valid");
    for camera in before {
        rendering.set_camera(camera);
        rendering.render_frame();
    }
    if !before.is_empty() {
        rendering.set_camera(camera);
    }
    for _ in 0..spp {
        rendering.render_frame();
    }
    assert_eq!(rendering.stats().nonfinite_samples, 0, "samples that are not finite");
    rendering.film().image()
}

impl<'s> Case<'s> {
    /// `plan` for `scene` seen by `camera`.
    pub fn new(scene: &'s Scene, camera: &'s Camera, plan: Plan) -> Self {
        Self { scene, camera, plan }
    }

    /// Carries out the plan.
    pub fn measure(&self) -> Measured<'s> {
        Measured {
            case: self.clone(),
            estimate: self.estimate(),
        }
    }

    /// The same with four times the repetitions and seeds that share nothing with the first.
    fn again(&self) -> Self {
        let mut again = self.clone();
        again.plan.settings.seed += 1 << 40;
        again.plan.repetitions *= 4;
        again
    }

    /// Carries out the plan, telling the result only.
    pub fn estimate(&self) -> Estimate {
        let plan = &self.plan;
        Estimate::of((0..plan.repetitions).map(|repetition| {
            let settings = Settings {
                seed: plan.settings.seed + repetition,
                ..plan.settings.clone()
            };
            image_after(self.scene, &plan.before, self.camera, &settings, plan.spp)
        }))
    }
}

impl Estimate {
    /// What independent images of the same size tell.
    pub fn of(images: impl Iterator<Item = Image>) -> Self {
        let mut estimate = Self {
            pixels: Vec::new(),
            mean: Moments::default(),
            width: 0,
        };
        for image in images {
            estimate.width = image.width as usize;
            estimate.pixels.resize(image.pixels.len(), Moments::default());
            let mut sum = 0.0;
            for (moments, &pixel) in estimate.pixels.iter_mut().zip(&image.pixels) {
                let value = f64::from(luminance(Vec3::from_array(pixel)));
                moments.push(value);
                sum += value;
            }
            estimate.mean.push(sum / image.pixels.len() as f64);
        }
        estimate
    }

    /// Squared standard error of each pixel: its own, or the mean of its 5 x 5 neighbours' if that is larger. A pixel that
    /// a rare light happened to miss in all repetitions shows no spread of its own.
    fn squared_errors(&self) -> Vec<f64> {
        let own: Vec<f64> = self.pixels.iter().map(|m| m.standard_error().powi(2)).collect();
        let (width, height) = (self.width, own.len() / self.width);
        let smoothed = |index: usize| {
            let (x, y) = (index % width, index / width);
            let rows = y.saturating_sub(2)..(y + 3).min(height);
            let columns = x.saturating_sub(2)..(x + 3).min(width);
            let count = rows.len() * columns.len();
            let sum: f64 = rows
                .map(|y| own[y * width..][columns.clone()].iter().sum::<f64>())
                .sum();
            own[index].max(sum / count as f64)
        };
        (0..own.len()).map(smoothed).collect()
    }
}

/// `x - y` in standard errors; 0 if they agree without spread.
fn z(x: f64, y: f64, squared_error: f64) -> f64 {
    // Below this share of the value a difference is rounding, not statistics.
    const ROUNDING: f64 = 2e-6;
    let rounding = ROUNDING * (x.abs() + y.abs());
    if x == y {
        0.0
    } else {
        (x - y) / (squared_error + rounding * rounding).sqrt()
    }
}

/// How `a` and `b` differ beyond chance, if they do.
pub fn disagreement(a: &Estimate, b: &Estimate) -> Option<String> {
    let squared_error = a.mean.standard_error().powi(2) + b.mean.standard_error().powi(2);
    let of_mean = z(a.mean.mean(), b.mean.mean(), squared_error);
    if of_mean.abs() >= 3.0 {
        let told = |m: &Moments| format!("{} +- {}", m.mean(), m.standard_error());
        return Some(format!(
            "mean {} against {}: {of_mean:.2} standard errors",
            told(&a.mean),
            told(&b.mean)
        ));
    }
    let significance = sidak(0.01, a.pixels.len());
    let squared_errors = a.squared_errors().into_iter().zip(b.squared_errors());
    let pixels = a.pixels.iter().zip(&b.pixels).zip(squared_errors);
    let scores: Vec<f64> = pixels
        .map(|((x, y), (ex, ey))| z(x.mean(), y.mean(), ex + ey))
        .collect();
    let failed = scores.iter().filter(|z| normal_p_two_sided(**z) < significance).count();
    let worst = scores
        .iter()
        .fold(0.0, |worst: f64, z| if z.abs() > worst.abs() { *z } else { worst });
    (failed as f64 > 0.0025 * scores.len() as f64).then(|| {
        format!(
            "{failed} of {} pixels differ, the worst by {worst:.1} standard errors",
            scores.len()
        )
    })
}

/// Asserts that `case` estimates the same image as `reference`.
///
/// Mean radiance: within 3 standard errors. Pixels: z-tests at a significance that Sidak's correction makes 1 % for the whole image,
/// were the spreads normal; since a few repetitions estimate a spread poorly and rare bright samples are no normal noise,
/// 99.75 % of the pixels must pass, the rate that Mitsuba 3's image tests ask for. Where either fails, it is tried again with new
/// seeds and four times the repetitions, which decides: chance alone fails twice once in 100,000 times, while a bias
/// stands out twice as far.
pub fn assert_same(what: &str, case: &Case<'_>, reference: &Measured<'_>) {
    assert_eq!(
        case.plan.settings.width, reference.case.plan.settings.width,
        "{what}: sizes differ"
    );
    let Some(first) = disagreement(&case.estimate(), &reference.estimate) else {
        return;
    };
    let second = disagreement(&case.again().estimate(), &reference.case.again().estimate());
    if let Some(second) = second {
        panic!("{what}: {first}; tried again: {second}");
    }
}

//! The figures of a rendering, for `--stats`.

use crate::machine;
use crate::session::{BackEnd, Origin};
use render::gpu::PassTime;
use render::{Choosing, ErrorEstimate, FrameLoop, RenderStats, SampleCounts, Settings};
use scene::{KeptBytes, MemoryUse, Report, Scene};
use serde::Serialize;

/// All figures of a run. Field names are what scripts rely on.
#[derive(Debug, Serialize)]
pub(super) struct Stats {
    /// Path or `demo:...`.
    pub(super) scene: String,
    /// Name of the camera.
    pub(super) camera: String,
    version: &'static str,
    /// "cpu", or "gpu: " and the adapter.
    backend: String,
    /// Name of the sampler.
    pub(super) sampler: &'static str,
    width: u32,
    height: u32,
    max_bounces: u32,
    /// Samples per pixel.
    pub(super) spp: u64,
    /// How they are spread over the pixels, if they went where the error is.
    samples: Option<SampleCounts>,
    /// What the image is off by as far as can be told; `None` likewise, and after few frames.
    estimated_error: Option<ErrorEstimate>,
    /// The relMSE that was asked for.
    target_error: Option<f64>,
    /// Share of the pixels whose own relative squared error is below that with 95 % confidence.
    converged: Option<f64>,
    /// Seed of all random numbers.
    pub(super) seed: u64,
    threads: usize,
    interrupted: bool,
    load_s: f64,
    build_s: f64,
    light_build_s: f64,
    /// Seconds in which `oracle` found out what is best; part of no other figure.
    prepare_s: f64,
    /// Seconds of rendering, learning included.
    pub(super) render_s: f64,
    learn_s: f64,
    /// Part of the rendering time that went into learning.
    learn_share: f64,
    /// What choosing lights cost, timed after the rendering; `None` for methods without a choice, and with a memory budget.
    choosing: Option<Choosing>,
    /// Part of the rendering time that went into choosing.
    choose_share: Option<f64>,
    lights: usize,
    triangles: u64,
    rays_nearest: u64,
    rays_occluded: u64,
    /// Both kinds, over `render_s`.
    rays_per_s: f64,
    /// What the passes of a frame took on the device, by its own clock; empty for the CPU and where there is no clock.
    passes: Vec<PassTime>,
    nonfinite_samples: u64,
    cells: usize,
    min_probability: f64,
    light_bytes: usize,
    bvh_bytes: usize,
    /// Meshes whose trees some ray has needed.
    meshes_built: usize,
    meshes: usize,
    /// What was made on demand.
    memory: MemoryUse,
    /// What of the scene is kept whatever the memory budget; film and sampler (`light_bytes`) come on top.
    kept: KeptBytes,
    /// Bytes of the image in progress.
    film_bytes: usize,
    peak_rss_bytes: u64,
    skipped: Vec<String>,
    /// What must be said of results of this method, if anything: it is for research.
    pub(super) research: Option<&'static str>,
    /// What makes the image biased, if anything does.
    pub(super) biased: Option<String>,
    settings: Settings,
    report: Report,
}

impl Stats {
    /// Collects them.
    pub(super) fn new(
        frames: &dyn FrameLoop<'_>,
        run: &RenderStats,
        origin: &Origin,
        camera: &str,
        settings: &Settings,
        interrupted: bool,
        back_end: &BackEnd,
    ) -> Self {
        let scene = frames.scene();
        let threads = rayon::current_num_threads();
        let sampler = run.sampler.clone().unwrap_or_default();
        // The flag follows the setting, also where the sampler at hand has no use for it and says nothing.
        let asked = settings.light.ignore_below > 0.0;
        let by_setting = || asked.then(|| format!("ignore_below = {}", settings.light.ignore_below));
        Self {
            scene: origin.what.clone(),
            camera: camera.into(),
            version: machine::VERSION,
            backend: back_end.to_string(),
            sampler: settings.method.name(),
            width: settings.width,
            height: settings.height,
            max_bounces: settings.max_bounces,
            spp: run.frames,
            samples: None,
            estimated_error: None,
            target_error: None,
            converged: None,
            seed: settings.seed,
            threads,
            interrupted,
            load_s: origin.load_s,
            build_s: scene.build_s,
            light_build_s: run.light_build_s,
            prepare_s: run.prepare_s,
            render_s: run.render_s,
            learn_s: sampler.learn_s,
            learn_share: sampler.learn_s / run.render_s.max(f64::MIN_POSITIVE),
            choosing: None,
            choose_share: None,
            rays_per_s: (run.rays_nearest + run.rays_occluded) as f64 / run.render_s.max(f64::MIN_POSITIVE),
            passes: Vec::new(),
            lights: scene.lights.len(),
            triangles: scene.triangle_count(),
            rays_nearest: run.rays_nearest,
            rays_occluded: run.rays_occluded,
            nonfinite_samples: run.nonfinite_samples,
            cells: sampler.cells,
            min_probability: sampler.min_probability,
            light_bytes: sampler.bytes,
            bvh_bytes: scene.bvh().bytes(),
            meshes_built: scene.bvh().built(),
            meshes: scene.parts.meshes.len(),
            memory: scene.memory().used(),
            kept: scene.kept_bytes(),
            film_bytes: frames.film().bytes(),
            peak_rss_bytes: machine::peak_rss_bytes(),
            skipped: skipped(scene, run),
            research: settings.method.research_note(),
            biased: sampler.biased.or_else(by_setting),
            settings: settings.clone(),
            report: scene.parts.report.clone(),
        }
    }

    /// Adds what takes time to find out.
    pub(super) fn measure(&mut self, frames: &dyn FrameLoop<'_>, target_error: Option<f64>) {
        if let Some(target) = target_error {
            let film = frames.film();
            self.target_error = target_error;
            self.samples = Some(film.sample_counts());
            self.estimated_error = film.estimated_error();
            self.converged = Some(film.converged(target));
        }
        let frame_s = self.render_s / self.spp.max(1) as f64;
        // Its rays would go on making what a memory budget has no room for.
        self.choosing = match self.memory.budget_bytes {
            None => frames.choosing(),
            Some(_) => None,
        };
        self.choose_share = self.choosing.map(|choosing| choosing.share(frame_s, self.threads));
        self.passes = frames.pass_times();
    }
}

/// Everything that was left out because it was not needed.
pub(super) fn skipped(scene: &Scene, run: &RenderStats) -> Vec<String> {
    let mut all = scene.parts.report.skipped.clone();
    let sampler = run.sampler.iter().flat_map(|sampler| &sampler.skipped);
    for text in run.skipped.iter().chain(sampler) {
        if !all.contains(text) {
            all.push(text.clone());
        }
    }
    all
}

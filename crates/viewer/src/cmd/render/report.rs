//! What was done, and how good it has become, for people.

use super::{RenderArgs, stats};
use crate::session::Origin;
use crate::{message, table};
use render::{Film, RenderStats, Settings};
use scene::Scene;

/// How good an image has become that was to have an error of `target`.
pub(super) fn report(film: &Film, target: f64) -> String {
    let counts = film.sample_counts();
    let samples = format!(
        "{:.1} samples per pixel, {} to {}, median {}; skipped {:.0} % of the times",
        counts.mean,
        counts.least,
        counts.most,
        counts.median,
        100.0 * counts.skipped
    );
    let Some(error) = film.estimated_error() else {
        return format!("too few samples to tell the error; {samples}");
    };
    let converged = 100.0 * film.converged(target);
    format!(
        "estimated relMSE {:.2e}, with 95 % confidence {:.2e} to {:.2e} ({} {target}), but for rare light that no sample has met; \
         by itself below that, as sure: {converged:.0} % of the pixels; {samples}",
        error.relmse,
        error.low,
        error.high,
        if error.high <= target { "asked for" } else { "NOT the" },
    )
}

/// What was done, for people.
pub(super) fn summary(args: &RenderArgs, scene: &Scene, origin: &Origin, settings: &Settings, run: &RenderStats) {
    let samples = u64::from(settings.width) * u64::from(settings.height) * run.frames;
    message::note(format!(
        "{}: {} x {}, {} spp in {:.2} s, {:.2} Msamples/s, sampler {}, {} lights, {} triangles \
         (load {:.2} s, BVH {:.2} s, lights {:.2} s)",
        args.output.display(),
        settings.width,
        settings.height,
        run.frames,
        run.render_s,
        samples as f64 / run.render_s.max(1e-9) * 1e-6,
        settings.method.name(),
        table::thousands(scene.lights.len() as u64),
        table::thousands(scene.triangle_count()),
        origin.load_s,
        scene.build_s,
        run.light_build_s,
    ));
    if let Some(note) = settings.method.research_note() {
        message::note(format!(
            "{}: {note} ({:.2} s here)",
            settings.method.name(),
            run.prepare_s
        ));
    }
    let memory = scene.memory().used();
    if let Some(budget) = memory.budget_bytes {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        message::note(format!(
            "memory budget {:.1} MiB: at most {:.1} MiB were made on demand, {:.1} MiB are there; made {} times, of these {} again",
            mib(budget),
            mib(memory.peak_bytes),
            mib(memory.resident_bytes),
            table::thousands(memory.made),
            table::thousands(memory.made_again),
        ));
    }
    for skipped in stats::skipped(scene, run) {
        message::detail(format!("skipped: {skipped}"));
    }
}

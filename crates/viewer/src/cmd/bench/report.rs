//! Results as text and files.

use super::summary::{Point, SamplerResult, SceneResult};
use crate::machine::{self, Machine};
use crate::output;
use crate::table::{align, number, thousands};
use anyhow::Result;
use render::Settings;
use render::gpu::PassTime;
use serde_json::json;
use std::path::Path;

/// The tables of one scene, for people: frame times and efficiency, then errors.
pub(super) fn table(result: &SceneResult) -> String {
    let mut text = format!(
        "{}: {} lights, {} triangles; reference: {}; errors: {}\n{}\n",
        result.what,
        thousands(result.lights as u64),
        thousands(result.triangles),
        result.reference.origin,
        result.reference.estimator,
        times_table(result)
    );
    text += "relMSE without the worst 0.1 % of the pixels, +- one standard error of the last:\n";
    text += &errors_table(result, true, |point| {
        let mark = if point.is_noise() { "~" } else { "" };
        format!("{mark}{}", number(point.relmse_trimmed))
    });
    if all_points(result).any(Point::is_noise) {
        text += "~ less than two standard errors above 0: a better reference (--reference-spp) would tell\n";
    }
    let seeds = result.samplers.iter().map(|s| s.seeds).max().unwrap_or(0);
    if seeds > 1 {
        text += &format!("the same, least to largest over {seeds} seeds:\n");
        text += &errors_table(result, false, |point| {
            let ends = [point.relmse_trimmed_min, point.relmse_trimmed_max];
            ends.map(number).join(" to ")
        });
    }
    if all_points(result).any(|point| point.to_oracle.is_some()) {
        text += "the same as a multiple of that of oracle:\n";
        text += &errors_table(result, false, |point| number(point.to_oracle.unwrap_or(f64::NAN)));
    }
    for sampler in &result.samplers {
        if !sampler.passes.is_empty() {
            let of = |pass: &PassTime| {
                format!(
                    "{} {} ms (at most {})",
                    pass.name,
                    number(pass.mean_ms),
                    number(pass.max_ms)
                )
            };
            let passes: Vec<String> = sampler.passes.iter().map(of).collect();
            text += &format!(
                "{}, mean per frame on the device: {}\n",
                sampler.sampler,
                passes.join(", ")
            );
        }
        if let Some(note) = sampler.research {
            text += &format!("{}: {note}\n", sampler.sampler);
        }
    }
    text + "\n"
}

fn all_points(result: &SceneResult) -> impl Iterator<Item = &Point> {
    result
        .samplers
        .iter()
        .flat_map(|s| s.at_frames.iter().chain(&s.at_time))
}

fn times_table(result: &SceneResult) -> String {
    let efficiency = match result.efficiency_at_s {
        Some(time) => format!("efficiency at {time} s"),
        None => "efficiency".into(),
    };
    let header = [
        "sampler",
        "frames",
        "median ms",
        "p95",
        "p99",
        "max",
        "build ms",
        "learn %",
        "choose %",
        "Mrays/s",
        &efficiency,
        "x uniform",
        "x tree",
        "x best other",
    ];
    let row = |s: &SamplerResult| {
        let times = [s.frame_ms_median, s.frame_ms_p95, s.frame_ms_p99, s.frame_ms_max];
        let shares = [s.learn_share, s.choose_share.unwrap_or(f64::NAN)];
        let ratios = [s.efficiency, s.to_uniform, s.to_tree, s.to_best_other];
        [s.sampler.clone(), s.frames.to_string()]
            .into_iter()
            .chain(times.map(number))
            .chain([number(s.light_build_s * 1e3)])
            .chain(shares.map(|share| number(share * 100.0)))
            .chain([number(s.rays_per_s * 1e-6)])
            .chain(ratios.map(|value| number(value.unwrap_or(f64::NAN))))
            .collect()
    };
    align(&header, &result.samplers.iter().map(row).collect::<Vec<_>>(), 1)
}

/// What `show` tells of the errors after 1, 4, 16 ... frames and at the times asked for.
///
/// With `noise`, a further column tells the standard error of the last.
fn errors_table(result: &SceneResult, noise: bool, show: impl Fn(&Point) -> String) -> String {
    let moments = |points: fn(&SamplerResult) -> &[Point]| {
        let mut all: Vec<f64> = result.samplers.iter().flat_map(points).map(|p| p.at).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    let mut frames = moments(|s| &s.at_frames);
    frames.retain(|count| count.log2() % 2.0 == 0.0);
    let times = moments(|s| &s.at_time);
    let header: Vec<String> = std::iter::once("sampler".into())
        .chain(frames.iter().map(|count| format!("{count} spp")))
        .chain(times.iter().map(|time| format!("{time} s")))
        .chain(noise.then(|| "+-".into()))
        .collect();
    let cell = |points: &[Point], at: f64| {
        let point = points.iter().find(|point| point.at == at);
        point.map_or("-".into(), &show)
    };
    let row = |s: &SamplerResult| {
        std::iter::once(s.sampler.clone())
            .chain(frames.iter().map(|&at| cell(&s.at_frames, at)))
            .chain(times.iter().map(|&at| cell(&s.at_time, at)))
            .chain(noise.then(|| number(s.at_time.last().map_or(f64::NAN, |point| point.relmse_trimmed_se))))
            .collect()
    };
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    align(&header, &result.samplers.iter().map(row).collect::<Vec<_>>(), 1)
}

/// Writes `frames.csv`, `summary.json` and `setup.md`.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_all(folder: &Path, machine: &Machine, settings: &Settings, results: &[SceneResult]) -> Result<()> {
    output::write_with(&folder.join("frames.csv"), |file| {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record([
            "scene",
            "sampler",
            "seed",
            "frame",
            "frame_ms",
            "elapsed_s",
            "mse",
            "relmse",
            "relmse_trimmed",
            "relmse_trimmed_se",
            "smape",
            "mean_ratio",
        ])?;
        for (result, run) in results.iter().flat_map(|r| r.runs.iter().map(move |run| (r, run))) {
            for (index, frame) in run.frames.iter().enumerate() {
                let errors = frame.error.map_or([const { String::new() }; 6], |e| {
                    [
                        e.mse,
                        e.relmse,
                        e.relmse_trimmed,
                        e.relmse_trimmed_se,
                        e.smape,
                        e.mean_ratio,
                    ]
                    .map(|value| value.to_string())
                });
                let mut row = vec![
                    result.what.clone(),
                    run.name.clone(),
                    run.seed.to_string(),
                    (index + 1).to_string(),
                    frame.frame_ms.to_string(),
                    frame.elapsed_s.to_string(),
                ];
                row.extend(errors);
                csv.write_record(row)?;
            }
        }
        Ok(csv.flush()?)
    })?;
    let summary = json!({
        "date": machine::today(),
        "machine": machine,
        "backends": back_ends(results),
        "settings": settings,
        "scenes": results,
    });
    output::write(
        &folder.join("summary.json"),
        (serde_json::to_string_pretty(&summary)? + "\n").as_bytes(),
    )?;
    output::write(&folder.join("setup.md"), setup(machine, settings, results).as_bytes())
}

/// What rendered.
fn back_ends(results: &[SceneResult]) -> Vec<&str> {
    let mut all: Vec<&str> = results
        .iter()
        .flat_map(|r| &r.samplers)
        .map(|s| &s.backend[..])
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// How the numbers came to be, and the tables.
fn setup(machine: &Machine, settings: &Settings, results: &[SceneResult]) -> String {
    let mut text = format!(
        "# Benchmark of {}\n\n\
         - manylight {}, commit {}, back ends: {}\n\
         - {}, {} logical processors, {} threads, SIMD {}, {}\n\
         - {} x {} pixels, {} bounces, seeds from {}\n\n\
         Every run learns from scratch; light build and learning count, measuring does not. Efficiency is \
         1 / (relMSE x seconds), at the latest time at which all errors stand out of the reference's noise. \
         Figures are medians over the seeds; relMSE is without the worst 0.1 % of the pixels (summary.json has it over \
         all pixels, too).\n",
        machine::today(),
        machine.version,
        machine.commit.unwrap_or("unknown"),
        back_ends(results).join("; "),
        machine.cpu,
        machine.logical_cpus,
        machine.threads,
        machine.simd.join(" "),
        machine.system,
        settings.width,
        settings.height,
        settings.max_bounces,
        settings.seed,
    );
    for result in results {
        text += &format!("\n```text\n{}\n```\n", table(result).trim_end());
    }
    text
}

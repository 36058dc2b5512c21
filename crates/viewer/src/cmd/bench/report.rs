//! Results as text and files.

use super::summary::SceneResult;
use crate::machine::{self, Machine};
use crate::output;
use crate::table::{align, number, thousands};
use anyhow::Result;
use render::Settings;
use serde_json::json;
use std::path::Path;

/// The table of one scene, for people.
pub(super) fn table(result: &SceneResult) -> String {
    let mut header: Vec<String> = ["sampler", "frames", "median ms", "p95", "p99", "max", "build ms"]
        .map(String::from)
        .to_vec();
    let longest = result.samplers.iter().max_by_key(|sampler| sampler.at_time.len());
    let times: Vec<f64> = longest
        .map(|s| s.at_time.iter().map(|point| point.at).collect())
        .unwrap_or_default();
    header.extend(times.iter().map(|time| format!("relMSE {time} s")));
    header.extend(["trimmed", "efficiency", "x uniform", "x best other"].map(String::from));
    let rows: Vec<Vec<String>> = result
        .samplers
        .iter()
        .map(|s| {
            let at = |time: f64| s.at_time.iter().find(|point| point.at == time);
            let mut row = vec![s.sampler.to_string(), s.frames.to_string()];
            let numbers = [
                s.frame_ms_median,
                s.frame_ms_p95,
                s.frame_ms_p99,
                s.frame_ms_max,
                s.light_build_s * 1e3,
            ];
            row.extend(numbers.map(number));
            row.extend(
                times
                    .iter()
                    .map(|&time| number(at(time).map_or(f64::NAN, |point| point.relmse))),
            );
            row.push(number(s.at_time.last().map_or(f64::NAN, |point| point.relmse_trimmed)));
            row.extend([s.efficiency, s.to_uniform, s.to_best_other].map(|value| number(value.unwrap_or(f64::NAN))));
            row
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    format!(
        "{}: {} lights, {} triangles; reference: {}, own relMSE {}\n{}\n",
        result.what,
        thousands(result.lights as u64),
        thousands(result.triangles),
        result.reference.origin,
        number(result.reference.own_relmse.unwrap_or(f64::NAN)),
        align(&header, &rows, 1)
    )
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
            "smape",
            "mean_ratio",
        ])?;
        for (result, run) in results.iter().flat_map(|r| r.runs.iter().map(move |run| (r, run))) {
            for (index, frame) in run.frames.iter().enumerate() {
                let error = frame
                    .error
                    .map(|e| [e.mse, e.relmse, e.relmse_trimmed, e.smape, e.mean_ratio]);
                let errors = error.map_or([const { String::new() }; 5], |values| values.map(|v| v.to_string()));
                let mut row = vec![
                    result.what.clone(),
                    run.method.name().into(),
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
        "backend": "cpu",
        "settings": settings,
        "scenes": results,
    });
    output::write(
        &folder.join("summary.json"),
        (serde_json::to_string_pretty(&summary)? + "\n").as_bytes(),
    )?;
    output::write(&folder.join("setup.md"), setup(machine, settings, results).as_bytes())
}

/// How the numbers came to be, and the tables.
fn setup(machine: &Machine, settings: &Settings, results: &[SceneResult]) -> String {
    let mut text = format!(
        "# Benchmark of {}\n\n\
         - manylight {}, commit {}, back end CPU\n\
         - {}, {} logical processors, {} threads, SIMD {}, {}\n\
         - {} x {} pixels, {} bounces, seeds from {}\n\n\
         Every run learns from scratch; light build and learning count, measuring does not. Efficiency is \
         1 / (relMSE x seconds) at the end of a run, medians over the seeds. \"trimmed\" is the relMSE at the last time \
         without the worst 0.1 % of the pixels.\n",
        machine::today(),
        machine.version,
        machine.commit.unwrap_or("unknown"),
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

//! Plots: error over time and over samples, log-log, one of each per scene.

use super::reference::safe_name;
use super::summary::{Point, SamplerResult, SceneResult};
use crate::output;
use crate::plot::{Axis, Labels, Line, plot};
use anyhow::Result;
use std::path::Path;

/// What bench plots, whatever it is plotted over.
pub(super) const ERROR: &str = "relMSE without the worst 0.1 % of the pixels";

/// Writes `SCENE-time.svg` and `SCENE-spp.svg`.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_all(folder: &Path, result: &SceneResult) -> Result<()> {
    let name = safe_name(result.what.trim_start_matches("demo:"));
    let lines = |x: fn(&Point) -> f64, points: fn(&SamplerResult) -> Vec<&Point>| -> Vec<Line<'_>> {
        let line = |s: &SamplerResult| {
            points(s)
                .iter()
                .filter(|p| !p.is_noise())
                .map(|p| (x(p), p.relmse_trimmed))
                .collect::<Vec<_>>()
        };
        result.samplers.iter().map(|s| (&*s.sampler, line(s))).collect()
    };
    let over_time = lines(
        |point| point.elapsed_s,
        |s| {
            let mut points: Vec<&Point> = s.at_frames.iter().chain(&s.at_time).collect();
            points.sort_by(|a, b| a.elapsed_s.total_cmp(&b.elapsed_s));
            points
        },
    );
    let over_spp = lines(|point| point.at, |s| s.at_frames.iter().collect());
    let title = format!("{}, {} lights", result.what, result.lights);
    for (suffix, axis, lines) in [
        ("time", "seconds (light build and learning included)", over_time),
        ("spp", "samples per pixel", over_spp),
    ] {
        let labels = Labels {
            title: &title,
            x: axis,
            y: ERROR,
        };
        if let Some(svg) = plot(labels, Axis::Logarithmic, &lines)? {
            output::write(&folder.join(format!("{name}-{suffix}.svg")), svg.as_bytes())?;
        }
    }
    Ok(())
}

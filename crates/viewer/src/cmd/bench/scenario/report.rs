//! Results of a scenario as text and files.

use super::super::plot::ERROR;
use super::super::reference::safe_name;
use super::super::summary::median;
use super::displayed::Shown;
use super::{LEARNED, Outcome};
use crate::machine::{self, Machine};
use crate::output;
use crate::plot::{Axis, Labels, Line, plot};
use crate::table::{align, number};
use anyhow::Result;
use render::Settings;
use serde_json::json;
use std::ops::Range;
use std::path::Path;

/// 1, 2, 3-4, 5-8, ... frames, counted from 0, up to `count`.
fn ranges(count: usize) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let (mut low, mut high) = (0, 1);
    while low < count {
        ranges.push(low..high.min(count));
        (low, high) = (high, high * 2);
    }
    ranges
}

/// The table of one scene, for people.
pub(super) fn table(outcome: &Outcome) -> String {
    let changes = outcome.before > 0;
    let longest = outcome.curves.iter().map(|c| c.errors.len()).max().unwrap_or(0);
    let ranges = ranges(longest.saturating_sub(outcome.before));
    let label = |range: &Range<usize>| match range.len() {
        1 => range.end.to_string(),
        _ => format!("{}-{}", range.start + 1, range.end),
    };
    let mut header = vec!["sampler".to_string()];
    if changes {
        header.push("before".into());
    }
    header.extend(ranges.iter().map(label));
    header.push("steady".into());
    if changes {
        header.push("learned after".into());
    }
    let rows: Vec<Vec<String>> = outcome
        .curves
        .iter()
        .map(|curve| {
            let (before, after) = curve.errors.split_at(outcome.before.min(curve.errors.len()));
            let middle = |errors: &[f64]| number(median(errors.to_vec()).unwrap_or(f64::NAN));
            let mut row = vec![curve.sampler.to_string()];
            if changes {
                row.push(middle(&before[before.len() - before.len().div_ceil(4)..]));
            }
            let of_range = |range: &Range<usize>| middle(after.get(range.clone()).unwrap_or_default());
            row.extend(ranges.iter().map(of_range));
            row.push(number(curve.steady));
            if changes {
                row.push(
                    curve
                        .learned_after
                        .map_or("-".into(), |frames| format!("{frames} frames")),
                );
            }
            row
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let since = if changes { " since the change" } else { "" };
    let mut text = format!(
        "{}, {}: {}\nrelMSE of single frames without the worst 0.1 % of the pixels, by number of the frame{since}:\n{}",
        outcome.what,
        outcome.scenario.name(),
        outcome.change,
        align(&header, &rows, 1)
    );
    if changes {
        text += &format!(
            "learned: from this frame on within {LEARNED} x the steady error, the median of the last quarter\n"
        );
    }
    text + "\n"
}

/// Writes `frames.csv`, `summary.json` and one plot per scene.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_all(folder: &Path, settings: &Settings, outcomes: &[Outcome]) -> Result<()> {
    output::write_with(&folder.join("frames.csv"), |file| {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record([
            "scene",
            "scenario",
            "sampler",
            "seed",
            "frame",
            "after_change",
            "frame_ms",
            "relmse_trimmed",
            "relmse",
            "flip",
            "clean_ms",
            "relmse_trimmed_shown",
            "relmse_shown",
            "flip_shown",
        ])?;
        for outcome in outcomes {
            for curve in &outcome.curves {
                for (seed, steps) in &curve.runs {
                    for (frame, step) in steps.iter().enumerate() {
                        let after = (frame + 1).saturating_sub(outcome.before);
                        let shown = |value: &dyn Fn(&Shown) -> f64| {
                            step.shown
                                .as_ref()
                                .map_or(String::new(), |shown| value(shown).to_string())
                        };
                        csv.write_record([
                            outcome.what.clone(),
                            outcome.scenario.name().into(),
                            curve.sampler.into(),
                            seed.to_string(),
                            (frame + 1).to_string(),
                            after.to_string(),
                            step.frame_ms.to_string(),
                            step.error.to_string(),
                            shown(&|shown| shown.raw.relmse),
                            shown(&|shown| shown.raw.flip),
                            shown(&|shown| shown.clean_ms),
                            shown(&|shown| shown.cleaned.relmse_trimmed),
                            shown(&|shown| shown.cleaned.relmse),
                            shown(&|shown| shown.cleaned.flip),
                        ])?;
                    }
                }
            }
        }
        Ok(csv.flush()?)
    })?;
    let summary = json!({
        "date": machine::today(),
        "machine": Machine::detect(),
        "settings": settings,
        "outcomes": outcomes,
    });
    let text = serde_json::to_string_pretty(&summary)? + "\n";
    output::write(&folder.join("summary.json"), text.as_bytes())?;
    for outcome in outcomes {
        write_plot(folder, outcome)?;
    }
    Ok(())
}

fn write_plot(folder: &Path, outcome: &Outcome) -> Result<()> {
    let points = |errors: &[f64]| (1..).map(f64::from).zip(errors.iter().copied()).collect();
    let lines: Vec<Line<'_>> = outcome
        .curves
        .iter()
        .map(|curve| (curve.sampler, points(&curve.errors)))
        .collect();
    let title = format!("{}, {}: {}", outcome.what, outcome.scenario.name(), outcome.change);
    let labels = Labels {
        title: &title,
        x: "frame",
        y: ERROR,
    };
    if let Some(svg) = plot(labels, Axis::Linear, &lines)? {
        let scene = safe_name(outcome.what.trim_start_matches("demo:"));
        let name = format!("{scene}-{}.svg", outcome.scenario.name());
        output::write(&folder.join(name), svg.as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn ranges_double_and_cover_everything() {
        assert_eq!(ranges(6), [0..1, 1..2, 2..4, 4..6]);
        assert_eq!(ranges(3), [0..1, 1..2, 2..3]);
        assert!(ranges(0).is_empty());
    }
}

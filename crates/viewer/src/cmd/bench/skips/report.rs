//! What leaving things out saves, as a table and as JSON.

use super::Line;
use crate::machine::{Machine, VERSION};
use crate::table::{align, number};
use anyhow::Result;
use serde::Serialize;

/// One line per skip and scene.
pub(super) fn table(lines: &[Line]) -> String {
    let optional = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.3}"));
    let rows: Vec<Vec<String>> = lines
        .iter()
        .map(|line| {
            vec![
                line.scene.clone(),
                line.sampler.into(),
                line.skipped.into(),
                line.forced_by.into(),
                format!("{:.2}", line.frame_ms),
                format!("{:.3}", line.ratio),
                format!("{:.3} to {:.3}", line.quartiles[0], line.quartiles[1]),
                optional(line.shadow_rays),
                optional(line.noise),
                optional(line.memory),
                match line.same {
                    true if line.difference == 0.0 => "equal".into(),
                    true if line.difference < 1e-9 => "but for rounding".into(),
                    true if line.standard_errors.is_finite() && line.noise.is_some() => {
                        format!("{} se", number(line.standard_errors))
                    }
                    true => "black".into(),
                    false => "DIFFERENT".into(),
                },
            ]
        })
        .collect();
    let header = [
        "scene",
        "sampler",
        "skipped",
        "forced by",
        "frame ms",
        "forced x",
        "half of all",
        "shadow rays x",
        "noise x",
        "memory x",
        "images",
    ];
    align(&header, &rows, 4)
        + "forced x: processor time of a frame with the thing forced over that of one without it (median over blocks of four frames, and where half of \
           them lie); for what is made on demand, of loading and the first frame; noise x: estimated relMSE at equal samples; memory x: bytes of \
           trees, records, textures and meshes that were made on demand or beforehand\n"
}

/// All lines, and where they were measured.
///
/// # Errors
/// None that can be expected.
pub(super) fn json(lines: &[Line]) -> Result<String> {
    #[derive(Serialize)]
    struct Document<'a> {
        version: &'static str,
        machine: Machine,
        lines: &'a [Line],
    }
    let document = Document {
        version: VERSION,
        machine: Machine::detect(),
        lines,
    };
    Ok(serde_json::to_string_pretty(&document)? + "\n")
}

//! Plots: error over time and over samples, log-log, one of each per scene.

use super::reference::safe_name;
use super::summary::{Point, SamplerResult, SceneResult};
use crate::output;
use anyhow::{Result, anyhow};
use plotters::prelude::*;
use std::path::Path;

/// Colours that people with any kind of colour vision can tell apart (Okabe and Ito 2008); every other line is dashed.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];

/// A line: what it is called, and its (x, relMSE).
type Line<'a> = (&'a str, Vec<(f64, f64)>);

/// Writes `SCENE-time.svg` and `SCENE-spp.svg`.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_all(folder: &Path, result: &SceneResult) -> Result<()> {
    let name = safe_name(result.what.trim_start_matches("demo:"));
    let lines = |x: fn(&Point) -> f64, points: fn(&SamplerResult) -> Vec<&Point>| -> Vec<Line<'_>> {
        let line = |s: &SamplerResult| points(s).iter().map(|p| (x(p), p.relmse)).collect::<Vec<_>>();
        result.samplers.iter().map(|s| (s.sampler, line(s))).collect()
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
    let own = result.reference.own_relmse;
    let title = format!("{}, {} lights", result.what, result.lights);
    for (suffix, axis, lines) in [
        ("time", "seconds (light build and learning included)", over_time),
        ("spp", "samples per pixel", over_spp),
    ] {
        if let Some(svg) = plot(&title, axis, &lines, own)? {
            output::write(&folder.join(format!("{name}-{suffix}.svg")), svg.as_bytes())?;
        }
    }
    Ok(())
}

/// The plot as SVG; `None` if there is nothing to draw on logarithmic axes.
fn plot(title: &str, axis: &str, lines: &[Line<'_>], own_relmse: Option<f64>) -> Result<Option<String>> {
    let drawable = |(x, y): &(f64, f64)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite();
    let all = || {
        lines
            .iter()
            .flat_map(|(_, points)| points.iter().copied())
            .filter(drawable)
    };
    if all().next().is_none() {
        return Ok(None);
    }
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        low / 1.3..high * 1.3
    };
    let x_range = range(&mut all().map(|(x, _)| x));
    let y_range = range(&mut all().map(|(_, y)| y));
    let mut svg = String::new();
    let failed = |error: &dyn std::fmt::Display| anyhow!("cannot draw the plot: {error}");
    {
        let area = SVGBackend::with_string(&mut svg, (800, 560)).into_drawing_area();
        area.fill(&WHITE).map_err(|e| failed(&e))?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 20))
            .margin(14)
            .x_label_area_size(48)
            .y_label_area_size(72)
            .build_cartesian_2d(x_range.clone().log_scale(), y_range.clone().log_scale())
            .map_err(|e| failed(&e))?;
        chart
            .configure_mesh()
            .x_desc(axis)
            .y_desc("relMSE")
            .x_label_formatter(&|x| format!("{x}"))
            .y_label_formatter(&|y| format!("{y:e}"))
            .light_line_style(BLACK.mix(0.06))
            .bold_line_style(BLACK.mix(0.15))
            .draw()
            .map_err(|e| failed(&e))?;
        for (index, (name, points)) in lines.iter().enumerate() {
            let style = COLORS[index % COLORS.len()].stroke_width(2);
            let points: Vec<_> = points.iter().copied().filter(drawable).collect();
            let dots = points.iter().map(|&at| Circle::new(at, 3, style.filled()));
            chart.draw_series(dots).map_err(|e| failed(&e))?;
            if index % 2 == 0 {
                let line = chart
                    .draw_series(LineSeries::new(points, style))
                    .map_err(|e| failed(&e))?;
                line.label(*name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], style));
            } else {
                let dashes = DashedLineSeries::new(points, 8, 5, style);
                let line = chart.draw_series(dashes).map_err(|e| failed(&e))?;
                line.label(*name).legend(move |(x, y)| {
                    let dash = |from, to| PathElement::new(vec![(x + from, y), (x + to, y)], style);
                    EmptyElement::at((0, 0)) + dash(0, 9) + dash(15, 24)
                });
            }
        }
        if let Some(own) = own_relmse.filter(|own| y_range.contains(own)) {
            let floor = DashedLineSeries::new([(x_range.start, own), (x_range.end, own)], 2, 4, BLACK.mix(0.5).into());
            let line = chart.draw_series(floor).map_err(|e| failed(&e))?;
            line.label("the reference's own error")
                .legend(|(x, y)| PathElement::new([(x, y), (x + 24, y)], BLACK.mix(0.5)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()
            .map_err(|e| failed(&e))?;
        area.present().map_err(|e| failed(&e))?;
    }
    Ok(Some(svg))
}

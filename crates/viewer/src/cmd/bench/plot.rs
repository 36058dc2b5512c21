//! Plots: error over time and over samples, log-log, one of each per scene.

use super::reference::safe_name;
use super::summary::{Point, SamplerResult, SceneResult};
use crate::output;
use anyhow::{Context, Result};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;

/// Colours that people with any kind of colour vision can tell apart (Okabe and Ito 2008); every other line is dashed.
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 0, 0),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(140, 140, 140),
];

/// Size of a plot, pixels.
const SIZE: (u32, u32) = (860, 520);

/// Width of the legend, right of the axes, pixels.
const LEGEND_WIDTH: i32 = 140;

/// A line: what it is called, and its (x, relMSE).
pub(super) type Line<'a> = (&'a str, Vec<(f64, f64)>);

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
    let title = format!("{}, {} lights", result.what, result.lights);
    for (suffix, axis, lines) in [
        ("time", "seconds (light build and learning included)", over_time),
        ("spp", "samples per pixel", over_spp),
    ] {
        if let Some(svg) = plot(&title, axis, Axis::Logarithmic, &lines)? {
            output::write(&folder.join(format!("{name}-{suffix}.svg")), svg.as_bytes())?;
        }
    }
    Ok(())
}

/// How the horizontal axis runs; the vertical one is always logarithmic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    Linear,
    Logarithmic,
}

/// The plot as SVG; `None` if there is nothing to draw.
pub(super) fn plot(title: &str, axis: &str, kind: Axis, lines: &[Line<'_>]) -> Result<Option<String>> {
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
    match kind {
        Axis::Linear => draw(&mut svg, (title, axis), x_range, y_range, lines),
        Axis::Logarithmic => draw(&mut svg, (title, axis), x_range.log_scale(), y_range, lines),
    }
    .context("cannot draw the plot")?;
    Ok(Some(svg))
}

/// Draws points (all on the axes) and lines between them; the legend stands right of the axes, where it hides nothing.
fn draw<X>(
    svg: &mut String,
    (title, axis): (&str, &str),
    x_range: X,
    y_range: Range<f64>,
    lines: &[Line<'_>],
) -> Result<()>
where
    X: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 20))
        .margin(14)
        .margin_right(14 + LEGEND_WIDTH)
        .x_label_area_size(48)
        .y_label_area_size(72)
        .build_cartesian_2d(x_range, y_range.log_scale())?;
    chart
        .configure_mesh()
        .x_desc(axis)
        .y_desc("relMSE without the worst 0.1 % of the pixels")
        .label_style(("sans-serif", 14))
        .x_label_formatter(&|x| format!("{x}"))
        .y_label_formatter(&|y| format!("{y:e}"))
        .light_line_style(BLACK.mix(0.06))
        .bold_line_style(BLACK.mix(0.15))
        .draw()?;
    let legend_x = SIZE.0 as i32 - LEGEND_WIDTH;
    for (index, (name, points)) in lines.iter().enumerate() {
        let style = COLORS[index % COLORS.len()].stroke_width(2);
        let dashed = index % 2 == 1;
        let points: Vec<_> = points.iter().copied().filter(drawable).collect();
        chart.draw_series(points.iter().map(|&at| Circle::new(at, 3, style.filled())))?;
        let y = 60 + 22 * index as i32;
        let sample = |from, to| PathElement::new([(legend_x + from, y), (legend_x + to, y)], style);
        if dashed {
            chart.draw_series(DashedLineSeries::new(points, 8, 5, style))?;
            area.draw(&sample(0, 10))?;
            area.draw(&sample(16, 26))?;
        } else {
            chart.draw_series(LineSeries::new(points, style))?;
            area.draw(&sample(0, 26))?;
        }
        area.draw(&Text::new(*name, (legend_x + 34, y - 7), ("sans-serif", 15)))?;
    }
    area.present()?;
    Ok(())
}

/// Whether a point has a place on logarithmic axes.
fn drawable((x, y): &(f64, f64)) -> bool {
    *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite()
}

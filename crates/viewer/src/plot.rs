//! Plots as SVG: lines over logarithmic axes, with a legend.

use anyhow::{Context, Result};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use std::ops::Range;

/// Colours that people with any kind of colour vision can tell apart (Okabe and Ito 2008); every other line is dashed, of
/// more than eight those which are not before.
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

/// Width of a letter of the legend and of the line sample before it, pixels.
const LEGEND_LETTER: i32 = 8;
const LEGEND_SAMPLE: i32 = 34;

/// What stands around a plot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Labels<'a> {
    /// Above it.
    pub(crate) title: &'a str,
    /// Below it.
    pub(crate) x: &'a str,
    /// Left of it.
    pub(crate) y: &'a str,
}

/// A line: what it is called, and its (x, y).
pub(crate) type Line<'a> = (&'a str, Vec<(f64, f64)>);

/// How the horizontal axis runs; the vertical one is always logarithmic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    Linear,
    Logarithmic,
}

/// The plot as SVG; `None` if there is nothing to draw.
pub(crate) fn plot(labels: Labels<'_>, kind: Axis, lines: &[Line<'_>]) -> Result<Option<String>> {
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
        Axis::Linear => draw(&mut svg, labels, x_range, y_range, lines),
        Axis::Logarithmic => draw(&mut svg, labels, x_range.log_scale(), y_range, lines),
    }
    .context("cannot draw the plot")?;
    Ok(Some(svg))
}

/// Draws points (all on the axes) and lines between them; the legend stands right of the axes, where it hides nothing.
fn draw<X>(svg: &mut String, labels: Labels<'_>, x_range: X, y_range: Range<f64>, lines: &[Line<'_>]) -> Result<()>
where
    X: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let letters = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let legend_width = LEGEND_SAMPLE + LEGEND_LETTER * letters as i32 + 14;
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(labels.title, ("sans-serif", 20))
        .margin(14)
        .margin_right(14 + legend_width)
        .x_label_area_size(48)
        .y_label_area_size(72)
        .build_cartesian_2d(x_range, y_range.log_scale())?;
    chart
        .configure_mesh()
        .x_desc(labels.x)
        .y_desc(labels.y)
        .label_style(("sans-serif", 14))
        .x_label_formatter(&|x| format!("{x}"))
        .y_label_formatter(&|&y| short(y))
        .light_line_style(BLACK.mix(0.06))
        .bold_line_style(BLACK.mix(0.15))
        .draw()?;
    let legend_x = SIZE.0 as i32 - legend_width;
    for (index, (name, points)) in lines.iter().enumerate() {
        let style = COLORS[index % COLORS.len()].stroke_width(2);
        let dashed = (index % 2 == 1) != (index / COLORS.len() % 2 == 1);
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
        area.draw(&Text::new(*name, (legend_x + LEGEND_SAMPLE, y - 7), ("sans-serif", 15)))?;
    }
    area.present()?;
    Ok(())
}

/// At most three significant digits: powers of ten computed by the plotter are not exact.
fn short(y: f64) -> String {
    let rounded: f64 = format!("{y:.2e}").parse().unwrap_or(y);
    format!("{rounded:e}")
}

/// Whether a point has a place on logarithmic axes.
fn drawable((x, y): &(f64, f64)) -> bool {
    *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite()
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn labels_are_short() {
        assert_eq!(short(0.000_099_999_999_999), "1e-4");
        assert_eq!(short(0.002_5), "2.5e-3");
    }
}

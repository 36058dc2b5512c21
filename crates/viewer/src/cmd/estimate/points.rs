//! The point sets: pictures, and their discrepancy against N.

use crate::output;
use crate::plot::{Axis, Labels, Line, plot};
use anyhow::Result;
use plotters::prelude::*;
use sampling::discrepancy::{l2_star, star_2d};
use sampling::points::PointSet;
use std::path::Path;

/// Points of a picture.
const PICTURED: usize = 256;

/// Pictures side by side.
const COLUMNS: usize = 4;

/// Width and height of a picture, and of the line with its name, pixels.
const PICTURE: u32 = 240;
const CAPTION: u32 = 30;

/// Base 2 logarithms of the numbers of points whose discrepancy is told.
const LOG_COUNTS: std::ops::RangeInclusive<u32> = 2..=12;

/// Seeds whose discrepancies are averaged.
const SEEDS: u64 = 4;

/// Writes `points.svg`, `discrepancy.svg` and `discrepancy.csv`.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_all(folder: &Path) -> Result<()> {
    output::write(&folder.join("points.svg"), pictures()?.as_bytes())?;
    let table = discrepancies();
    output::write_with(&folder.join("discrepancy.csv"), |file| {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record(["set", "points", "star_2d", "l2_star_2d"])?;
        for row in &table {
            csv.write_record([
                row.set.name().into(),
                row.count.to_string(),
                row.star.to_string(),
                row.l2.to_string(),
            ])?;
        }
        Ok(csv.flush()?)
    })?;
    let lines: Vec<Line<'_>> = table
        .chunk_by(|a, b| a.set == b.set)
        .map(|rows| {
            (
                rows[0].set.name(),
                rows.iter().map(|row| (row.count as f64, row.star)).collect(),
            )
        })
        .collect();
    let labels = Labels {
        title: "Star discrepancy in two dimensions",
        x: "points",
        y: "largest |share of points - area|",
    };
    if let Some(svg) = plot(labels, Axis::Logarithmic, &lines)? {
        output::write(&folder.join("discrepancy.svg"), svg.as_bytes())?;
    }
    Ok(())
}

/// The discrepancies of a set.
struct Discrepancy {
    set: PointSet,
    count: usize,
    star: f64,
    l2: f64,
}

/// All sets in two dimensions, each with rising numbers of points. Sets with a randomness of their own are averaged over seeds; the others are
/// taken as the literature has them.
fn discrepancies() -> Vec<Discrepancy> {
    let mut table = Vec::new();
    for set in PointSet::ALL {
        for log in LOG_COUNTS {
            let seeds = if set.is_random() {
                (0..SEEDS).map(Some).collect()
            } else {
                vec![None]
            };
            let of = |seed: &Option<u64>| {
                let points = set.points(1 << log, 2, *seed)?;
                Some((points.len(), star_2d(&points)?, l2_star(&points)?))
            };
            let all: Vec<(usize, f64, f64)> = seeds.iter().filter_map(of).collect();
            if let Some(&(count, ..)) = all.first() {
                table.push(Discrepancy {
                    set,
                    count,
                    star: all.iter().map(|d| d.1).sum::<f64>() / all.len() as f64,
                    l2: all.iter().map(|d| d.2).sum::<f64>() / all.len() as f64,
                });
            }
        }
    }
    table
}

/// The first points of every set in two dimensions, side by side.
fn pictures() -> Result<String> {
    let rows = PointSet::ALL.len().div_ceil(COLUMNS);
    let mut svg = String::new();
    let size = (COLUMNS as u32 * PICTURE, rows as u32 * (PICTURE + CAPTION));
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE)?;
        for (set, cell) in PointSet::ALL.iter().zip(area.split_evenly((rows, COLUMNS))) {
            let mut chart = ChartBuilder::on(&cell)
                .caption(set.name(), ("sans-serif", 16))
                .margin(8)
                .build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
            chart.configure_mesh().disable_mesh().disable_axes().draw()?;
            chart.draw_series([Rectangle::new([(0.0, 0.0), (1.0, 1.0)], BLACK.mix(0.4))])?;
            let seed = set.is_random().then_some(1);
            let points = set.points(PICTURED, 2, seed);
            let dots = points.iter().flat_map(|points| points.iter().map(|x| (x[0], x[1])));
            chart.draw_series(dots.map(|at| Circle::new(at, 2, BLACK.filled())))?;
        }
        area.present()?;
    }
    Ok(svg)
}

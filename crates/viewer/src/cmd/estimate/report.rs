//! Results as text, CSV and plots.

use super::describe;
use super::measure::{Curve, Point};
use crate::output;
use crate::plot::{Axis, Labels, Line, plot};
use crate::table::{align, number};
use anyhow::Result;
use sampling::estimators::{self, Family};
use sampling::integrands::Integrand;
use sampling::points::PointSet;
use std::path::Path;

/// The file of all measurements.
pub(super) const ESTIMATES: &str = "estimates.csv";

/// What there is to be compared.
pub(super) fn list(integrands: &[Box<dyn Integrand>]) -> String {
    let rows = integrands.iter().map(|integrand| {
        let techniques: Vec<&str> = integrand
            .techniques()
            .iter()
            .map(|technique| technique.name())
            .collect();
        vec![
            integrand.name().into(),
            integrand.dimensions().to_string(),
            number(integrand.integral()),
            techniques.join(", ")
                + if integrand.control().is_some() {
                    "; control variate"
                } else {
                    ""
                },
            integrand.description().into(),
        ]
    });
    let header = ["integrand", "dimensions", "integral", "techniques", "what it is"];
    let mut text = align(&header, &rows.collect::<Vec<_>>(), 5);
    for family in Family::ALL {
        text += &format!(
            "\nmethods of family '{}', which know {}:\n",
            family.name(),
            describe(family)
        );
        let mut names: Vec<String> = integrands
            .iter()
            .flat_map(|integrand| estimators::all(&**integrand))
            .filter(|method| method.family() == family)
            .map(|method| method.name())
            .collect();
        let mut seen = std::collections::HashSet::new();
        names.retain(|name| seen.insert(name.clone()));
        text += &names.iter().map(|name| format!("  {name}\n")).collect::<String>();
    }
    let sets = PointSet::ALL.map(|set| {
        let dimensions = set.dimensions();
        vec![
            set.name().to_string(),
            format!("{} to {}", dimensions.start(), dimensions.end()),
        ]
    });
    text + "\n" + &align(&["point set", "dimensions"], &sets, 2)
}

/// The curves by integrand, in order.
fn by_integrand(curves: &[Curve]) -> impl Iterator<Item = &[Curve]> {
    curves.chunk_by(|a, b| a.integrand == b.integrand)
}

/// A table for every integrand.
pub(super) fn tables(curves: &[Curve]) -> String {
    by_integrand(curves).map(table).collect()
}

fn table(curves: &[Curve]) -> String {
    // Crude Monte Carlo comes first, and applies everywhere.
    let crude = &curves[0];
    let header = [
        "family",
        "method",
        "evaluations",
        "error %",
        "rate",
        "+-",
        "bias/se",
        "x crude (evaluations)",
        "x crude (time)",
    ];
    let row = |curve: &Curve| {
        let last = curve.last();
        let rate = |value: fn(sampling::convergence::Rate) -> f64| match curve.rate {
            Some(rate) => format!("{:.2}", value(rate)),
            None => "-".into(),
        };
        vec![
            curve.family.name().into(),
            curve.method.clone() + if curve.biased { " *" } else { "" },
            format!("{:.0}", last.evaluations),
            number(last.error * 100.0),
            rate(|r| r.rate),
            rate(|r| r.half_width),
            format!("{:.1}", last.mean_error / last.mean_error_se),
            number(curve.efficiency_to(crude, |point| point.evaluations)),
            number(curve.efficiency_to(crude, |point| point.seconds)),
        ]
    };
    let rows: Vec<_> = curves.iter().map(row).collect();
    format!(
        "{}, {}-D\n{}\n",
        crude.integrand,
        crude.dimensions,
        align(&header, &rows, 2)
    )
}

/// Writes all that there is to `folder`.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_all(folder: &Path, curves: &[Curve]) -> Result<()> {
    write_estimates(&folder.join(ESTIMATES), curves)?;
    write_rates(&folder.join("rates.csv"), curves)?;
    by_integrand(curves).try_for_each(|curves| write_plots(folder, curves))
}

fn write_estimates(path: &Path, curves: &[Curve]) -> Result<()> {
    output::write_with(path, |file| {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record([
            "integrand",
            "dimensions",
            "family",
            "method",
            "biased",
            "samples",
            "evaluations",
            "relative_rmse",
            "relative_mean_error",
            "relative_mean_error_se",
            "relative_stated_error",
            "seconds",
        ])?;
        for curve in curves {
            for point in &curve.points {
                csv.write_record([
                    curve.integrand.clone(),
                    curve.dimensions.to_string(),
                    curve.family.name().into(),
                    curve.method.clone(),
                    curve.biased.to_string(),
                    point.samples.to_string(),
                    point.evaluations.to_string(),
                    point.error.to_string(),
                    point.mean_error.to_string(),
                    point.mean_error_se.to_string(),
                    point.stated_error.map_or(String::new(), |error| error.to_string()),
                    point.seconds.to_string(),
                ])?;
            }
        }
        Ok(csv.flush()?)
    })
}

fn write_rates(path: &Path, curves: &[Curve]) -> Result<()> {
    output::write_with(path, |file| {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record([
            "integrand",
            "method",
            "rate",
            "rate_half_width_95",
            "efficiency_evaluations_to_crude",
            "efficiency_seconds_to_crude",
        ])?;
        for curves in by_integrand(curves) {
            for curve in curves {
                csv.write_record([
                    curve.integrand.clone(),
                    curve.method.clone(),
                    curve.rate.map_or(String::new(), |rate| rate.rate.to_string()),
                    curve.rate.map_or(String::new(), |rate| rate.half_width.to_string()),
                    curve.efficiency_to(&curves[0], |point| point.evaluations).to_string(),
                    curve.efficiency_to(&curves[0], |point| point.seconds).to_string(),
                ])?;
            }
        }
        Ok(csv.flush()?)
    })
}

/// Error over evaluations and over seconds, for each family, crude Monte Carlo in all of them.
fn write_plots(folder: &Path, curves: &[Curve]) -> Result<()> {
    let crude = &curves[0];
    for family in Family::ALL {
        let of_family: Vec<&Curve> = curves.iter().skip(1).filter(|curve| curve.family == family).collect();
        if of_family.is_empty() {
            continue;
        }
        let shown = || std::iter::once(crude).chain(of_family.iter().copied());
        for (suffix, axis, x) in [
            (
                "evaluations",
                "evaluations of the integrand",
                (|point| point.evaluations) as fn(&Point) -> f64,
            ),
            ("seconds", "seconds of one thread", |point| point.seconds),
        ] {
            let line = |curve: &Curve| curve.points.iter().map(|point| (x(point), point.error)).collect();
            let lines: Vec<Line<'_>> = shown().map(|curve| (curve.method.as_str(), line(curve))).collect();
            let title = format!("{}: methods of family '{}'", crude.integrand, family.name());
            let labels = Labels {
                title: &title,
                x: axis,
                y: "root mean square error / integral",
            };
            if let Some(svg) = plot(labels, Axis::Logarithmic, &lines)? {
                let name = format!("{}-{}-{suffix}.svg", crude.integrand, family.name());
                output::write(&folder.join(name), svg.as_bytes())?;
            }
        }
    }
    Ok(())
}

//! `bench --stress`: inputs that break renderers, each with an answer that is known in closed form or in double precision.

mod bench;
mod builds;
mod choice;
mod emission;
mod invariance;
mod leaks;
mod numbers;
mod places;
mod report;
mod running;
mod scenes;
mod shapes;
mod sums;

use super::BenchArgs;
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::session;
use anyhow::Result;
pub(super) use bench::Effort;
use bench::{Bench, Stopped};
use report::Report;

/// A family of hazards: its name, and what checks it.
type Family = (&'static str, fn(&mut Bench) -> Result<()>);

const FAMILIES: [Family; 10] = [
    ("emission", emission::check),
    ("places", places::check),
    ("leaks", leaks::check),
    ("shapes", shapes::check),
    ("choice", choice::check),
    ("running", running::check),
    ("sums", sums::check),
    ("numbers", numbers::check),
    ("invariance", invariance::check),
    ("builds", builds::check),
];

/// The names of the families.
pub(super) fn families() -> [&'static str; FAMILIES.len()] {
    FAMILIES.map(|(name, _)| name)
}

/// Checks all hazards, or those of the families that are asked for.
///
/// # Errors
/// Files that cannot be written.
pub(super) fn run(args: &BenchArgs, effort: Effort) -> Result<Status> {
    super::make_output(&args.output, "stress.json")?;
    session::use_threads(args.light.threads)?;
    let watch = Watch::rendering();
    let asked = |name: &str| args.families.is_empty() || args.families.iter().any(|family| family == name);
    let families: Vec<Family> = FAMILIES.into_iter().filter(|(name, _)| asked(name)).collect();
    let names = families.iter().map(|(name, _)| *name).collect();
    let report = Report::new(args.output.join("stress.json"), names);
    let mut bench = Bench::new(effort, &watch, args.other_build.as_deref(), report);
    let checked = families.into_iter().try_for_each(|(family, check)| {
        bench.begin(family);
        check(&mut bench)
    });
    let interrupted = watch.writing();
    match checked {
        Err(error) if error.is::<Stopped>() => {}
        other => other?,
    }
    let report = bench.finish();
    let passed = report.passed();
    report.finish(!interrupted)?;
    Ok(match (interrupted, passed) {
        (true, _) => Status::Interrupted,
        (false, true) => Status::Done,
        (false, false) => Status::Failed,
    })
}

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
use crate::{message, output, session};
use anyhow::Result;
use bench::Bench;
pub(super) use bench::Effort;
use std::time::Instant;

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

/// Checks all hazards.
///
/// # Errors
/// Files that cannot be written.
pub(super) fn run(args: &BenchArgs, effort: Effort) -> Result<Status> {
    super::make_output(&args.output, "stress.json")?;
    session::use_threads(args.light.threads)?;
    let watch = Watch::rendering();
    let mut bench = Bench::new(effort, &watch, args.other_build.as_deref());
    for (family, check) in FAMILIES {
        let start = Instant::now();
        bench.begin(family);
        check(&mut bench)?;
        message::note(format!("{family}: {:.1} s", start.elapsed().as_secs_f64()));
        if watch.stopped() {
            break;
        }
    }
    let interrupted = watch.writing();
    output::print(&report::table(bench.checks()))?;
    let path = args.output.join("stress.json");
    output::write(&path, report::json(bench.checks())?.as_bytes())?;
    Ok(if interrupted {
        Status::Interrupted
    } else if bench.checks().iter().all(|check| check.passed) {
        Status::Done
    } else {
        Status::Failed
    })
}

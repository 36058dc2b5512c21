//! The checks as lines while they are made, as a table, and as JSON.

use super::bench::Check;
use crate::machine::Machine;
use crate::progress::Spinner;
use crate::{output, table};
use anyhow::Result;
use serde::Serialize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Results are written no more often: then no more of them are lost, should the program be ended from outside.
const BETWEEN_SAVES: Duration = Duration::from_secs(1);

/// All checks, and the file that they are kept in.
pub(super) struct Report {
    path: PathBuf,
    families: Vec<&'static str>,
    machine: Machine,
    spinner: Spinner,
    checks: Vec<Check>,
    saved: Instant,
}

impl Report {
    /// No check of `families` made yet; they will be written to `path`.
    pub(super) fn new(path: PathBuf, families: Vec<&'static str>) -> Self {
        Self {
            path,
            families,
            machine: Machine::detect(),
            spinner: Spinner::new(),
            checks: Vec::new(),
            saved: Instant::now(),
        }
    }

    /// Tells what is being checked, and keeps what is known.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn now(&mut self, what: &str) -> Result<()> {
        self.spinner.now(what);
        if self.saved.elapsed() >= BETWEEN_SAVES {
            self.save(false)?;
            self.saved = Instant::now();
        }
        Ok(())
    }

    /// Tells something.
    pub(super) fn line(&self, text: &str) {
        self.spinner.line(text);
    }

    /// Takes a check and tells its result.
    pub(super) fn enter(&mut self, check: Check) {
        self.spinner.line(&line(&check));
        self.checks.push(check);
    }

    /// Whether nothing failed.
    pub(super) fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed)
    }

    /// Writes the file; prints the table.
    ///
    /// # Errors
    /// Those of files.
    pub(super) fn finish(self, complete: bool) -> Result<()> {
        self.save(complete)?;
        drop(self.spinner);
        output::print(&table(&self.checks))
    }

    fn save(&self, complete: bool) -> Result<()> {
        #[derive(Serialize)]
        struct Document<'a> {
            version: &'static str,
            machine: &'a Machine,
            families: &'a [&'static str],
            /// Whether these were checked to their ends.
            complete: bool,
            passed: bool,
            checks: &'a [Check],
        }
        let document = Document {
            version: crate::machine::VERSION,
            machine: &self.machine,
            families: &self.families,
            complete,
            passed: self.passed(),
            // A deviation that is infinite or no number is null.
            checks: &self.checks,
        };
        output::write(&self.path, (serde_json::to_string_pretty(&document)? + "\n").as_bytes())
    }
}

/// One check, in columns that line up with those of the checks before and after it.
fn line(check: &Check) -> String {
    let verdict = if check.passed { "pass" } else { "FAIL" };
    format!(
        "{:>7.1} s  {verdict}  {:<10} {:<50} {:<22} {:>9} of {:>9} {}",
        check.seconds,
        check.family,
        check.hazard,
        check.subject,
        exact(check.deviation),
        exact(check.limit),
        check.measure,
    )
}

/// One line per hazard, with the subject that comes closest to the limit or goes furthest beyond; then all that failed.
fn table(checks: &[Check]) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut groups: Vec<Vec<&Check>> = Vec::new();
    for check in checks {
        let alike = |group: &&mut Vec<&Check>| {
            let first = group[0];
            (first.family, &first.hazard, first.measure) == (check.family, &check.hazard, check.measure)
        };
        match groups.iter_mut().find(alike) {
            Some(group) => group.push(check),
            None => groups.push(vec![check]),
        }
    }
    for group in groups {
        let worst = group.iter().copied().max_by(|a, b| strain(a).total_cmp(&strain(b)));
        let failed = group.iter().filter(|check| !check.passed).count();
        rows.extend(worst.map(|worst| {
            vec![
                worst.family.into(),
                worst.hazard.clone(),
                worst.measure.into(),
                worst.subject.clone(),
                group.len().to_string(),
                table::number(group.iter().map(|check| check.seconds).sum()),
                exact(worst.deviation),
                exact(worst.limit),
                if failed == 0 {
                    "pass".into()
                } else {
                    format!("{failed} FAIL")
                },
            ]
        }));
    }
    let header = [
        "family",
        "hazard",
        "deviation in",
        "worst of all",
        "checks",
        "seconds",
        "deviation",
        "limit",
        "result",
    ];
    let mut text = table::align(&header, &rows, 4);
    let failed: Vec<&Check> = checks.iter().filter(|check| !check.passed).collect();
    text += &format!("\n{} checks, {} failed\n", checks.len(), failed.len());
    for check in failed {
        text += &format!(
            "FAIL {}, {}, {}: {} {}, at most {} are allowed\n",
            check.family,
            check.hazard,
            check.subject,
            exact(check.deviation),
            check.measure,
            exact(check.limit)
        );
    }
    text
}

/// The deviation in limits; whatever fails comes last.
fn strain(check: &Check) -> f64 {
    match check.passed {
        true if check.limit > 0.0 => check.deviation / check.limit,
        true => 0.0,
        false if check.deviation.is_nan() => f64::INFINITY,
        false => 1.0 + check.deviation,
    }
}

/// A figure that may be infinite or no number, which is then what is wrong.
fn exact(value: f64) -> String {
    if value.is_finite() {
        table::number(value)
    } else {
        value.to_string()
    }
}

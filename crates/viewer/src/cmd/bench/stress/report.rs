//! The checks as a table and as JSON.

use super::bench::Check;
use crate::machine::Machine;
use crate::table;
use anyhow::Result;
use serde::Serialize;

/// One line per hazard, with the subject that comes closest to the limit or goes furthest beyond; then all that failed.
pub(super) fn table(checks: &[Check]) -> String {
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

/// All checks, and where they were made. A deviation that is infinite or no number is null.
///
/// # Errors
/// None that can be expected.
pub(super) fn json(checks: &[Check]) -> Result<String> {
    #[derive(Serialize)]
    struct Document<'a> {
        version: &'static str,
        machine: Machine,
        passed: bool,
        checks: &'a [Check],
    }
    let document = Document {
        version: crate::machine::VERSION,
        machine: Machine::detect(),
        passed: checks.iter().all(|check| check.passed),
        checks,
    };
    Ok(serde_json::to_string_pretty(&document)? + "\n")
}

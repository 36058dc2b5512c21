//! Messages to people, on stderr. A stderr that is gone is no reason to stop.

use std::fmt::Display;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

static QUIET: AtomicBool = AtomicBool::new(false);
static VERBOSE: AtomicBool = AtomicBool::new(false);

/// Quiet silences progress and notes, warnings and errors stay; verbose adds details.
pub(crate) fn set_level(quiet: bool, verbose: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
    VERBOSE.store(verbose, Ordering::Relaxed);
}

/// Whether progress and notes are silenced.
pub(crate) fn quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Something worth knowing.
pub(crate) fn note(text: impl Display) {
    if !quiet() {
        let _ = writeln!(std::io::stderr(), "{text}");
    }
}

/// Something for those who ask for it.
pub(crate) fn detail(text: impl Display) {
    if VERBOSE.load(Ordering::Relaxed) {
        note(text);
    }
}

/// Something that may be wrong.
pub(crate) fn warn(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}

/// Why the program ends: one line, the chain of causes included where the message does not tell them already.
pub(crate) fn error(error: &anyhow::Error) {
    let mut text = error.to_string();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    let _ = writeln!(std::io::stderr(), "error: {text}");
}

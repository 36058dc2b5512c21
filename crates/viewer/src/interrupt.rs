//! Ctrl-C and SIGTERM: stop rendering, write what is there.

use anyhow::{Context, Result};
use std::sync::atomic::{AtomicU8, Ordering};

/// Nothing to save: end at once.
const IDLE: u8 = 0;
/// Rendering: finish the frame and write it.
const RENDERING: u8 = 1;
/// Asked to stop, not yet stopped: a second signal ends at once.
const STOPPING: u8 = 2;
/// Writing files: wait, so that none is left half-written.
const WRITING: u8 = 3;

static PHASE: AtomicU8 = AtomicU8::new(IDLE);

/// Takes over the signals.
///
/// # Errors
/// If the system does not allow it.
pub(crate) fn install() -> Result<()> {
    ctrlc::set_handler(|| match PHASE.load(Ordering::SeqCst) {
        RENDERING => PHASE.store(STOPPING, Ordering::SeqCst),
        WRITING => {}
        _ => std::process::exit(130),
    })
    .context("cannot watch for Ctrl-C")?;
    survive_file_size_limits()
}

/// A file that grows beyond the limit of the shell (`ulimit -f`) is to be an error like a full disk, not the end of the process.
fn survive_file_size_limits() -> Result<()> {
    #[cfg(unix)]
    {
        use signal_hook::{consts::SIGXFSZ, flag};
        use std::sync::{Arc, atomic::AtomicBool};
        // Whether it came is of no interest: the write that caused it fails.
        flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).context("cannot watch for limits of file sizes")?;
    }
    Ok(())
}

/// While it lives, a signal asks to stop and does not end the program.
pub(crate) struct Watch(());

impl Watch {
    /// Begins to watch.
    pub(crate) fn rendering() -> Self {
        PHASE.store(RENDERING, Ordering::SeqCst);
        Self(())
    }

    /// Whether a signal has come.
    pub(crate) fn stopped(&self) -> bool {
        PHASE.load(Ordering::SeqCst) == STOPPING
    }

    /// Files are being written from now on; whether a signal had come before.
    pub(crate) fn writing(&self) -> bool {
        PHASE.swap(WRITING, Ordering::SeqCst) == STOPPING
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        PHASE.store(IDLE, Ordering::SeqCst);
    }
}

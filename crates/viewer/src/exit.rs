//! What the process ends with.

use std::process::ExitCode;

/// How a command ended, other than by an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    /// All is done.
    Done = 0,
    /// A comparison was above its threshold.
    Failed = 1,
    /// Bad usage or input.
    Usage = 2,
    /// Ctrl-C or SIGTERM; what was there has been written.
    Interrupted = 130,
}

impl From<Status> for ExitCode {
    fn from(status: Status) -> Self {
        Self::from(status as u8)
    }
}

/// Errors with an exit code of their own; all others are bad usage or input, 2.
#[derive(Debug)]
pub(crate) enum Refusal {
    /// There is no GPU to be used.
    NoGpu(String),
    /// The job does not fit into memory, or the GPU is lost.
    OutOfMemory(String),
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoGpu(text) | Self::OutOfMemory(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for Refusal {}

/// The exit code of an error.
pub(crate) fn code_of(error: &anyhow::Error) -> ExitCode {
    match error.downcast_ref() {
        Some(Refusal::NoGpu(_)) => ExitCode::from(3),
        Some(Refusal::OutOfMemory(_)) => ExitCode::from(4),
        None => Status::Usage.into(),
    }
}

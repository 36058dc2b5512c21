//! What can go wrong with rendering and with image files.

use std::path::PathBuf;

/// Why an image could not be rendered, read or written.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A setting out of its range.
    #[error("{what}; {remedy}")]
    Setting {
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// A rendering could not be stopped, continued or divided.
    #[error("{what}")]
    State {
        /// Why not.
        what: String,
    },
    /// A part of the scene that was left in its file could not be read when a ray first needed it.
    #[error("{0}")]
    Scene(String),
    /// An image file could not be read.
    #[error("{path}: cannot read image: {reason}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// An image file could not be written; nothing of it was left behind.
    #[error("{path}: cannot write image: {reason}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// No GPU, or no more.
    #[error("{what}")]
    Gpu {
        /// The kind of it.
        fault: GpuFault,
        /// What is wrong and what to do.
        what: String,
    },
}

/// What can be wrong with a GPU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GpuFault {
    /// There is none that can be used.
    NoAdapter,
    /// It stopped working, and why.
    Lost(String),
    /// Scene or image do not fit into it.
    OutOfMemory,
}

impl GpuFault {
    pub(crate) fn error(self, what: String) -> RenderError {
        RenderError::Gpu { fault: self, what }
    }
}

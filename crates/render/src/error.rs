//! What can go wrong with rendering and with image files.

use std::path::PathBuf;

/// Why an image could not be rendered, read or written.
#[derive(Debug, thiserror::Error)]
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
}

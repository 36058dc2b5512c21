//! What can go wrong with a scene, said so that its author can mend it.

use std::path::PathBuf;

/// Why a scene could not be made. Every message names what, where and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file could not be read.
    #[error("{path}: cannot read {what}: {source}; check the path and its permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// What it was wanted for ("scene", "buffer 0", "image 'wood'").
        what: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is not what it should be.
    #[error("{path}: {place}: {problem}; {remedy}")]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Where in it ("node 3 'lamp'", "accessor 7").
        place: String,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: String,
    },
    /// No generated scene of that name, or unusable parameters.
    #[error("demo:{name}: {problem}; try one of: {known}")]
    Demo {
        /// The name asked for.
        name: String,
        /// What is wrong.
        problem: String,
        /// The names there are.
        known: String,
    },
    /// Writing an export failed.
    #[error("{path}: cannot write: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

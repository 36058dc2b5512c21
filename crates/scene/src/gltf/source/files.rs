//! Files that a scene is read from: opened as regular files only, and remembered as they were.

use crate::SceneError;
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A file as it was when it was read.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::gltf) struct Seen {
    path: PathBuf,
    pub(super) len: u64,
    /// Where the system tells.
    modified: Option<SystemTime>,
}

impl Seen {
    fn new(path: &Path, metadata: &Metadata) -> Self {
        Self {
            path: path.into(),
            len: metadata.len(),
            modified: metadata.modified().ok(),
        }
    }

    /// The bytes of the file, which `scene` wants for `what`.
    ///
    /// # Errors
    /// [`SceneError`] for one that cannot be read, or has changed.
    pub(in crate::gltf) fn read(&self, scene: &Path, what: &str) -> Result<Vec<u8>, SceneError> {
        let (bytes, now) = read_file(scene, &self.path, what)?;
        match now == *self {
            true => Ok(bytes),
            false => Err(self.changed(scene)),
        }
    }

    pub(super) fn changed(&self, scene: &Path) -> SceneError {
        invalid(
            scene,
            self.path.display().to_string(),
            "was changed while the scene was in use",
            "load it again once it is written",
        )
    }

    /// Whether the file is no longer what it was.
    pub(super) fn has_changed(&self) -> bool {
        self.path.metadata().map_or(true, |now| {
            now.len() != self.len || now.modified().ok() != self.modified
        })
    }
}

/// Reads `file`, which is wanted as a part of `scene`.
pub(super) fn read_file(scene: &Path, file: &Path, what: &str) -> Result<(Vec<u8>, Seen), SceneError> {
    let read = || {
        let (mut opened, seen) = open_file(file)?;
        let mut bytes = Vec::new();
        opened.read_to_end(&mut bytes)?;
        Ok((bytes, seen))
    };
    read().map_err(|source| wanted(scene, file, what, source))
}

/// `file`, which is wanted as a part of `scene`, cannot be read.
pub(super) fn wanted(scene: &Path, file: &Path, what: &str, source: io::Error) -> SceneError {
    SceneError::Read {
        path: file.into(),
        what: format!("{what} of {}", scene.display()),
        source,
    }
}

/// Opens regular files only: a URI must not make us wait for a pipe or read a device without end.
pub(super) fn open_file(file: &Path) -> io::Result<(File, Seen)> {
    if !std::fs::metadata(file)?.is_file() {
        return Err(io::Error::other("not a regular file"));
    }
    // Of the file that is opened, which may be another by now.
    let opened = File::open(file)?;
    let seen = Seen::new(file, &opened.metadata()?);
    Ok((opened, seen))
}

/// Shorthand for [`SceneError::Invalid`].
pub(in crate::gltf) fn invalid(
    path: &Path,
    place: impl Into<String>,
    problem: impl Into<String>,
    remedy: impl Into<String>,
) -> SceneError {
    SceneError::Invalid {
        path: path.into(),
        place: place.into(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

pub(super) fn unreadable(path: &Path, source: io::Error) -> SceneError {
    SceneError::Read {
        path: path.into(),
        what: "scene".into(),
        source,
    }
}

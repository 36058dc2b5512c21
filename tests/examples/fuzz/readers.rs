//! The readers: those of `viewer` that take bytes, and those that want a file.

use scene::Scene;
use std::ffi::OsString;
use std::io::{Error, Result};
use std::path::Path;
use viewer::untrusted::READERS;

/// Name and content.
pub(crate) type File = (OsString, Vec<u8>);

/// The names of all readers.
pub(crate) fn names() -> Vec<&'static str> {
    let others = ["gltf", "exr"];
    READERS.iter().map(|(name, _)| *name).chain(others).collect()
}

/// A reader with what it is given.
pub(crate) struct Reader {
    name: String,
    files: Vec<File>,
    kind: Kind,
    folder: tempfile::TempDir,
}

/// How it reads.
enum Kind {
    Bytes(viewer::untrusted::Reader),
    Gltf,
    Exr,
}

impl Reader {
    /// The one of that name; `files` are what it reads undamaged.
    pub(crate) fn new(name: &str, files: Vec<File>) -> Result<Self> {
        let kind = match name {
            "gltf" => Kind::Gltf,
            "exr" => Kind::Exr,
            _ => {
                let found = READERS.iter().find(|(known, _)| *known == name);
                let (_, reader) = found.ok_or_else(|| Error::other(format!("no reader '{name}'")))?;
                Kind::Bytes(*reader)
            }
        };
        Ok(Self {
            name: name.into(),
            files,
            kind,
            folder: tempfile::tempdir()?,
        })
    }

    /// Its name.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// What it takes undamaged.
    pub(crate) fn corpus(&mut self) -> Result<Vec<File>> {
        let mut corpus = std::mem::take(&mut self.files);
        match &self.kind {
            Kind::Bytes(_) => {}
            Kind::Gltf => {
                // What they refer to lies beside them.
                for (name, bytes) in &corpus {
                    std::fs::write(self.folder.path().join(name), bytes)?;
                }
                corpus.retain(|(name, _)| [Some("gltf"), Some("glb")].contains(&extension(name)));
            }
            Kind::Exr => corpus.retain(|(name, _)| extension(name) == Some("exr")),
        }
        if corpus.is_empty() {
            return Err(Error::other("no files for this reader in the folders"));
        }
        Ok(corpus)
    }

    /// Whether it takes `bytes`, damaged from the file `name`.
    pub(crate) fn read(&self, name: &OsString, bytes: &[u8]) -> bool {
        let file = || {
            let path = self
                .folder
                .path()
                .join("damaged")
                .with_extension(extension(name).unwrap_or_default());
            std::fs::write(&path, bytes).expect("the temporary folder can be written");
            path
        };
        match &self.kind {
            Kind::Bytes(reader) => reader(bytes),
            Kind::Gltf => scene::gltf::read(&file()).and_then(Scene::new).is_ok(),
            Kind::Exr => render::image::read_exr(&file()).is_ok(),
        }
    }
}

fn extension(name: &OsString) -> Option<&str> {
    Path::new(name).extension()?.to_str()
}

//! The file and what lies beside it: container, JSON, buffers, data URIs. The binary chunk of a large file stays on the disk.

mod container;
mod files;
mod uri;

use super::json::{self, Index, Root, View};
use crate::SceneError;
use container::{Buffer, Opened, split};
pub(super) use files::{Seen, invalid};
use files::{open_file, read_file, unreadable, wanted};
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use uri::{decode_base64, decode_percent};

/// A glTF file with its JSON parsed and its buffers read.
#[derive(Debug)]
pub(super) struct Source {
    path: PathBuf,
    /// The JSON.
    pub(super) json: Root,
    /// One entry per buffer of the JSON, each exactly `byteLength` long; `None` for one whose bytes come from nowhere,
    /// which is no error until something reads it.
    buffers: Vec<Option<Buffer>>,
    /// Bytes read so far: what the sizes of everything made from the file are measured by.
    pub(super) bytes: u64,
    /// All files read so far, as they were then.
    seen: Mutex<Vec<Seen>>,
}

impl Source {
    /// Reads `path` and its buffers; the binary chunk of a `.glb` of more than `max_whole` bytes is read when it is asked for.
    ///
    /// # Errors
    /// [`SceneError::Read`] for a missing file or buffer, [`SceneError::Invalid`] for what is not glTF 2.0 or requires an
    /// unsupported extension.
    pub(super) fn open(path: &Path, max_whole: u64) -> Result<Self, SceneError> {
        let opened = Opened::new(path, max_whole)?;
        let bytes = opened.buffer.len();
        let (text, blob) = split(path, &opened.buffer)?;
        let json = opened.buffer.range(text).map_err(|error| unreadable(path, error))?;
        // A byte order mark is not allowed, but some editors leave one.
        let json = json::parse(json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&json)).map_err(|error| {
            invalid(
                path,
                "JSON",
                error.to_string(),
                "export the file again as glTF 2.0, or correct the JSON",
            )
        })?;
        let mut source = Self {
            path: path.into(),
            json,
            buffers: Vec::new(),
            bytes,
            seen: Mutex::new(vec![opened.seen]),
        };
        source.check_version()?;
        // First, because extensions for compression leave buffers out.
        super::census::refuse_required(&source)?;
        source.read_buffers(opened.buffer, blob)?;
        Ok(source)
    }

    /// Where the file is.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the bytes of a buffer view have stayed on the disk.
    pub(super) fn is_on_disk(&self, view: Index<View>, place: &str) -> Result<bool, SceneError> {
        let (buffer, _) = self.locate(view, place)?;
        Ok(matches!(buffer, Buffer::Disk { .. }))
    }

    /// Whether there are bytes that have stayed on the disk.
    pub(super) fn on_disk(&self) -> bool {
        self.buffers
            .iter()
            .flatten()
            .any(|buffer| matches!(buffer, Buffer::Disk { .. }))
    }

    /// Shorthand for [`SceneError::Invalid`] about this file.
    pub(super) fn invalid(
        &self,
        place: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> SceneError {
        invalid(&self.path, place, problem, remedy)
    }

    /// For an index that leads nowhere.
    pub(super) fn no_such(&self, place: impl Into<String>, what: &str, index: usize, len: usize) -> SceneError {
        self.invalid(
            place,
            format!("{what} {index} does not exist, the file has {len}"),
            "export the file again",
        )
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: Index<View>, place: &str) -> Result<Cow<'_, [u8]>, SceneError> {
        let length = self.view_length(index, place)?;
        self.range(index, 0..length, place)
    }

    /// The length of a buffer view, all of which is there.
    pub(super) fn view_length(&self, index: Index<View>, place: &str) -> Result<u64, SceneError> {
        self.locate(index, place).map(|(_, range)| range.end - range.start)
    }

    /// Bytes of a buffer view, within its length.
    pub(super) fn range(&self, index: Index<View>, part: Range<u64>, place: &str) -> Result<Cow<'_, [u8]>, SceneError> {
        let (buffer, range) = self.locate(index, place)?;
        buffer
            .range(range.start + part.start..range.start + part.end)
            .map_err(|error| unreadable(&self.path, error))
    }

    /// Where the bytes of a buffer view are.
    fn locate(&self, index: Index<View>, place: &str) -> Result<(&Buffer, Range<u64>), SceneError> {
        let (views, index) = (&self.json.buffer_views, index.value());
        let view = views
            .get(index)
            .ok_or_else(|| self.no_such(place, "bufferView", index, views.len()))?;
        let (number, offset, length) = (
            view.buffer.value(),
            view.byte_offset.unwrap_or_default().0,
            view.byte_length.0,
        );
        let buffer = self
            .buffers
            .get(number)
            .ok_or_else(|| self.no_such(format!("bufferView {index}"), "buffer", number, self.buffers.len()))?;
        let Some(buffer) = buffer else {
            return Err(self.invalid(
                format!("buffer {number}"),
                "has no URI, and there is no binary chunk for it",
                "export the file again, with its buffers",
            ));
        };
        let end = offset.checked_add(length).filter(|&end| end <= buffer.len());
        end.map(|end| (buffer, offset..end)).ok_or_else(|| {
            self.invalid(
                format!("bufferView {index}"),
                format!(
                    "claims {length} bytes at {offset}, but buffer {number} has {}",
                    buffer.len()
                ),
                "the file is damaged: export it again",
            )
        })
    }

    /// The bytes that `uri` names: a data URI or a file beside this one.
    pub(super) fn resolve(&self, uri: &str, what: &str) -> Result<Vec<u8>, SceneError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let decoded = match data.split_once(',') {
                Some((head, body)) if head.ends_with(";base64") => decode_base64(body.as_bytes()),
                Some((_, body)) => Some(decode_percent(body)),
                None => None,
            };
            return decoded.ok_or_else(|| self.invalid(what, "unreadable data URI", "export the file again"));
        }
        let (bytes, seen) = read_file(&self.path, &self.path_beside(uri, what)?, what)?;
        self.note(seen);
        Ok(bytes)
    }

    /// The file beside this one that `uri` names, as it is, to be read later; `None` for a data URI.
    pub(super) fn beside(&self, uri: &str, what: &str) -> Result<Option<Seen>, SceneError> {
        if uri.starts_with("data:") {
            return Ok(None);
        }
        let path = self.path_beside(uri, what)?;
        let (_, seen) = open_file(&path).map_err(|source| wanted(&self.path, &path, what, source))?;
        self.note(seen.clone());
        Ok(Some(seen))
    }

    fn note(&self, seen: Seen) {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).push(seen);
    }

    /// Where the file is that a relative URI names.
    fn path_beside(&self, uri: &str, what: &str) -> Result<PathBuf, SceneError> {
        let relative = String::from_utf8(decode_percent(uri)).map_err(|_| {
            self.invalid(
                what,
                format!("URI '{uri}' is not UTF-8"),
                "rename the file and correct the URI",
            )
        })?;
        let scheme = relative
            .split_once(':')
            .is_some_and(|(scheme, _)| scheme.len() > 1 && scheme.chars().all(|c| c.is_ascii_alphanumeric()));
        if scheme || relative.contains('\0') || Path::new(&relative).has_root() || relative.is_empty() {
            return Err(self.invalid(
                what,
                format!("URI '{uri}' is not a path relative to the file"),
                "put what it names beside the file and use a relative path",
            ));
        }
        let folder = self.path.parent().unwrap_or(Path::new(""));
        Ok(folder.join(relative))
    }

    /// Makes sure that everything was read from the same state of the files.
    ///
    /// # Errors
    /// [`SceneError::Invalid`] for one that has been replaced or changed since it was read: it need not fit the others.
    pub(super) fn check_unchanged(&self) -> Result<(), SceneError> {
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        match seen.iter().find(|file| file.has_changed()) {
            None => Ok(()),
            Some(file) => Err(file.changed(&self.path)),
        }
    }

    fn check_version(&self) -> Result<(), SceneError> {
        let asset = &self.json.asset;
        let refuse = |problem: String| self.invalid("asset", problem, "export the file as glTF 2.0");
        if asset.version.split('.').next() != Some("2") {
            return Err(refuse(format!("glTF version '{}'", asset.version)));
        }
        match asset.min_version.as_deref() {
            None | Some("2.0") => Ok(()),
            Some(other) => Err(refuse(format!("needs a reader of glTF version '{other}'"))),
        }
    }

    /// Reads all buffers; the first may be the part `blob` of the file itself.
    fn read_buffers(&mut self, file: Buffer, blob: Option<Range<u64>>) -> Result<(), SceneError> {
        let mut blob = blob.map(|blob| file.part(blob));
        for index in 0..self.json.buffers.len() {
            let buffer = &self.json.buffers[index];
            let (place, length) = (format!("buffer {index}"), buffer.byte_length.0);
            let mut data = match (&buffer.uri, index, blob.take()) {
                (Some(uri), _, _) => Buffer::Memory(self.resolve(uri, &place)?),
                (None, 0, Some(blob)) => blob,
                (None, _, _) => {
                    self.buffers.push(None);
                    continue;
                }
            };
            if data.len() < length {
                return Err(self.invalid(
                    place,
                    format!("claims {length} bytes, but there are {}", data.len()),
                    "the buffer is cut short: copy or export it again",
                ));
            }
            if buffer.uri.as_deref().is_some_and(|uri| !uri.starts_with("data:")) {
                self.bytes += data.len();
            }
            data.truncate(length);
            self.buffers.push(Some(data));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_change_meanwhile_are_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let json = r#"{ "asset": { "version": "2.0" }, "buffers": [{ "byteLength": 4, "uri": "a.bin" }] }"#;
        std::fs::write(at("a.gltf"), json).unwrap();
        std::fs::write(at("a.bin"), "1234").unwrap();
        for name in ["a.bin", "a.gltf"] {
            let source = Source::open(&at("a.gltf"), u64::MAX).unwrap();
            source.check_unchanged().unwrap();
            let longer = std::fs::read_to_string(at(name)).unwrap() + " ";
            std::fs::write(at(name), longer).unwrap();
            let error = source.check_unchanged().unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("changed"), "{error}");
        }
        let source = Source::open(&at("a.gltf"), u64::MAX).unwrap();
        std::fs::remove_file(at("a.bin")).unwrap();
        assert!(source.check_unchanged().is_err());
    }
}

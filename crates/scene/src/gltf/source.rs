//! The file and what lies beside it: container, JSON, buffers, data URIs.

use super::json::{self, Index, Root, View};
use crate::SceneError;
use std::fs::{File, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// A glTF file with its JSON parsed and its buffers read.
#[derive(Debug)]
pub(super) struct Source {
    path: PathBuf,
    /// The JSON.
    pub(super) json: Root,
    /// One entry per buffer of the JSON, each exactly `byteLength` long; `None` for one whose bytes come from nowhere,
    /// which is no error until something reads it.
    buffers: Vec<Option<Vec<u8>>>,
    /// Bytes read so far: what the sizes of everything made from the file are measured by.
    pub(super) bytes: u64,
    /// All files read so far, as they were then.
    seen: Mutex<Vec<Seen>>,
}

/// A file as it was when it was read.
#[derive(Debug)]
struct Seen {
    path: PathBuf,
    len: u64,
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

    /// Whether the file is no longer what it was.
    fn has_changed(&self) -> bool {
        self.path.metadata().map_or(true, |now| {
            now.len() != self.len || now.modified().ok() != self.modified
        })
    }
}

impl Source {
    /// Reads `path` and its buffers.
    ///
    /// # Errors
    /// [`SceneError::Read`] for a missing file or buffer, [`SceneError::Invalid`] for what is not glTF 2.0 or requires an
    /// unsupported extension.
    pub(super) fn open(path: &Path) -> Result<Self, SceneError> {
        let (file, seen) = read_file(path, path, "scene")?;
        let bytes = file.len() as u64;
        let (text, blob) = split(path, &file)?;
        // A byte order mark is not allowed, but some editors leave one.
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        let json: Root = json::parse(text).map_err(|error| {
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
            seen: Mutex::new(vec![seen]),
        };
        source.check_version()?;
        // First, because extensions for compression leave buffers out.
        super::census::refuse_required(&source)?;
        source.read_buffers(blob)?;
        Ok(source)
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
    pub(super) fn view(&self, index: Index<View>, place: &str) -> Result<&[u8], SceneError> {
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
        let range = usize::try_from(offset)
            .ok()
            .zip(usize::try_from(length).ok())
            .and_then(|(start, length)| Some(start..start.checked_add(length)?));
        range.and_then(|range| buffer.get(range)).ok_or_else(|| {
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
        let (bytes, seen) = read_file(&self.path, &folder.join(relative), what)?;
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).push(seen);
        Ok(bytes)
    }

    /// Makes sure that everything was read from the same state of the files.
    ///
    /// # Errors
    /// [`SceneError::Invalid`] for one that has been replaced or changed since it was read: it need not fit the others.
    pub(super) fn check_unchanged(&self) -> Result<(), SceneError> {
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        match seen.iter().find(|file| file.has_changed()) {
            None => Ok(()),
            Some(file) => Err(self.invalid(
                file.path.display().to_string(),
                "was changed while the scene was loading",
                "load it again once it is written",
            )),
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

    fn read_buffers(&mut self, blob: Option<&[u8]>) -> Result<(), SceneError> {
        for index in 0..self.json.buffers.len() {
            let buffer = &self.json.buffers[index];
            let (place, length) = (format!("buffer {index}"), buffer.byte_length.0);
            let mut data = match (&buffer.uri, index, blob) {
                (Some(uri), _, _) => self.resolve(uri, &place)?,
                (None, 0, Some(blob)) => blob.to_vec(),
                (None, _, _) => {
                    self.buffers.push(None);
                    continue;
                }
            };
            if (data.len() as u64) < length {
                return Err(self.invalid(
                    place,
                    format!("claims {length} bytes, but there are {}", data.len()),
                    "the buffer is cut short: copy or export it again",
                ));
            }
            if buffer.uri.as_deref().is_some_and(|uri| !uri.starts_with("data:")) {
                self.bytes += data.len() as u64;
            }
            data.truncate(length as usize);
            self.buffers.push(Some(data));
        }
        Ok(())
    }
}

fn invalid(path: &Path, place: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> SceneError {
    SceneError::Invalid {
        path: path.into(),
        place: place.into(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

/// Reads `file`; errors about a part name `scene` too. Only regular files: a URI must not make us wait for a pipe or
/// read a device without end.
fn read_file(scene: &Path, file: &Path, what: &str) -> Result<(Vec<u8>, Seen), SceneError> {
    let error = |source: std::io::Error| SceneError::Read {
        path: file.into(),
        what: if scene == file {
            what.into()
        } else {
            format!("{what} of {}", scene.display())
        },
        source,
    };
    let metadata = std::fs::metadata(file).map_err(error)?;
    if !metadata.is_file() {
        return Err(error(std::io::Error::other("not a regular file")));
    }
    // Of the file that is opened, which may be another by now.
    let read = || {
        let mut opened = File::open(file)?;
        let seen = Seen::new(file, &opened.metadata()?);
        let mut bytes = Vec::new();
        opened.read_to_end(&mut bytes)?;
        Ok((bytes, seen))
    };
    read().map_err(error)
}

/// Splits a file into JSON and binary chunk (glTF 2.0 section 4.4); a file without the magic number is all JSON.
/// Not by `gltf::binary`, which refuses files with chunks of unknown types, and underflows on a length below 12.
fn split<'a>(path: &Path, file: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>), SceneError> {
    if !file.starts_with(b"glTF") {
        return Ok((file, None));
    }
    let damaged = |problem: String| {
        invalid(
            path,
            "GLB container",
            problem,
            "the file is damaged: copy or export it again",
        )
    };
    let word = |at: usize| -> Option<u32> {
        let bytes = file.get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().expect("four bytes")))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(damaged(format!("the header is cut short at {} bytes", file.len())));
    };
    if version != 2 {
        return Err(invalid(
            path,
            "GLB container",
            format!("version {version}"),
            "export the file as glTF 2.0",
        ));
    }
    if length as usize > file.len() {
        return Err(damaged(format!(
            "claims {length} bytes, but the file has {}",
            file.len()
        )));
    }
    let (mut at, mut json, mut blob) = (12, None, None);
    while let (Some(size), Some(kind)) = (word(at), word(at + 4)) {
        let start = at + 8;
        let chunk = file.get(start..start + size as usize).ok_or_else(|| {
            damaged(format!(
                "a chunk claims {size} bytes at {start}, but the file has {}",
                file.len()
            ))
        })?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if blob.is_none() => blob = Some(chunk),
            // Section 4.4.3.1: clients must ignore chunks with unknown types.
            _ => {}
        }
        at = start + size as usize;
    }
    Ok((json.ok_or_else(|| damaged("there is no JSON chunk".into()))?, blob))
}

/// Undoes percent encoding; a stray percent sign stands for itself.
fn decode_percent(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).and_then(|&b| (b as char).to_digit(16));
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((high * 16 + low) as u8);
                at += 3;
            }
            (byte, _, _) => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    decoded
}

/// Decodes base64 (RFC 4648, both alphabets); white space and padding are skipped. `None` for any other character.
fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let mut decoded = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut held) = (0_u32, 0);
    for &byte in text {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b' ' | b'\n' | b'\r' | b'\t' => continue,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            decoded.push((bits >> held) as u8);
            bits &= (1 << held) - 1;
        }
    }
    Some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_every_length() {
        assert_eq!(decode_base64(b"").unwrap(), b"");
        assert_eq!(decode_base64(b"Zg==").unwrap(), b"f");
        assert_eq!(decode_base64(b"Zm8=").unwrap(), b"fo");
        assert_eq!(decode_base64(b"Zm9v\nYmFy").unwrap(), b"foobar");
        assert_eq!(decode_base64(b"_-8").unwrap(), decode_base64(b"/+8=").unwrap());
        assert!(decode_base64(b"Zm9v!").is_none());
    }

    #[test]
    fn files_that_change_meanwhile_are_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let json = r#"{ "asset": { "version": "2.0" }, "buffers": [{ "byteLength": 4, "uri": "a.bin" }] }"#;
        std::fs::write(at("a.gltf"), json).unwrap();
        std::fs::write(at("a.bin"), "1234").unwrap();
        for name in ["a.bin", "a.gltf"] {
            let source = Source::open(&at("a.gltf")).unwrap();
            source.check_unchanged().unwrap();
            let longer = std::fs::read_to_string(at(name)).unwrap() + " ";
            std::fs::write(at(name), longer).unwrap();
            let error = source.check_unchanged().unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("changed"), "{error}");
        }
        let source = Source::open(&at("a.gltf")).unwrap();
        std::fs::remove_file(at("a.bin")).unwrap();
        assert!(source.check_unchanged().is_err());
    }

    #[test]
    fn percent_encoding() {
        assert_eq!(decode_percent("a%20b%C5%99"), "a b\u{159}".as_bytes());
        assert_eq!(decode_percent("100%"), b"100%");
        assert_eq!(decode_percent("%zz%2"), b"%zz%2");
    }
}

//! The file and what lies beside it: container, JSON, buffers, data URIs. The binary chunk of a large file stays on the disk.

use super::json::{self, Index, Root, View};
use crate::SceneError;
use std::borrow::Cow;
use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
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
    buffers: Vec<Option<Buffer>>,
    /// Bytes read so far: what the sizes of everything made from the file are measured by.
    pub(super) bytes: u64,
    /// All files read so far, as they were then.
    seen: Mutex<Vec<Seen>>,
}

/// The bytes of a buffer.
#[derive(Debug)]
enum Buffer {
    Memory(Vec<u8>),
    /// A part of a file, read piece by piece. Not mapped into memory: another program that shortens the file would end this one.
    Disk {
        file: Mutex<File>,
        part: Range<u64>,
    },
}

impl Buffer {
    fn len(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::Disk { part, .. } => part.end - part.start,
        }
    }

    fn truncate(&mut self, length: u64) {
        match self {
            Self::Memory(bytes) => bytes.truncate(length as usize),
            Self::Disk { part, .. } => part.end = part.end.min(part.start.saturating_add(length)),
        }
    }

    /// A part of it, which lies within.
    fn part(self, range: Range<u64>) -> Self {
        match self {
            Self::Memory(mut bytes) => {
                bytes.truncate(range.end as usize);
                bytes.drain(..range.start as usize);
                Self::Memory(bytes)
            }
            Self::Disk { file, part } => Self::Disk {
                file,
                part: part.start + range.start..part.start + range.end,
            },
        }
    }

    /// Bytes within the buffer.
    fn range(&self, range: Range<u64>) -> io::Result<Cow<'_, [u8]>> {
        match self {
            Self::Memory(bytes) => Ok(bytes[range.start as usize..range.end as usize].into()),
            Self::Disk { file, part } => {
                let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                let mut bytes = vec![0; (range.end - range.start) as usize];
                file.seek(SeekFrom::Start(part.start + range.start))?;
                file.read_exact(&mut bytes)?;
                Ok(bytes.into())
            }
        }
    }
}

/// A file as it was when it was read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Seen {
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

    /// The bytes of the file, which `scene` wants for `what`.
    ///
    /// # Errors
    /// [`SceneError`] for one that cannot be read, or has changed.
    pub(super) fn read(&self, scene: &Path, what: &str) -> Result<Vec<u8>, SceneError> {
        let (bytes, now) = read_file(scene, &self.path, what)?;
        match now == *self {
            true => Ok(bytes),
            false => Err(self.changed(scene)),
        }
    }

    fn changed(&self, scene: &Path) -> SceneError {
        invalid(
            scene,
            self.path.display().to_string(),
            "was changed while the scene was in use",
            "load it again once it is written",
        )
    }

    /// Whether the file is no longer what it was.
    fn has_changed(&self) -> bool {
        self.path.metadata().map_or(true, |now| {
            now.len() != self.len || now.modified().ok() != self.modified
        })
    }
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

pub(super) fn invalid(
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

fn unreadable(path: &Path, source: io::Error) -> SceneError {
    SceneError::Read {
        path: path.into(),
        what: "scene".into(),
        source,
    }
}

/// A file that is open, as it was then.
struct Opened {
    buffer: Buffer,
    seen: Seen,
}

impl Opened {
    /// Opens the scene, and reads it if it is not binary, or has `max_whole` bytes at most.
    fn new(path: &Path, max_whole: u64) -> Result<Self, SceneError> {
        let (mut file, seen) = open_file(path).map_err(|error| unreadable(path, error))?;
        let mut read = || {
            let mut magic = [0; 4];
            if seen.len > max_whole && file.read_exact(&mut magic).is_ok() && magic == *MAGIC {
                return Ok(None);
            }
            file.rewind()?;
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map(|_| Some(bytes))
        };
        let buffer = match read().map_err(|error: io::Error| unreadable(path, error))? {
            Some(bytes) => Buffer::Memory(bytes),
            None => Buffer::Disk {
                file: file.into(),
                part: 0..seen.len,
            },
        };
        Ok(Self { buffer, seen })
    }
}

/// Reads `file`, which is wanted as a part of `scene`.
fn read_file(scene: &Path, file: &Path, what: &str) -> Result<(Vec<u8>, Seen), SceneError> {
    let read = || {
        let (mut opened, seen) = open_file(file)?;
        let mut bytes = Vec::new();
        opened.read_to_end(&mut bytes)?;
        Ok((bytes, seen))
    };
    read().map_err(|source| wanted(scene, file, what, source))
}

/// `file`, which is wanted as a part of `scene`, cannot be read.
fn wanted(scene: &Path, file: &Path, what: &str, source: io::Error) -> SceneError {
    SceneError::Read {
        path: file.into(),
        what: format!("{what} of {}", scene.display()),
        source,
    }
}

/// Opens regular files only: a URI must not make us wait for a pipe or read a device without end.
fn open_file(file: &Path) -> io::Result<(File, Seen)> {
    if !std::fs::metadata(file)?.is_file() {
        return Err(io::Error::other("not a regular file"));
    }
    // Of the file that is opened, which may be another by now.
    let opened = File::open(file)?;
    let seen = Seen::new(file, &opened.metadata()?);
    Ok((opened, seen))
}

/// How binary files begin.
const MAGIC: &[u8; 4] = b"glTF";

/// Where JSON and binary chunk are in a file (glTF 2.0 section 4.4); a file without the magic number is all JSON.
/// Not by `gltf::binary`, which refuses files with chunks of unknown types, and underflows on a length below 12.
fn split(path: &Path, file: &Buffer) -> Result<(Range<u64>, Option<Range<u64>>), SceneError> {
    let word = |at: u64| -> Result<Option<[u8; 4]>, SceneError> {
        if at.saturating_add(4) > file.len() {
            return Ok(None);
        }
        let bytes = file.range(at..at + 4).map_err(|error| unreadable(path, error))?;
        Ok(Some((*bytes).try_into().expect("four bytes")))
    };
    let number = |at: u64| Ok(word(at)?.map(u32::from_le_bytes));
    if word(0)? != Some(*MAGIC) {
        return Ok((0..file.len(), None));
    }
    let damaged = |problem: String| {
        invalid(
            path,
            "GLB container",
            problem,
            "the file is damaged: copy or export it again",
        )
    };
    let (Some(version), Some(length)) = (number(4)?, number(8)?) else {
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
    if u64::from(length) > file.len() {
        return Err(damaged(format!(
            "claims {length} bytes, but the file has {}",
            file.len()
        )));
    }
    let (mut at, mut json, mut blob) = (12, None, None);
    while let (Some(size), Some(kind)) = (number(at)?, word(at + 4)?) {
        let chunk = at + 8..at + 8 + u64::from(size);
        if chunk.end > file.len() {
            return Err(damaged(format!(
                "a chunk claims {size} bytes at {}, but the file has {}",
                chunk.start,
                file.len()
            )));
        }
        at = chunk.end;
        match &kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if blob.is_none() => blob = Some(chunk),
            // Section 4.4.3.1: clients must ignore chunks with unknown types.
            _ => {}
        }
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

    #[test]
    fn percent_encoding() {
        assert_eq!(decode_percent("a%20b%C5%99"), "a b\u{159}".as_bytes());
        assert_eq!(decode_percent("100%"), b"100%");
        assert_eq!(decode_percent("%zz%2"), b"%zz%2");
    }
}

//! The container: where JSON and buffers lie in a file, in memory or still on the disk.

use super::files::{Seen, invalid, open_file, unreadable};
use crate::SceneError;
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// How binary files begin.
const MAGIC: &[u8; 4] = b"glTF";

/// The bytes of a buffer.
#[derive(Debug)]
pub(super) enum Buffer {
    Memory(Vec<u8>),
    /// A part of a file, read piece by piece. Not mapped into memory: another program that shortens the file would end this one.
    Disk {
        file: Mutex<File>,
        part: Range<u64>,
    },
}

impl Buffer {
    pub(super) fn len(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::Disk { part, .. } => part.end - part.start,
        }
    }

    pub(super) fn truncate(&mut self, length: u64) {
        match self {
            Self::Memory(bytes) => bytes.truncate(length as usize),
            Self::Disk { part, .. } => part.end = part.end.min(part.start.saturating_add(length)),
        }
    }

    /// A part of it, which lies within.
    pub(super) fn part(self, range: Range<u64>) -> Self {
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
    pub(super) fn range(&self, range: Range<u64>) -> io::Result<Cow<'_, [u8]>> {
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

/// A file that is open, as it was then.
pub(super) struct Opened {
    pub(super) buffer: Buffer,
    pub(super) seen: Seen,
}

impl Opened {
    /// Opens the scene, and reads it if it is not binary, or has `max_whole` bytes at most.
    pub(super) fn new(path: &Path, max_whole: u64) -> Result<Self, SceneError> {
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

/// Where JSON and binary chunk are in a file (glTF 2.0 section 4.4); a file without the magic number is all JSON.
/// Not by `gltf::binary`, which refuses files with chunks of unknown types, and underflows on a length below 12.
pub(super) fn split(path: &Path, file: &Buffer) -> Result<(Range<u64>, Option<Range<u64>>), SceneError> {
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

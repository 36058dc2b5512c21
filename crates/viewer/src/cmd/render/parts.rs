//! Files that hold the whole state of a rendering: to continue it, or to join it with others.

use crate::{machine, output};
use anyhow::{Context, Result, bail, ensure};
use render::{FrameLoop, Settings};
use scene::{Camera, Scene};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What such a file begins with.
const MAGIC: &[u8] = b"manylight state 2\n";

/// A share of the samples of an image: number `index` of `count`, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Shard {
    /// Which one.
    pub(crate) index: u32,
    /// Of how many.
    pub(crate) count: u32,
}

impl Shard {
    /// Reads `I/N`.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let parse = |text: &str| text.parse().ok();
        let numbers = text
            .split_once('/')
            .and_then(|(index, count)| parse(index).zip(parse(count)));
        match numbers {
            Some((index, count)) if 1 <= index && index <= count => Ok(Self { index, count }),
            _ => Err("must be I/N, such as 2/8, I from 1 to N".into()),
        }
    }

    /// The first of its frames, and the first after them, if all have `frames` in all.
    pub(crate) fn frames(self, frames: u64) -> std::ops::Range<u64> {
        let end = |shard: u32| u64::try_from(u128::from(frames) * u128::from(shard) / u128::from(self.count));
        let [start, end] = [self.index - 1, self.index].map(|shard| end(shard).expect("a share is at most the whole"));
        start..end
    }
}

/// Whose state it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Header {
    version: String,
    /// What was asked for.
    pub(crate) scene: String,
    /// By name.
    pub(crate) camera: String,
    /// Of geometry, lights and camera.
    fingerprint: u64,
    /// All of them.
    pub(crate) settings: Settings,
    /// Which share of the samples, and of how many.
    pub(crate) shard: Option<(Shard, u64)>,
}

impl Header {
    /// Of a rendering that is about to begin.
    pub(crate) fn new(
        what: &str,
        scene: &Scene,
        camera: &Camera,
        settings: &Settings,
        shard: Option<(Shard, u64)>,
    ) -> Self {
        Self {
            version: machine::VERSION.into(),
            scene: what.into(),
            camera: camera.name.clone(),
            fingerprint: fingerprint(scene, camera),
            settings: settings.clone(),
            shard,
        }
    }

    /// In what `self` and `other` are not about the same image, whatever samples they have of it.
    pub(crate) fn difference(&self, other: &Self) -> Option<&'static str> {
        let seedless = |header: &Self| Settings {
            seed: 0,
            ..header.settings.clone()
        };
        let differences = [
            (self.version != other.version, "version of the program"),
            (self.fingerprint != other.fingerprint, "scene or camera"),
            (seedless(self) != seedless(other), "settings"),
        ];
        differences
            .into_iter()
            .find(|(differ, _)| *differ)
            .map(|(_, what)| what)
    }

    /// Whether both have the same samples.
    pub(crate) fn same_samples(&self, other: &Self) -> bool {
        self.settings.seed == other.settings.seed && self.shard == other.shard
    }
}

/// Writes the state of `frames` to `path`, whole or not at all.
///
/// # Errors
/// Those of the file system; a renderer that cannot tell its state.
pub(crate) fn write(path: &Path, header: &Header, frames: &dyn FrameLoop<'_>) -> Result<()> {
    let header = serde_json::to_vec(header)?;
    let length = u32::try_from(header.len()).context("the header is too long")?;
    output::write(
        path,
        &sealed(&[&length.to_le_bytes()[..], &header, &frames.save()?].concat()),
    )
}

/// A file's bytes from what is in it: with what it begins with, and the checksum.
pub(crate) fn sealed(body: &[u8]) -> Vec<u8> {
    let mut bytes = [MAGIC, body].concat();
    bytes.extend(fnv(&bytes).to_le_bytes());
    bytes
}

/// Reads what [`write`] has written: whose state, and the state.
///
/// # Errors
/// Files that are missing, damaged, or something else.
pub(crate) fn read(path: &Path) -> Result<(Header, Vec<u8>)> {
    let bytes = std::fs::read(path).with_context(|| format!("{}: cannot read", path.display()))?;
    parse(&bytes).with_context(|| format!("{}: cannot be used", path.display()))
}

/// Understands the bytes of a file.
///
/// # Errors
/// Bytes that are damaged, or something else.
pub(crate) fn parse(bytes: &[u8]) -> Result<(Header, Vec<u8>)> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        bail!("no state of a rendering by this version; write one with --resume, or with -o NAME.part");
    };
    let damaged = "damaged: render it again";
    let (body, checksum) = rest.split_last_chunk::<8>().context(damaged)?;
    ensure!(fnv(&bytes[..bytes.len() - 8]) == u64::from_le_bytes(*checksum), damaged);
    let (length, body) = body.split_first_chunk::<4>().context(damaged)?;
    let (header, state) = body
        .split_at_checked(u32::from_le_bytes(*length) as usize)
        .context(damaged)?;
    Ok((serde_json::from_slice(header).context(damaged)?, state.to_vec()))
}

/// Continues `frames` from `path` if that exists; it must be about the same samples.
///
/// # Errors
/// Those of [`read`]; a state of something else.
pub(crate) fn resume(path: &Path, header: &Header, frames: &mut dyn FrameLoop<'_>) -> Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let (found, state) = read(path)?;
    let difference = found
        .difference(header)
        .or((!found.same_samples(header)).then_some("seed or shard"));
    if let Some(difference) = difference {
        bail!(
            "{}: was rendered with another {difference}; give another file, or delete it",
            path.display()
        );
    }
    frames.restore(&state).with_context(|| path.display().to_string())
}

/// A number that changes with what is seen: lights, extent and amount of geometry, camera.
fn fingerprint(scene: &Scene, camera: &Camera) -> u64 {
    let mut bytes = Vec::new();
    let mut add = |numbers: &[f32]| bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    add(&camera.world_from_camera.to_cols_array());
    add(&[camera.fov_y, scene.radius]);
    add(&scene.center_ws.to_array());
    for light in &scene.lights {
        add(&light.position_ws.to_array());
        add(&light.edge1_ws.to_array());
        add(&light.intensity.to_array());
    }
    bytes.extend(scene.triangle_count().to_le_bytes());
    fnv(&bytes)
}

/// The FNV-1a hash (Fowler, Noll, Vo): finds damage, not malice.
fn fnv(bytes: &[u8]) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_all_frames() {
        for (frames, count) in [(64, 4), (10, 3), (7, 7), (1_u64 << 33, 1000)] {
            let shards = (1..=count).map(|index| Shard { index, count }.frames(frames));
            let end = shards.fold(0, |end, range| {
                assert!(range.start == end && range.end > range.start);
                range.end
            });
            assert_eq!(end, frames);
        }
        for wrong in ["", "1", "0/4", "5/4", "1/0", "a/b", "-1/4"] {
            assert!(Shard::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn damaged_files_are_refused() {
        let bytes = sealed(&[&2_u32.to_le_bytes()[..], b"{}", b"state"].concat());
        for length in 0..bytes.len() {
            assert!(parse(&bytes[..length]).is_err());
        }
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 16;
            assert!(parse(&damaged).is_err());
        }
    }
}

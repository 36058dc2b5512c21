//! Everything in this crate that takes bytes which others may have made, as functions for fuzzers: the folder `fuzz`, and the example `fuzz` of
//! the package `tests`.
//!
//! None of them may panic, hang, or take memory out of proportion to what it is given. Not among them is what a sampler has learned in a state that
//! `render --resume` continues: its checksum finds all damage, but one who forges it can make the program end.

use crate::camera_path::{self, Frames};
use crate::cmd::render::parts::{self, Shard};
use crate::tev;
use crate::view::{script::Script, settings_file::Remembered};
use render::Image;

/// Takes bytes; returns whether they were understood.
pub type Reader = fn(&[u8]) -> bool;

/// All readers by name.
pub const READERS: [(&str, Reader); 6] = [
    ("script", script),
    ("camera-path", camera_path),
    ("window", window),
    ("arguments", arguments),
    ("part", part),
    ("tev", tev),
];

/// A script of the window (`view --script`).
pub fn script(bytes: &[u8]) -> bool {
    text(bytes).is_some_and(|text| Script::parse(text).is_ok())
}

/// A camera path (`render --camera-path`).
pub fn camera_path(bytes: &[u8]) -> bool {
    text(bytes).is_some_and(|text| camera_path::parse(text).is_ok())
}

/// What the window remembers.
pub fn window(bytes: &[u8]) -> bool {
    let remembered = text(bytes).and_then(Remembered::parse);
    remembered.is_some_and(|remembered| remembered.bookmarks().all(|pose| pose.camera("bookmark").is_some()))
}

/// Arguments with a grammar of their own: frames of a camera path, shards.
pub fn arguments(bytes: &[u8]) -> bool {
    let Some(text) = text(bytes) else { return false };
    let frames = text.parse::<Frames>().is_ok_and(|frames| frames.of(100).is_ok());
    let shard = Shard::parse(text).is_ok_and(|shard| shard.frames(u64::MAX).start < u64::MAX);
    frames || shard
}

/// The state of a rendering (`render --resume`, `merge`), its checksum put right.
///
/// # Panics
/// If what `merge` makes of a state that it took is not what it says.
pub fn part(bytes: &[u8]) -> bool {
    let Ok((_, state)) = parts::parse(&parts::sealed(bytes)) else {
        return false;
    };
    let Ok(mut film) = render::frame::film_of(&state) else {
        return false;
    };
    let other = film.clone();
    let joined = film.merge(&other).is_ok();
    let pixels = film.width() as usize * film.height() as usize;
    assert!(film.image().pixels.len() == pixels && film.variance().len() == pixels);
    joined
}

/// An image shown in tev under a title of these bytes, its size by their number.
///
/// # Panics
/// If a packet is not as long as it says.
pub fn tev(bytes: &[u8]) -> bool {
    let (width, height) = (1 + bytes.len() as u32 * 37 % 700, 1 + bytes.len() as u32 % 3);
    let image = Image {
        width,
        height,
        pixels: vec![[0.5; 3]; (width * height) as usize],
    };
    let title = String::from_utf8_lossy(bytes);
    for packet in tev::packets(&title, &image) {
        let said = packet.first_chunk().map(|length| u32::from_le_bytes(*length));
        assert_eq!(said, u32::try_from(packet.len()).ok());
    }
    true
}

fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}

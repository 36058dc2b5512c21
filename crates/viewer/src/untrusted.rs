//! Everything in this crate that takes bytes which others may have made, as functions for fuzzers: the folder `fuzz`, and the example `fuzz` of
//! the package `tests`.
//!
//! None of them may panic, hang, or take memory out of proportion to what it is given.

use crate::camera_path::{self, Frames};
use crate::cmd::render::parts::{self, Shard};
use crate::tev;
use crate::view::{script::Script, settings_file::Remembered};
use render::{FrameLoop, Image, Settings, renderer};
use scene::Scene;
use std::sync::LazyLock;

/// Takes bytes; returns whether they were understood.
pub type Reader = fn(&[u8]) -> bool;

/// All readers by name.
pub const READERS: [(&str, Reader); 7] = [
    ("script", script),
    ("camera-path", camera_path),
    ("window", window),
    ("arguments", arguments),
    ("part", part),
    ("state", state),
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

/// What a rendering takes over that goes on (`render --resume`), what was learned included. States are large, so the bytes are changes to a
/// valid one: four say where, a fifth what is put there.
///
/// # Panics
/// If the image is not made of numbers after that.
pub fn state(bytes: &[u8]) -> bool {
    static SCENE: LazyLock<Scene> = LazyLock::new(|| scene::load("demo:points:16").expect("it is generated"));
    static VALID: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let mut frames = tiny_rendering(&SCENE);
        (0..9).for_each(|_| frames.render_frame());
        frames.save().expect("it can be saved")
    });
    let mut changed = VALID.clone();
    for change in bytes.as_chunks::<5>().0 {
        let [a, b, c, d, value] = *change;
        let place = u32::from_le_bytes([a, b, c, d]) as usize % changed.len();
        changed[place] = value;
    }
    let mut frames = tiny_rendering(&SCENE);
    let taken = frames.restore(&changed).is_ok();
    for _ in 0..2 {
        frames.render_frame();
    }
    let _ = (
        frames.stats(),
        frames.light_records(),
        frames.cells(),
        frames.choosing(),
    );
    let image = frames.film().image();
    assert!(image.pixels.as_flattened().iter().all(|x| !x.is_nan()));
    taken
}

/// Four pixels of a scene with more than one light.
fn tiny_rendering(scene: &Scene) -> Box<dyn FrameLoop<'_> + '_> {
    let settings = Settings {
        width: 2,
        height: 2,
        max_bounces: 0,
        ..Settings::default()
    };
    renderer(scene, &scene.parts.cameras[0], &settings).expect("these are settings")
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_taken_as_it_was_saved_and_not_with_another_head() {
        assert!(state(&[]));
        assert!(!state(&[0, 0, 0, 0, 0xff, 1, 0, 0, 0, 0xff]));
    }
}

//! What a sampler has learned, as bytes, and back again: bytes that others may have made.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A sampler that [`save`] and [`restore`] know.
pub(crate) trait Saved: Serialize + DeserializeOwned {
    /// Whether what was read can take the place of `fresh`, a sampler of the same scene and settings: what follows from these is as it is
    /// there, every index is in range, and every number is one that can be learned.
    fn is_sound_like(&self, fresh: &Self) -> bool;
}

/// `sampler` as bytes, all its numbers to the bit.
pub(crate) fn save<T: Saved>(sampler: &T) -> Option<Vec<u8>> {
    postcard::to_stdvec(sampler).ok()
}

/// Replaces `sampler`, which has learned nothing yet, by what [`save`] made of another; returns whether that could be read.
pub(crate) fn restore<T: Saved>(sampler: &mut T, state: &[u8]) -> bool {
    let read = postcard::from_bytes(state).ok();
    read.filter(|read: &T| read.is_sound_like(sampler))
        .map(|read| *sampler = read)
        .is_some()
}

/// Whether a number is a count, a sum or a weight: finite, not negative.
pub(crate) fn is_amount(number: impl Into<f64>) -> bool {
    (0.0..f64::INFINITY).contains(&number.into())
}

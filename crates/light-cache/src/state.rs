//! What a sampler has learned, as bytes.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// `sampler` as bytes, all its numbers to the bit.
pub(crate) fn save<T: Serialize>(sampler: &T) -> Option<Vec<u8>> {
    postcard::to_stdvec(sampler).ok()
}

/// Replaces `sampler` by what [`save`] made of another; returns whether that could be read.
pub(crate) fn restore<T: DeserializeOwned>(sampler: &mut T, state: &[u8]) -> bool {
    postcard::from_bytes(state).map(|read| *sampler = read).is_ok()
}

//! The state of a rendering as bytes.

use crate::path::Counters;
use crate::{Film, RenderError};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Everything that the frames to come depend on, besides scene, camera and settings.
#[derive(Serialize, Deserialize)]
pub(super) struct State<'f> {
    pub(super) film: Cow<'f, Film>,
    /// Number of the next frame.
    pub(super) frame: u32,
    /// Number of the frame with which the current sequence of random numbers began.
    pub(super) first_frame: u32,
    /// See [`light_cache::LightSampler::save`].
    pub(super) learned: Vec<u8>,
    pub(super) counters: Counters,
    pub(super) render_s: f64,
}

impl State<'_> {
    pub(super) fn to_bytes(&self) -> Result<Vec<u8>, RenderError> {
        postcard::to_stdvec(self).map_err(|_| unable())
    }

    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, RenderError> {
        let state: Self = postcard::from_bytes(bytes).map_err(|_| unlike())?;
        if state.film.is_sound() {
            Ok(state)
        } else {
            Err(unlike())
        }
    }
}

/// The film in what [`crate::FrameLoop::save`] has told.
///
/// # Errors
/// [`RenderError::State`] if the bytes are no such state.
pub fn film_of(state: &[u8]) -> Result<Film, RenderError> {
    Ok(State::from_bytes(state)?.film.into_owned())
}

/// The renderer cannot tell or take over a state.
pub(super) fn unable() -> RenderError {
    RenderError::State {
        what: "this renderer cannot be stopped and continued, or render a part only".into(),
    }
}

/// The state is not one of this rendering.
pub(super) fn unlike() -> RenderError {
    RenderError::State {
        what: "the state is not one of a rendering like this".into(),
    }
}

//! Every knob of `restir`.

use crate::RenderError;
use serde::{Deserialize, Serialize};

/// Knobs of `restir`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestirSettings {
    /// Lights compared in each pixel and frame, 1..=1,024. Higher values begin with better lights; lower values make more frames.
    pub candidates: u32,
    /// Pixels nearby that each pixel takes a sample from, 0..=32. Higher values have less noise in each frame; lower values are
    /// faster (two shadow rays each), and pixels depend less on each other.
    pub neighbors: u32,
    /// How far away they are, in pixels, at most, above 0 and at most 1,000. Higher values find what no pixel nearby has found; lower
    /// values find surfaces that see the same lights.
    pub radius: f32,
    /// Frames that a kept sample counts as, at most, 0..=1,000; 0 keeps none. Higher values have less noise in each frame; lower values
    /// make frames depend less on each other, so that their mean converges faster.
    pub history: u32,
}

impl Default for RestirSettings {
    fn default() -> Self {
        Self {
            candidates: 8,
            neighbors: 5,
            radius: 30.0,
            history: 20,
        }
    }
}

impl RestirSettings {
    /// # Errors
    /// [`RenderError::Setting`] for a setting out of its range, with the range.
    pub(crate) fn check(&self) -> Result<(), RenderError> {
        let Self {
            candidates,
            neighbors,
            radius,
            history,
        } = *self;
        let ranges = [
            (
                (1..=1024).contains(&candidates),
                format!("restir.candidates = {candidates}"),
                "it must be 1 to 1,024; 8 is usual",
            ),
            (
                neighbors <= 32,
                format!("restir.neighbors = {neighbors}"),
                "it must be 0 to 32; 5 is usual",
            ),
            (
                radius > 0.0 && radius <= 1000.0,
                format!("restir.radius = {radius}"),
                "it must be above 0 and at most 1,000 pixels; 30 is usual",
            ),
            (
                history <= 1000,
                format!("restir.history = {history}"),
                "it must be 0 to 1,000 frames; 20 is usual",
            ),
        ];
        match ranges.into_iter().find(|(inside, ..)| !inside) {
            None => Ok(()),
            Some((_, what, remedy)) => Err(RenderError::Setting {
                what,
                remedy: remedy.into(),
            }),
        }
    }
}

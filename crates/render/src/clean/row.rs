//! Pictures in a row, and how much of the one before is kept.

use super::frame::Frame;
use super::projection::Projection;

/// Samples that history counts for at most. Higher values are less noisy; lower values lag less behind light that changes, ghost
/// less, and blur less by being looked up again and again. 4 is the paper's (SVGF): on walks through `rooms` longer histories had
/// larger errors, because samples from before anything was learned stayed in them.
const LONGEST: f32 = 4.0;
/// With so many samples of its own a pixel needs no history any more.
const INDEPENDENT: f32 = 64.0;

/// Pictures in a row, of whose pixels `P` is kept.
#[derive(Debug)]
pub(super) struct Row<P> {
    /// The last picture through another camera, or before the film began anew.
    before: Option<Past<P>>,
    newest: Option<Past<P>>,
}

/// A picture that was shown.
#[derive(Debug)]
pub(super) struct Past<P> {
    pub(super) width: u32,
    pub(super) height: u32,
    spp: u64,
    pub(super) projection: Projection,
    pub(super) pixels: Vec<P>,
}

impl<P> Default for Row<P> {
    fn default() -> Self {
        Self {
            before: None,
            newest: None,
        }
    }
}

impl<P> Row<P> {
    /// Begins the picture of `frame`, which may be the newest one with more samples. Returns the one before.
    pub(super) fn begin(&mut self, frame: &Frame, projection: &Projection) -> Option<&Past<P>> {
        let goes_on = self.newest.as_ref().is_some_and(|past| {
            past.projection == *projection
                && (past.width, past.height) == (frame.width, frame.height)
                && past.spp < frame.spp
        });
        if !goes_on && self.newest.is_some() {
            self.before = self.newest.take();
        }
        self.before.as_ref()
    }

    /// Keeps the picture that was begun.
    pub(super) fn keep(&mut self, frame: &Frame, projection: Projection, pixels: Vec<P>) {
        self.newest = Some(Past {
            width: frame.width,
            height: frame.height,
            spp: frame.spp,
            projection,
            pixels,
        });
    }
}

/// As how many samples a history of `samples` counts beside `spp` new ones.
pub(super) fn kept(samples: f32, spp: f32) -> f32 {
    samples.min(LONGEST) * (1.0 - spp / INDEPENDENT).max(0.0)
}

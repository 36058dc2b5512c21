//! What the frame before has kept of the same surface.

use super::layer::Layer;
use super::reservoir::Reservoir;
use super::site::Site;

/// The surface that the frame before saw where `site` would have been in it, and its sample, which counts as at most `history` frames; `None` if
/// that was another surface.
pub(super) fn predecessor<'f>(site: &Site<'f>, before: &Layer, history: u32) -> Option<(Site<'f>, Reservoir)> {
    if history == 0 {
        return None;
    }
    let pixel = before.pixel_of(site.surface.position_ws)?;
    let eye_ws = before.eye_ws();
    let there = Site::new(site.view, eye_ws, pixel.seen.as_ref()?);
    let reservoir = Reservoir {
        confidence: pixel.reservoir.confidence.min(history as f32),
        ..pixel.reservoir
    };
    let distance = site.surface.position_ws.distance(eye_ws);
    site.is_like(distance, &there).then_some((there, reservoir))
}

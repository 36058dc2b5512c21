//! The frame.

use crate::{Film, RenderError, Settings};
use light_cache::{LightRecord, SamplerStats};
use scene::{Camera, Scene};

/// Counters of a rendering.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct RenderStats {
    /// Frames done (= samples per pixel).
    pub frames: u64,
    /// Seconds of rendering frames, learning included; loading and building excluded.
    pub render_s: f64,
    /// Seconds of building the light structures.
    pub light_build_s: f64,
    /// Rays traced for the nearest hit.
    pub rays_nearest: u64,
    /// Shadow rays traced.
    pub rays_occluded: u64,
    /// Samples that came out NaN or infinite, counted and left out: always 0 unless there is a bug.
    pub nonfinite_samples: u64,
    /// The sampler's own figures; `None` for `exact`.
    pub sampler: Option<SamplerStats>,
    /// What the integrator left out because the scene does not need it.
    pub skipped: Vec<String>,
}

/// A rendering in progress.
pub trait FrameLoop: Send {
    /// Renders one frame, one sample per pixel, on rayon's current thread pool, and lets the sampler learn from it.
    fn render_frame(&mut self);

    /// What has been accumulated.
    fn film(&self) -> &Film;

    /// Counters so far.
    fn stats(&self) -> RenderStats;

    /// What the sampler knows about each light; empty for `exact`.
    fn light_records(&self) -> Vec<LightRecord>;
}

/// Starts a rendering: builds the light structures that `settings.method` needs.
///
/// # Errors
/// [`RenderError::Setting`] for a setting out of range.
pub fn renderer<'s>(
    scene: &'s Scene,
    camera: &Camera,
    settings: &Settings,
) -> Result<Box<dyn FrameLoop + 's>, RenderError> {
    let _ = (scene, camera, settings);
    unimplemented!("owner: render")
}

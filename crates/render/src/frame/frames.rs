//! What makes frames.

use super::Eye;
use crate::choosing::Choosing;
use crate::gpu::{DeviceFilm, PassTime};
use crate::path::Counters;
use crate::{Film, RenderError};
use light_cache::{CellRecord, LightRecord, SamplerStats, ShadingPoint};
use scene::Scene;
use std::sync::atomic::AtomicBool;

/// A way to make frames.
pub(crate) trait Frames: Send {
    /// Called before the first frame, and when camera or scene have changed. `film` is empty.
    fn look(&mut self, eye: &Eye<'_>, film: &mut Film);

    /// Adds one sample to every pixel. With `AOVS` to the auxiliary images too. Once `stop` is set it does nothing more,
    /// learns nothing, and returns false. It may drop what the scene of `eye` has made on demand while no ray is on its way.
    fn render<const AOVS: bool>(&mut self, eye: &mut Eye<'_>, film: &mut Film, stop: &AtomicBool) -> (Counters, bool);

    /// Before frame number `frame`: from it on, random numbers must be independent of all before.
    fn begin_sequence(&mut self, _frame: u32) {}

    /// What has been accumulated, if it is not all in `film`.
    fn film<'f>(&'f self, film: &'f Film) -> &'f Film {
        film
    }

    /// See [`super::FrameLoop::device_film`].
    fn device_film(&self, _film: &Film) -> Option<DeviceFilm<'_>> {
        None
    }

    /// What was counted, if [`Frames::render`] has not told of it.
    fn counters(&self, _film: &Film) -> Counters {
        Counters::default()
    }

    /// See [`super::FrameLoop::error`].
    fn error(&self) -> Option<RenderError> {
        None
    }

    /// See [`super::FrameLoop::wait`].
    fn wait(&mut self) {}

    /// See [`super::FrameLoop::time_passes`].
    fn time_passes(&mut self) -> bool {
        false
    }

    /// See [`super::FrameLoop::pass_times`].
    fn pass_times(&self) -> Vec<PassTime> {
        Vec::new()
    }

    /// Called when the scene has changed, before [`Frames::look`].
    fn scene_changed(&mut self, scene: &Scene);

    /// See [`super::RenderStats::prepare_s`].
    fn prepare_s(&self) -> f64 {
        0.0
    }

    /// What a sampler can tell about itself; `None` if there is none.
    fn sampler_stats(&self) -> Option<SamplerStats>;

    /// The frame with which the current sequence of random numbers began, and what was learned; `None` if that cannot be told.
    fn save(&self) -> Option<(u32, Vec<u8>)> {
        None
    }

    /// Takes over what [`Frames::save`] has told; returns whether it could.
    fn restore(&mut self, _first_frame: u32, _learned: &[u8]) -> bool {
        false
    }

    /// See [`super::FrameLoop::light_records`].
    fn light_records(&self, _scene: &Scene) -> Vec<LightRecord> {
        Vec::new()
    }

    /// See [`super::FrameLoop::cells`].
    fn cells(&self, _scene: &Scene) -> Vec<CellRecord> {
        Vec::new()
    }

    /// See [`super::FrameLoop::cells_at`].
    fn cells_at(&self, points: &[ShadingPoint]) -> Vec<Option<u64>> {
        vec![None; points.len()]
    }

    /// See [`super::FrameLoop::light_probabilities`].
    fn light_probabilities(&self, _scene: &Scene, _points: &[ShadingPoint]) -> Vec<f64> {
        Vec::new()
    }

    /// See [`super::FrameLoop::choosing`].
    fn choosing(&self, _eye: &Eye<'_>) -> Option<Choosing> {
        None
    }
}

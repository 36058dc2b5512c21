//! What choosing lights costs: all choices of one frame, made again and timed alone.

use crate::Film;
use crate::direct::{Direct, DirectLight, LightNumbers, Vertex};
use crate::frame::Eye;
use crate::path::{Counters, Probe, Start, TileLog, path};
use glam::Vec3;
use light_cache::ShadingPoint;
use scene::Scene;
use std::hint::black_box;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Choices that are timed, at most; of more, every nth.
const MAX_TIMED: usize = 1 << 17;
/// Times that they are timed; the fastest counts, for it was disturbed least.
const ROUNDS: u32 = 3;

/// The cost of choosing lights.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Choosing {
    /// Nanoseconds of one choice on one thread: looking up what is known at the point, and drawing.
    pub ns_per_choice: f64,
    /// Choices in one frame.
    pub per_frame: u64,
}

impl Choosing {
    /// The share of a frame of `frame_s` seconds on `threads` threads that goes into choosing.
    pub fn share(&self, frame_s: f64, threads: usize) -> f64 {
        self.ns_per_choice * 1e-9 * self.per_frame as f64 / (frame_s * threads as f64)
    }
}

/// Renders the next frame on one thread, without a trace but for the choices, and times these.
pub(crate) fn measure<D: DirectLight>(eye: &Eye<'_>, direct: &D) -> Choosing {
    let recorder = Recorder::default();
    let view = eye.view(&recorder);
    let mut log = TileLog {
        observations: &mut Vec::new(),
        controls: &mut [],
        counters: Counters::default(),
    };
    // Tile by tile, as frames are rendered: what lies near each other is met one after the other.
    for tile in Film::new(eye.image_width, eye.image_height, false).tiles_mut() {
        for y in tile.y0..tile.y0 + tile.height {
            for x in tile.x0..tile.x0 + tile.width {
                path(&view, &Start::new(&view, x, y), &mut log, &mut ());
            }
        }
    }
    let choices = recorder.choices.into_inner().unwrap_or_else(PoisonError::into_inner);
    let timed = choices.iter().step_by(choices.len().div_ceil(MAX_TIMED).max(1));
    let mut fastest = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for (point, u) in timed.clone() {
            black_box(direct.choose(&eye.scene, black_box(point), *u));
        }
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    Choosing {
        ns_per_choice: fastest * 1e9 / timed.len().max(1) as f64,
        per_frame: choices.len() as u64,
    }
}

/// Writes down which choices are made, and makes none: the bounces of a path do not depend on them.
#[derive(Default)]
struct Recorder {
    choices: Mutex<Vec<(ShadingPoint, u32)>>,
}

impl DirectLight for Recorder {
    type Local<'a> = ();

    fn local(&self, _scene: &Scene, _point: &ShadingPoint) -> Self::Local<'_> {}

    fn estimate(
        &self,
        _scene: &Scene,
        (): &Self::Local<'_>,
        vertex: &Vertex<'_>,
        numbers: &[LightNumbers],
        _log: &mut TileLog<'_>,
        _probe: &mut impl Probe,
    ) -> Direct {
        let mut choices = self.choices.lock().unwrap_or_else(PoisonError::into_inner);
        choices.push((vertex.point, numbers[0].choice));
        Direct {
            radiance: Vec3::ZERO,
            control: Vec3::ZERO,
            light: None,
        }
    }

    fn pmf(&self, (): &Self::Local<'_>, _light: u32) -> f32 {
        1.0
    }
}

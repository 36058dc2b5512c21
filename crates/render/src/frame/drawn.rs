//! Frames whose direct light is found at every vertex in one way: the CPU's tiles, and learning from them.

use super::{Eye, Frames};
use crate::Film;
use crate::choosing::{self, Choosing};
use crate::control::Controls;
use crate::direct::DirectLight;
use crate::path::{Counters, TileLog, render_tile};
use light_cache::{CellRecord, LightRecord, Observation, SamplerStats, ShadingPoint};
use rayon::iter::Either;
use rayon::prelude::*;
use scene::Scene;
use std::borrow::Cow;
use std::ops::Add;
use std::sync::atomic::{AtomicBool, Ordering};

/// Frames with one way of finding direct light.
pub(crate) struct Drawn<D> {
    pub(crate) direct: D,
    /// The frame with which the current sequence of random numbers began.
    pub(crate) first_frame: u32,
    /// What the last frame observed, one list per tile.
    pub(crate) observations: Vec<Vec<Observation>>,
    /// How much of the control variate each pixel takes.
    controls: Controls,
}

impl<D> Drawn<D> {
    pub(crate) fn new(direct: D) -> Self {
        Self {
            direct,
            first_frame: 0,
            observations: Vec::new(),
            controls: Controls::default(),
        }
    }
}

impl<D: DirectLight> Drawn<D> {
    /// Learns from what was observed in frame `frame`; returns whether something else is drawn from now on.
    pub(crate) fn learn(&mut self, scene: &Scene, frame: u32) -> bool {
        self.learn_by(frame, |direct, observations| direct.end_frame(scene, observations))
    }

    /// [`Drawn::learn`] where something else is done at the end of a frame, given what was observed.
    pub(crate) fn learn_by(&mut self, frame: u32, end_frame: impl FnOnce(&mut D, &[Vec<Observation>])) -> bool {
        let before = self.direct.pace().lessons;
        end_frame(&mut self.direct, &self.observations);
        let learned = self.direct.pace().lessons != before;
        if learned {
            // What was learned depends on the numbers so far, and those to come in the same sequence depend on them too.
            self.first_frame = frame.wrapping_add(1);
        }
        learned
    }
}

impl<D: DirectLight> Frames for Drawn<D> {
    fn look(&mut self, eye: &Eye<'_>, film: &mut Film) {
        self.direct.set_eye(eye.camera.origin_ws);
        self.observations.resize(film.tile_count(), Vec::new());
        self.controls = if self.direct.is_controlled() {
            Controls::new(film)
        } else {
            Controls::none(film)
        };
    }

    /// All tiles in parallel, each with its own pixels, random numbers and observations, so that the threads share
    /// nothing and their number changes nothing.
    ///
    /// Tiles that find the memory budget spent wait until all that have begun are done and room was made; at least one gets through each time.
    fn render<const AOVS: bool>(&mut self, eye: &mut Eye<'_>, film: &mut Film, stop: &AtomicBool) -> (Counters, bool) {
        film.set_weight(self.direct.pace().frame_weight);
        let tiles = film.tiles_mut().iter_mut().zip(&mut self.observations);
        let mut waiting: Vec<_> = tiles.zip(self.controls.tiles_mut()).collect();
        let mut counters = Counters::default();
        while !waiting.is_empty() {
            let bounded = eye.scene.make_room();
            let view = eye.view(&self.direct).in_sequence_since(self.first_frame);
            let (later, done): (Vec<_>, Vec<Counters>) = waiting.into_par_iter().partition_map(|work| {
                if bounded && view.scene.memory().is_full() {
                    return Either::Left(work);
                }
                let ((tile, observations), controls) = work;
                observations.clear();
                let mut log = TileLog {
                    observations,
                    controls,
                    counters: Counters::default(),
                };
                if !stop.load(Ordering::Relaxed) {
                    render_tile::<D, AOVS>(&view, tile, &mut log);
                }
                Either::Right(log.counters)
            });
            counters = done.into_iter().fold(counters, Counters::add);
            waiting = later;
        }
        if stop.load(Ordering::Relaxed) {
            return (counters, false);
        }
        if self.learn(&eye.scene, eye.frame) {
            self.controls.learn();
        }
        (counters, true)
    }

    fn begin_sequence(&mut self, frame: u32) {
        self.first_frame = frame;
    }

    fn scene_changed(&mut self, scene: &Scene) {
        self.direct.scene_changed(scene);
    }

    fn sampler_stats(&self) -> Option<SamplerStats> {
        self.direct.sampler_stats()
    }

    fn save(&self) -> Option<(u32, Vec<u8>)> {
        let learned = (Cow::Borrowed(&self.controls), self.direct.save()?);
        Some((self.first_frame, postcard::to_stdvec(&learned).ok()?))
    }

    fn restore(&mut self, first_frame: u32, learned: &[u8]) -> bool {
        let Ok((controls, learned)) = postcard::from_bytes::<(Cow<'_, Controls>, Vec<u8>)>(learned) else {
            return false;
        };
        if !controls.is_sound_like(&self.controls) {
            return false;
        }
        self.controls = controls.into_owned();
        self.first_frame = first_frame;
        self.direct.restore(&learned)
    }

    fn light_records(&self, scene: &Scene) -> Vec<LightRecord> {
        self.direct.records(scene)
    }

    fn cells(&self, scene: &Scene) -> Vec<CellRecord> {
        self.direct.cells(scene)
    }

    fn cells_at(&self, points: &[ShadingPoint]) -> Vec<Option<u64>> {
        points.par_iter().map(|point| self.direct.cell_at(point)).collect()
    }

    fn light_probabilities(&self, scene: &Scene, points: &[ShadingPoint]) -> Vec<f64> {
        if self.direct.sampler_stats().is_none() {
            return Vec::new();
        }
        let mut sums = vec![0.0; scene.lights.len()];
        for point in points {
            self.direct.add_pmfs(&self.direct.local(scene, point), &mut sums);
        }
        let count = points.len().max(1) as f64;
        sums.iter_mut().for_each(|sum| *sum /= count);
        sums
    }

    fn choosing(&self, eye: &Eye<'_>) -> Option<Choosing> {
        self.direct.sampler_stats()?;
        Some(choosing::measure(eye, &self.direct))
    }
}

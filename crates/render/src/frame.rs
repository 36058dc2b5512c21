//! Rendering frame by frame. What happens inside a frame is in `path`.

use crate::direct::{DirectLight, OneLight};
use crate::exact::AllLights;
use crate::filter::FilterSampler;
use crate::path::{Counters, FrameView, TileLog, render_tile};
use crate::{Film, Method, RenderError, Settings};
use light_cache::{LightRecord, LightSampler, Observation, Recording, SamplerStats, Visitor};
use rayon::prelude::*;
use scene::camera::CameraRays;
use scene::{Camera, Scene};
use std::ops::Add;
use std::time::Instant;

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

    /// What the sampler knows about each light; empty for `exact`. Whole with [`Settings::record_lights`] only.
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
    settings.check()?;
    let start = Instant::now();
    Ok(match settings.method {
        Method::Exact => {
            let direct = AllLights::new(&scene.lights);
            Box::new(Rendering::new(scene, camera, settings, direct, start))
        }
        Method::Sampled(kind) => light_cache::build(
            scene,
            &settings.light,
            kind,
            Starter {
                scene,
                camera,
                settings,
                start,
            },
        ),
    })
}

/// Starts a rendering with whatever sampler was built.
struct Starter<'s, 'a> {
    scene: &'s Scene,
    camera: &'a Camera,
    settings: &'a Settings,
    start: Instant,
}

impl<'s> Visitor for Starter<'s, '_> {
    type Output = Box<dyn FrameLoop + 's>;

    fn visit<S: LightSampler + 'static>(self, sampler: S) -> Self::Output {
        let Self {
            scene,
            camera,
            settings,
            start,
        } = self;
        if settings.record_lights {
            let recording = Recording::new(sampler, scene, settings.light.table_decay);
            Box::new(Rendering::new(scene, camera, settings, OneLight(recording), start))
        } else {
            Box::new(Rendering::new(scene, camera, settings, OneLight(sampler), start))
        }
    }
}

/// A rendering with one way of finding direct light.
struct Rendering<'s, D> {
    scene: &'s Scene,
    camera: CameraRays,
    filter: FilterSampler,
    max_bounces: u32,
    seed: u64,
    aovs: bool,
    area_lights: bool,
    direct: D,
    film: Film,
    /// What the last frame observed, one list per tile.
    observations: Vec<Vec<Observation>>,
    counters: Counters,
    render_s: f64,
    light_build_s: f64,
}

impl<'s, D: DirectLight> Rendering<'s, D> {
    /// `start` is when building the light structures began.
    fn new(scene: &'s Scene, camera: &Camera, settings: &Settings, mut direct: D, start: Instant) -> Self {
        direct.set_eye(camera.world_from_camera.translation.into());
        let film = Film::new(settings.width, settings.height, settings.aovs);
        Self {
            scene,
            camera: camera.rays(settings.width, settings.height),
            filter: FilterSampler::new(settings.pixel_filter),
            max_bounces: settings.max_bounces,
            seed: settings.seed,
            aovs: settings.aovs,
            area_lights: scene.lights.iter().any(|light| !light.is_delta()),
            direct,
            observations: vec![Vec::new(); film.tile_count()],
            film,
            counters: Counters::default(),
            render_s: 0.0,
            light_build_s: start.elapsed().as_secs_f64(),
        }
    }

    /// One sample per pixel: all tiles in parallel, each with its own pixels, random numbers and observations, so that the
    /// threads share nothing and their number changes nothing.
    fn frame<const AOVS: bool>(&mut self) {
        let view = FrameView {
            scene: self.scene,
            direct: &self.direct,
            camera: self.camera,
            filter: &self.filter,
            image_width: self.film.width(),
            max_bounces: self.max_bounces,
            seed: self.seed,
            // The sequence has 2^32 points; a rendering of more repeats it.
            frame: self.film.spp() as u32,
            area_lights: self.area_lights,
        };
        let tiles = self.film.tiles_mut().par_iter_mut().zip(&mut self.observations);
        let counters = tiles.map(|(tile, observations)| {
            observations.clear();
            let mut log = TileLog {
                observations,
                counters: Counters::default(),
            };
            render_tile::<D, AOVS>(&view, tile, &mut log);
            log.counters
        });
        self.counters = self.counters + counters.reduce(Counters::default, Counters::add);
        self.film.advance(1);
        self.direct.end_frame(self.scene, &self.observations);
    }
}

impl<D: DirectLight> FrameLoop for Rendering<'_, D> {
    fn render_frame(&mut self) {
        let start = Instant::now();
        if self.aovs {
            self.frame::<true>();
        } else {
            self.frame::<false>();
        }
        self.render_s += start.elapsed().as_secs_f64();
    }

    fn film(&self) -> &Film {
        &self.film
    }

    fn stats(&self) -> RenderStats {
        let sampler = self.direct.sampler_stats();
        let mut skipped = sampler.as_ref().map_or_else(Vec::new, |s| s.skipped.clone());
        let mut skip = |condition: bool, what: &str| {
            if condition {
                skipped.push(what.into());
            }
        };
        skip(self.scene.lights.is_empty(), "no lights: no light sampling, no bounces");
        let delta_only = !self.area_lights && !self.scene.lights.is_empty();
        skip(
            delta_only,
            "punctual lights only: no BSDF rays towards lights, no multiple importance sampling",
        );
        skip(self.max_bounces == 0, "no bounces asked for: no indirect light");
        skip(!self.aovs, "no auxiliary images asked for: none kept");
        RenderStats {
            frames: self.film.spp(),
            render_s: self.render_s,
            light_build_s: self.light_build_s,
            rays_nearest: self.counters.rays_nearest,
            rays_occluded: self.counters.rays_occluded,
            nonfinite_samples: self.counters.nonfinite,
            sampler,
            skipped,
        }
    }

    fn light_records(&self) -> Vec<LightRecord> {
        self.direct.records(self.scene)
    }
}

#[cfg(test)]
mod tests;

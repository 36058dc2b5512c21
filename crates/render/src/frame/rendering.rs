//! A rendering in progress: what frames look at, and what they have added up to.

use super::state::{self, State};
use super::{FrameLoop, Frames, RenderStats, SceneRef};
use crate::choosing::Choosing;
use crate::direct::DirectLight;
use crate::filter::FilterSampler;
use crate::gpu::{DeviceFilm, PassTime};
use crate::path::{Counters, FrameView};
use crate::settings;
use crate::{Film, Method, RenderError, Settings};
use light_cache::{CellRecord, LightRecord, SamplerStats, ShadingPoint};
use sampling::PixelSampler;
use sampling::mis::Heuristic;
use scene::camera::CameraRays;
use scene::{Camera, Scene};
use std::borrow::Cow;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// What frames look at, and with which random numbers.
#[derive(Clone, Debug)]
pub(crate) struct Eye<'s> {
    pub(crate) scene: SceneRef<'s>,
    pub(crate) camera: CameraRays,
    pub(crate) filter: FilterSampler,
    pub(crate) image_width: u32,
    pub(crate) image_height: u32,
    pub(crate) pixel_sampler: PixelSampler,
    pub(crate) mis: Option<Heuristic>,
    pub(crate) max_bounces: u32,
    pub(crate) seed: u64,
    /// Number of the next frame since the start of the rendering, whatever has changed since. The sequence has 2^32
    /// points; a rendering of more repeats it.
    pub(crate) frame: u32,
    pub(crate) light_samples: u32,
    pub(crate) candidates: u32,
    pub(crate) area_lights: bool,
}

impl Eye<'_> {
    pub(crate) fn view<'f, D: DirectLight>(&'f self, direct: &'f D) -> FrameView<'f, D> {
        FrameView {
            scene: &self.scene,
            direct,
            camera: self.camera,
            filter: &self.filter,
            image_width: self.image_width,
            pixel_sampler: self.pixel_sampler,
            mis: self.mis,
            max_bounces: self.max_bounces,
            seed: self.seed,
            frame: self.frame,
            light_samples: self.light_samples,
            candidates: self.candidates,
            area_lights: self.area_lights,
            guided: self.max_bounces > 0 && direct.guides(),
        }
    }
}

/// A rendering with one way of making frames.
pub(crate) struct Rendering<'s, F> {
    eye: Eye<'s>,
    camera: Camera,
    aovs: bool,
    adaptive_pixels: bool,
    frames: F,
    film: Film,
    counters: Counters,
    render_s: f64,
    light_build_s: f64,
}

impl<'s, F: Frames> Rendering<'s, F> {
    /// `start` is when building the light structures began.
    pub(crate) fn new(scene: SceneRef<'s>, camera: &Camera, settings: &Settings, frames: F, start: Instant) -> Self {
        let mut new = Self {
            eye: Eye {
                area_lights: has_area_lights(&scene),
                scene,
                camera: camera.rays(settings.width, settings.height),
                filter: FilterSampler::new(settings.pixel_filter),
                image_width: settings.width,
                image_height: settings.height,
                pixel_sampler: settings.pixel_sampler,
                mis: settings.mis.heuristic(),
                max_bounces: settings.max_bounces,
                seed: settings.seed,
                frame: 0,
                light_samples: match settings.method {
                    Method::Exact | Method::Restir => 1,
                    _ => settings.light_samples,
                },
                // The others choose with the reflection in mind already.
                candidates: match settings.method {
                    Method::Exact | Method::Oracle => 1,
                    Method::Sampled(_) | Method::Restir => settings.candidates,
                },
            },
            camera: camera.clone(),
            aovs: settings.aovs,
            adaptive_pixels: settings.adaptive_pixels,
            frames,
            film: empty_film(
                (settings.width, settings.height),
                settings.aovs,
                settings.adaptive_pixels,
            ),
            counters: Counters::default(),
            render_s: 0.0,
            light_build_s: 0.0,
        };
        new.frames.look(&new.eye, &mut new.film);
        new.light_build_s = (start.elapsed().as_secs_f64() - new.frames.prepare_s()).max(0.0);
        new
    }
}

fn empty_film((width, height): (u32, u32), aovs: bool, rates: bool) -> Film {
    let film = Film::new(width, height, aovs);
    if rates { film.with_rates() } else { film }
}

/// Whether rays can meet any light.
fn has_area_lights(scene: &Scene) -> bool {
    scene.lights.iter().any(|light| !light.is_delta())
}

impl<'s, F: Frames> FrameLoop<'s> for Rendering<'s, F> {
    fn render_frame_unless(&mut self, stop: &AtomicBool) -> bool {
        let start = Instant::now();
        if self.film.begin_block() {
            self.frames.begin_sequence(self.eye.frame);
        }
        let (counters, finished) = if self.aovs {
            self.frames.render::<true>(&mut self.eye, &mut self.film, stop)
        } else {
            self.frames.render::<false>(&mut self.eye, &mut self.film, stop)
        };
        self.counters = self.counters + counters;
        self.eye.frame = self.eye.frame.wrapping_add(1);
        self.render_s += start.elapsed().as_secs_f64();
        if finished {
            self.film.advance();
        }
        finished
    }

    fn film(&self) -> &Film {
        self.frames.film(&self.film)
    }

    fn device_film(&self) -> Option<DeviceFilm<'_>> {
        self.frames.device_film(&self.film)
    }

    fn error(&self) -> Option<RenderError> {
        let fault = || {
            self.eye
                .scene
                .fault()
                .map(|fault| RenderError::Scene(fault.to_string()))
        };
        self.frames.error().or_else(fault)
    }

    fn size(&self) -> (u32, u32) {
        (self.film.width(), self.film.height())
    }

    fn scene(&self) -> &Scene {
        &self.eye.scene
    }

    fn spp(&self) -> u64 {
        self.film.spp()
    }

    fn sampler_stats(&self) -> Option<SamplerStats> {
        self.frames.sampler_stats()
    }

    fn wait(&mut self) {
        self.frames.wait();
    }

    fn time_passes(&mut self) -> bool {
        self.frames.time_passes()
    }

    fn pass_times(&self) -> Vec<PassTime> {
        self.frames.pass_times()
    }

    fn restart(&mut self) {
        let size = (self.eye.image_width, self.eye.image_height);
        self.film = empty_film(size, self.aovs, self.adaptive_pixels);
    }

    fn set_camera(&mut self, camera: &Camera) {
        self.restart();
        self.camera.clone_from(camera);
        self.eye.camera = camera.rays(self.eye.image_width, self.eye.image_height);
        self.frames.look(&self.eye, &mut self.film);
    }

    fn set_film(&mut self, width: u32, height: u32, aovs: bool) -> Result<(), RenderError> {
        settings::check_size(width, height)?;
        (self.eye.image_width, self.eye.image_height, self.aovs) = (width, height, aovs);
        self.restart();
        self.eye.camera = self.camera.rays(width, height);
        self.frames.look(&self.eye, &mut self.film);
        Ok(())
    }

    fn set_scene(&mut self, scene: SceneRef<'s>) -> Result<(), RenderError> {
        let (before, now) = (self.eye.scene.lights.len(), scene.lights.len());
        if before != now {
            return Err(RenderError::Setting {
                what: format!("the scene had {before} lights and now has {now}"),
                remedy: "a rendering can go on with the same lights only".into(),
            });
        }
        self.restart();
        self.eye.area_lights = has_area_lights(&scene);
        self.frames.scene_changed(&scene);
        self.eye.scene = scene;
        self.frames.look(&self.eye, &mut self.film);
        Ok(())
    }

    fn save(&self) -> Result<Vec<u8>, RenderError> {
        let (first_frame, learned) = self.frames.save().ok_or_else(state::unable)?;
        let state = State {
            film: Cow::Borrowed(&self.film),
            frame: self.eye.frame,
            first_frame,
            learned,
            counters: self.counters,
            render_s: self.render_s,
        };
        state.to_bytes()
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), RenderError> {
        let state = State::from_bytes(state)?;
        let same_film = state.film.is_like(&self.film);
        if !same_film || !self.frames.restore(state.first_frame, &state.learned) {
            return Err(state::unlike());
        }
        self.film = state.film.into_owned();
        self.eye.frame = state.frame;
        self.counters = state.counters;
        self.render_s = state.render_s;
        Ok(())
    }

    fn skip_frames(&mut self, count: u32) -> Result<(), RenderError> {
        self.eye.frame = self.eye.frame.wrapping_add(count);
        Ok(())
    }

    fn stats(&self) -> RenderStats {
        let sampler = self.frames.sampler_stats();
        let mut skipped = sampler.as_ref().map_or_else(Vec::new, |s| s.skipped.clone());
        let mut skip = |condition: bool, what: &str| {
            if condition {
                skipped.push(what.into());
            }
        };
        let Eye { scene, area_lights, .. } = &self.eye;
        skip(scene.lights.is_empty(), "no lights: no light sampling, no bounces");
        skip(
            !*area_lights && !scene.lights.is_empty(),
            "punctual lights only: no BSDF rays towards lights, no multiple importance sampling",
        );
        skip(self.eye.max_bounces == 0, "no bounces asked for: no indirect light");
        skip(!self.aovs, "no auxiliary images asked for: none kept");
        let counters = self.counters + self.frames.counters(&self.film);
        RenderStats {
            frames: self.film.spp(),
            render_s: self.render_s,
            light_build_s: self.light_build_s,
            prepare_s: self.frames.prepare_s(),
            rays_nearest: counters.rays_nearest,
            rays_occluded: counters.rays_occluded,
            nonfinite_samples: counters.nonfinite,
            sampler,
            skipped,
        }
    }

    fn light_records(&self) -> Vec<LightRecord> {
        self.frames.light_records(&self.eye.scene)
    }

    fn cells(&self) -> Vec<CellRecord> {
        self.frames.cells(&self.eye.scene)
    }

    fn cells_at(&self, points: &[ShadingPoint]) -> Vec<Option<u64>> {
        self.frames.cells_at(points)
    }

    fn light_probabilities(&self, points: &[ShadingPoint]) -> Vec<f64> {
        self.frames.light_probabilities(&self.eye.scene, points)
    }

    fn choosing(&self) -> Option<Choosing> {
        self.frames.choosing(&self.eye)
    }
}

//! The rays of a rendering, written down: to measure what ray tracing alone costs.

use crate::Settings;
use crate::direct::OneLight;
use crate::filter::FilterSampler;
use crate::path::{Counters, FrameView, Probe, Starts, TileLog, path};
use light_cache::UniformSampler;
use scene::bvh::PACKET;
use scene::{Camera, PrimitiveId, Ray, Scene};

/// Rays in the order in which a rendering traces them.
#[derive(Clone, Debug, Default)]
pub struct TracedRays {
    /// Rays for the nearest hit, and the triangle each one leaves.
    pub nearest: Vec<(Ray, PrimitiveId)>,
    /// Shadow rays, the triangle each one leaves and the one it aims at.
    pub occluded: Vec<(Ray, PrimitiveId, PrimitiveId)>,
}

impl Probe for TracedRays {
    fn nearest(&mut self, ray: &Ray, from: PrimitiveId) {
        self.nearest.push((*ray, from));
    }

    fn occluded(&mut self, ray: &Ray, from: PrimitiveId, to: PrimitiveId) {
        self.occluded.push((*ray, from, to));
    }
}

/// All rays of frame number `frame` with the sampler `uniform`, whatever `settings.method` says.
pub fn uniform_rays(scene: &Scene, camera: &Camera, settings: &Settings, frame: u32) -> TracedRays {
    let view = FrameView {
        scene,
        direct: &OneLight(UniformSampler::new(&scene.lights)),
        camera: camera.rays(settings.width, settings.height),
        filter: &FilterSampler::new(settings.pixel_filter),
        image_width: settings.width,
        pixel_sampler: settings.pixel_sampler,
        mis: settings.mis.heuristic(),
        light_samples: 1,
        candidates: 1,
        max_bounces: settings.max_bounces,
        seed: settings.seed,
        frame,
        area_lights: scene.lights.iter().any(|light| !light.is_delta()),
        guided: false,
    };
    let mut rays = TracedRays::default();
    let mut film = crate::Film::new(settings.width, settings.height, false);
    let mut log = TileLog {
        observations: &mut Vec::new(),
        controls: &mut [],
        counters: Counters::default(),
    };
    for tile in film.tiles_mut() {
        for y in tile.y0..tile.y0 + tile.height {
            for column in (0..tile.width).step_by(PACKET) {
                let at = std::array::from_fn(|i| [tile.x0 + column + i as u32, y]);
                let starts = Starts::new(&view, &at, frame);
                for i in 0..PACKET.min((tile.width - column) as usize) {
                    path(&view, &starts.get(i), &mut log, &mut rays);
                }
            }
        }
    }
    rays
}

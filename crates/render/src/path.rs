//! The frame, from the tile down to the last bounce of a path: read it from top to bottom.

mod start;

pub(crate) use start::{Start, Starts};

use crate::bounces::Bounces;
use crate::control::{PathSample, PixelControl};
use crate::direct::{DirectLight, LightNumbers, Vertex};
use crate::film::{AovSample, Tile};
use crate::filter::FilterSampler;
use glam::Vec3;
use light_cache::{Observation, ShadingPoint};
use sampling::hash::hash2;
use sampling::mis::Heuristic;
use sampling::{PixelSampler, PixelSequence};
#[cfg(target_arch = "x86_64")]
use scene::bvh::Kernel;
use scene::bvh::PACKET;
use scene::camera::CameraRays;
use scene::surface::NO_LIGHT;
use scene::{Bsdf, PrimitiveId, Ray, Scene, Surface};

/// Above this GGX alpha the BSDF's directions find lights so seldom that the last vertex of a path does not try: light
/// sampling alone does as well there. Higher values trace more rays; lower values leave noise in reflections of lamps.
const GLOSSY_ALPHA: f32 = 0.5;

/// Worth below which paths play Russian roulette, and what those that survive are worth again. Where lights and bounces are drawn well, roulette is the
/// largest part of the noise. Higher values end paths sooner; lower values trace more rays. (Rooms, 4 bounces, 64 frames: 0.56 times the error that 1 leaves, for
/// 1.45 times the time; `tree` 0.71 and 1.34 times.)
const ROULETTE_BELOW: f32 = 0.25;

/// Least probability with which Russian roulette lets a path live, so that no weight grows by more than 20.
const MIN_SURVIVAL: f32 = 0.05;

/// Everything a frame reads and nothing that it changes.
pub(crate) struct FrameView<'f, D> {
    pub(crate) scene: &'f Scene,
    pub(crate) direct: &'f D,
    pub(crate) camera: CameraRays,
    pub(crate) filter: &'f FilterSampler,
    pub(crate) image_width: u32,
    pub(crate) pixel_sampler: PixelSampler,
    /// How light sampling and BSDF sampling share what both can find; `None`: light sampling alone finds lights.
    pub(crate) mis: Option<Heuristic>,
    pub(crate) max_bounces: u32,
    pub(crate) seed: u64,
    /// Number of the frame in its sequence of random numbers = sample number of every pixel that takes one sample in each frame.
    pub(crate) frame: u32,
    /// Lights drawn at the first surface.
    pub(crate) light_samples: u32,
    /// Lights compared for each that is drawn at a glossy surface.
    pub(crate) candidates: u32,
    /// Whether any light can be hit, so that drawing from the BSDF can find it.
    pub(crate) area_lights: bool,
    /// Whether directions are drawn as has been learned, and what they lead to is noted.
    pub(crate) guided: bool,
}

impl<D> FrameView<'_, D> {
    /// The same frame with random numbers of the sequence that began with frame `first`, which are independent of those of all others.
    pub(crate) fn in_sequence_since(mut self, first: u32) -> Self {
        (self.seed, self.frame) = sequence_since(self.seed, self.frame, first);
        self
    }

    /// The points of the sequence that the light samples of sample number `sample` take: together they are the first points of it,
    /// stratified in every power of two, sample by sample and all samples together.
    #[inline(always)]
    fn light_sample_indices(&self, sample: u32) -> impl Iterator<Item = u32> + use<D> {
        let first = sample.wrapping_mul(self.light_samples);
        (0..self.light_samples).map(move |k| first.wrapping_add(k))
    }
}

/// Seed, and number in the sequence, of frame number `frame` in the sequence that began with frame `first`.
pub(crate) fn sequence_since(seed: u64, frame: u32, first: u32) -> (u64, u32) {
    if first == 0 {
        return (seed, frame);
    }
    let [high, low] = [1, 2].map(|i| u64::from(hash2(first, i)));
    (seed ^ (high << 32 | low), frame.wrapping_sub(first))
}

/// What is counted.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Counters {
    pub(crate) rays_nearest: u64,
    pub(crate) rays_occluded: u64,
    pub(crate) nonfinite: u64,
}

impl std::ops::Add for Counters {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            rays_nearest: self.rays_nearest + other.rays_nearest,
            rays_occluded: self.rays_occluded + other.rays_occluded,
            nonfinite: self.nonfinite + other.nonfinite,
        }
    }
}

/// What the paths of a tile leave behind besides the film.
pub(crate) struct TileLog<'l> {
    /// In the order in which they were made. Stays empty for samplers that do not learn.
    pub(crate) observations: &'l mut Vec<Observation>,
    /// Of the tile's pixels; empty where there is no control variate.
    pub(crate) controls: &'l mut [PixelControl],
    pub(crate) counters: Counters,
}

/// Looks over a path's shoulder. The default methods do nothing and cost nothing.
pub(crate) trait Probe {
    /// A ray for the nearest hit is about to be traced.
    fn nearest(&mut self, _ray: &Ray, _from: PrimitiveId) {}
    /// A shadow ray is about to be traced.
    fn occluded(&mut self, _ray: &Ray, _from: PrimitiveId, _to: PrimitiveId) {}
    /// The path's first hit at `distance` metres is shaded; `light` was chosen there.
    fn first_hit(&mut self, _surface: &Surface, _distance: f32, _light: Option<u32>) {}
}

/// Nothing is looked at.
impl Probe for () {}

/// Auxiliary images: remembers the first hit.
impl Probe for AovSample {
    fn first_hit(&mut self, surface: &Surface, distance: f32, light: Option<u32>) {
        *self = Self {
            albedo: surface.bsdf.diffuse + surface.bsdf.f0,
            normal_ws: surface.bsdf.normal_ws,
            position_ws: surface.position_ws,
            emitted: surface.emitted,
            depth: distance,
            light: light.map_or(-1, i64::from),
        };
    }
}

/// One frame of a tile: one sample for every pixel, or as many as its rate asks for. With `AOVS` the auxiliary images too.
#[allow(unsafe_code, reason = "vector instructions")]
pub(crate) fn render_tile<D: DirectLight, const AOVS: bool>(
    view: &FrameView<'_, D>,
    tile: &mut Tile,
    log: &mut TileLog<'_>,
) {
    #[cfg(target_arch = "x86_64")]
    if view.scene.bvh().kernel() != Kernel::Portable {
        // SAFETY: the kernels other than the portable one need these instructions too, and the processor has those of
        // the kernel in use.
        return unsafe { render_tile_avx2::<D, AOVS>(view, tile, log) };
    }
    render_pixels::<D, AOVS>(view, tile, log);
}

/// [`render_pixels`] with wider vectors.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "vector instructions")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
unsafe fn render_tile_avx2<D: DirectLight, const AOVS: bool>(
    view: &FrameView<'_, D>,
    tile: &mut Tile,
    log: &mut TileLog<'_>,
) {
    render_pixels::<D, AOVS>(view, tile, log);
}

#[inline(always)]
fn render_pixels<D: DirectLight, const AOVS: bool>(view: &FrameView<'_, D>, tile: &mut Tile, log: &mut TileLog<'_>) {
    // Together those that take samples of the same number: they share the points of the sequence, and their eye rays are traced at once.
    let work = tile.work(view.frame);
    for (pixels, samples) in work.groups() {
        for sample in samples {
            for pixels in pixels.chunks(PACKET) {
                render_packet::<D, AOVS>(view, tile, pixels, sample, log);
            }
        }
    }
}

/// Sample number `sample` of up to [`PACKET`] pixels of a tile, counted row by row.
#[inline(always)]
fn render_packet<D: DirectLight, const AOVS: bool>(
    view: &FrameView<'_, D>,
    tile: &mut Tile,
    pixels: &[u8],
    sample: u32,
    log: &mut TileLog<'_>,
) {
    // The last packet may have room left: its first pixel again is of no use, and harmless.
    let at = std::array::from_fn(|i| tile.place(*pixels.get(i).unwrap_or(&pixels[0])));
    let starts = Starts::new(view, &at, sample);
    for (i, &pixel) in pixels.iter().enumerate() {
        let start = starts.get(i);
        let found = if AOVS {
            let mut aovs = AovSample::NONE;
            let found = path(view, &start, log, &mut aovs);
            tile.add_aovs(pixel.into(), &aovs);
            found
        } else {
            path(view, &start, log, &mut ())
        };
        let radiance = match log.controls.get_mut(usize::from(pixel)) {
            Some(control) => control.add(&found),
            None => found.radiance,
        };
        if !tile.add(pixel.into(), radiance) {
            log.counters.nonfinite += 1;
        }
    }
}

/// What one path brings back.
#[inline(always)]
pub(crate) fn path<D: DirectLight>(
    view: &FrameView<'_, D>,
    start: &Start,
    log: &mut TileLog<'_>,
    probe: &mut impl Probe,
) -> PathSample {
    let scene = view.scene;
    let mut ray = Ray {
        origin_ws: view.camera.origin_ws,
        direction_ws: start.direction_ws,
        t_max: f32::INFINITY,
    };
    // The eye ray has been traced with its neighbours.
    log.counters.rays_nearest += 1;
    probe.nearest(&ray, PrimitiveId::NONE);
    let mut found = start.hit;
    let mut later_numbers;
    let mut light_numbers = &start.light_numbers[..view.light_samples as usize];
    let mut left: Option<Departure<D::Local<'_>>> = None;
    let mut brought = PathSample {
        radiance: Vec3::ZERO,
        control: Vec3::ZERO,
    };
    let mut throughput = Vec3::ONE;
    // What it would be if directions were not guided: a path is worth as much where they are.
    let mut unguided = Vec3::ONE;
    let mut bounce = 0;
    let mut bounces = Bounces::default();
    while let Some(hit) = found {
        let surface = scene.surface(&ray, &hit);

        // Its emission, weighed against the chance that light sampling at the vertex before had found it.
        if surface.emitted != Vec3::ZERO {
            let weight = match &left {
                Some(departure) if surface.light != NO_LIGHT => {
                    departure.weight(view, surface.light, ray.direction_ws, hit.t)
                }
                _ => 1.0,
            };
            brought.radiance += throughput * surface.emitted * weight;
        }
        if bounce > view.max_bounces {
            break;
        }

        // Direct light.
        let wo_ws = -ray.direction_ws;
        let (mut vertex, continues) = Vertex::of_path(view, &surface, wo_ws, throughput, bounce);
        let local = view.direct.local(scene, &vertex.point);
        // Where no bounce follows, only lamps are looked for.
        let guided = view.guided && bounce < view.max_bounces;
        if guided {
            vertex.guide = view.direct.guide(&local);
        }
        let guide = vertex.guide;
        let observed = log.observations.len();
        let direct = view.direct.estimate(scene, &local, &vertex, light_numbers, log, probe);
        brought.radiance += direct.radiance;
        brought.control += direct.control;
        if bounce == 0 {
            probe.first_hit(&surface, hit.t, direct.light);
        }
        if !continues {
            break;
        }

        // Russian roulette on the largest component: luminance would kill saturated blues with large weights.
        let sequence = PixelSequence::new(view.seed, start.pixel, start.sample);
        let numbers = sequence.vertex(bounce);
        let survival = (unguided.max_element() / ROULETTE_BELOW).clamp(MIN_SURVIVAL, 1.0);
        let u = numbers.f32(5);
        if u >= survival {
            break;
        }

        // The next direction. One that only one of the two normals sees is lost, as it is for light sampling.
        let Some(sample) = surface.bsdf.sample_guided(wo_ws, u / survival, numbers.vec2(6), guide) else {
            break;
        };
        if surface.geometric_normal_ws.dot(sample.wi_ws) <= 0.0 {
            break;
        }
        throughput *= sample.value / (sample.pdf_solid_angle * survival);
        unguided *= sample.value / (sample.pdf_unguided * survival);
        if guided && log.observations.len() > observed {
            let normal_ws = surface.bsdf.normal_ws;
            bounces.begin(observed, normal_ws, sample.wi_ws, brought.radiance, throughput);
        }
        ray = scene.ray_from(&surface, sample.wi_ws, f32::INFINITY);
        left = Some(Departure {
            local,
            position_ws: surface.position_ws,
            lights_tried: light_numbers.len() as f32 * vertex.candidates as f32,
            pdf_solid_angle: sample.pdf_solid_angle,
        });
        bounce += 1;
        later_numbers = [LightNumbers::new(&sequence.vertex(bounce))];
        light_numbers = &later_numbers;

        // The nearest surface.
        log.counters.rays_nearest += 1;
        probe.nearest(&ray, surface.id);
        found = scene.nearest(&ray, surface.id);
    }
    bounces.end(brought.radiance, log.observations);
    brought
}

/// The vertex that a path has left: what its hits are weighed by.
struct Departure<L> {
    local: L,
    position_ws: Vec3,
    /// How many lights were drawn there, those included that were compared only.
    lights_tried: f32,
    /// Density with which the BSDF drew the direction.
    pdf_solid_angle: f32,
}

impl<L> Departure<L> {
    /// Multiple-importance weight of having met `light` at `distance` along `wi_ws` by drawing from the BSDF.
    fn weight<'f, D>(&self, view: &FrameView<'f, D>, light: u32, wi_ws: Vec3, distance: f32) -> f32
    where
        D: DirectLight<Local<'f> = L>,
    {
        let Some(heuristic) = view.mis else { return 0.0 };
        let pdf_light = view.scene.lights[light as usize].pdf_solid_angle(self.position_ws, wi_ws, distance);
        let pmf = view.direct.pmf(&self.local, light);
        heuristic.of_two(self.pdf_solid_angle, self.lights_tried * pmf * pdf_light)
    }
}

impl<'v> Vertex<'v> {
    /// Number `bounce` of a path, and whether the path may go on from there.
    #[inline(always)]
    pub(crate) fn of_path<D>(
        view: &FrameView<'_, D>,
        surface: &'v Surface,
        wo_ws: Vec3,
        throughput: Vec3,
        bounce: u32,
    ) -> (Self, bool) {
        let glossy = is_glossy(&surface.bsdf);
        let shared = view.mis.filter(|_| view.area_lights);
        let may_hit_light = shared.is_some() && glossy;
        let continues =
            (bounce < view.max_bounces || may_hit_light) && !is_black(&surface.bsdf) && !view.scene.lights.is_empty();
        let vertex = Self {
            surface,
            wo_ws,
            throughput,
            point: ShadingPoint {
                position_ws: surface.position_ws,
                normal_ws: surface.bsdf.normal_ws,
                primary: bounce == 0,
            },
            shared: shared.filter(|_| continues),
            candidates: if glossy { view.candidates } else { 1 },
            guide: None,
        };
        (vertex, continues)
    }
}

/// Whether drawing from the BSDF is worth a ray of its own to find lights.
fn is_glossy(bsdf: &Bsdf) -> bool {
    !bsdf.is_lambert() && bsdf.alpha < GLOSSY_ALPHA
}

/// Whether nothing is reflected, as by the glass of most lamps.
pub(crate) fn is_black(bsdf: &Bsdf) -> bool {
    bsdf.diffuse == Vec3::ZERO && bsdf.is_lambert()
}

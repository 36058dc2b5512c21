//! The frame, from the tile down to the last bounce of a path: read it from top to bottom.

use crate::direct::{DirectLight, Vertex};
use crate::film::{AovSample, TILE_SIZE, Tile};
use crate::filter::FilterSampler;
use glam::{Vec2, Vec3};
use light_cache::{Observation, ShadingPoint};
use sampling::{PixelSequence, mis};
use scene::camera::CameraRays;
use scene::surface::NO_LIGHT;
use scene::{Bsdf, PrimitiveId, Ray, Scene, Surface};

/// Above this GGX alpha the BSDF's directions find lights so seldom that the last vertex of a path does not try: light
/// sampling alone does as well there. Higher values trace more rays; lower values leave noise in reflections of lamps.
const GLOSSY_ALPHA: f32 = 0.5;

/// Least probability with which Russian roulette lets a path live, so that no weight grows beyond 20.
const MIN_SURVIVAL: f32 = 0.05;

/// Everything a frame reads and nothing that it changes.
pub(crate) struct FrameView<'f, D> {
    pub(crate) scene: &'f Scene,
    pub(crate) direct: &'f D,
    pub(crate) camera: CameraRays,
    pub(crate) filter: &'f FilterSampler,
    pub(crate) image_width: u32,
    pub(crate) max_bounces: u32,
    pub(crate) seed: u64,
    /// Number of the frame = sample number of every pixel.
    pub(crate) frame: u32,
    /// Whether any light can be hit, so that drawing from the BSDF can find it.
    pub(crate) area_lights: bool,
}

/// What is counted.
#[derive(Clone, Copy, Debug, Default)]
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
            depth: distance,
            light: light.map_or(-1, i64::from),
        };
    }
}

/// One sample for every pixel of a tile. With `AOVS` the auxiliary images too.
pub(crate) fn render_tile<D: DirectLight, const AOVS: bool>(
    view: &FrameView<'_, D>,
    tile: &mut Tile,
    log: &mut TileLog<'_>,
) {
    for row in 0..tile.height {
        // The eye rays of a row first: one after the other they keep the processor busier than between long paths.
        let starts: [Start; TILE_SIZE as usize] =
            std::array::from_fn(|column| Start::new(view, tile.x0 + column as u32, tile.y0 + row));
        for (column, start) in starts[..tile.width as usize].iter().enumerate() {
            let index = row as usize * tile.width as usize + column;
            let radiance = if AOVS {
                let mut aovs = AovSample::NONE;
                let radiance = path(view, start, log, &mut aovs);
                tile.add_aovs(index, &aovs);
                radiance
            } else {
                path(view, start, log, &mut ())
            };
            if !tile.add(index, radiance) {
                log.counters.nonfinite += 1;
            }
        }
    }
}

/// Where a path begins.
pub(crate) struct Start {
    sequence: PixelSequence,
    direction_ws: Vec3,
}

impl Start {
    /// In the pixel of column `x` and row `y`.
    #[inline(always)]
    pub(crate) fn new<D>(view: &FrameView<'_, D>, x: u32, y: u32) -> Self {
        let sequence = PixelSequence::new(view.seed, y * view.image_width + x, view.frame);
        let pixel = Vec2::new(x as f32, y as f32);
        let offset = view.filter.offset(sequence.vertex(0).vec2(0));
        Self {
            sequence,
            direction_ws: view.camera.direction_ws(pixel + offset),
        }
    }
}

/// The radiance that one path brings back.
#[inline(always)]
pub(crate) fn path<D: DirectLight>(
    view: &FrameView<'_, D>,
    start: &Start,
    log: &mut TileLog<'_>,
    probe: &mut impl Probe,
) -> Vec3 {
    let scene = view.scene;
    let mut numbers = start.sequence.vertex(0);
    let mut ray = Ray {
        origin_ws: view.camera.origin_ws,
        direction_ws: start.direction_ws,
        t_max: f32::INFINITY,
    };
    let mut left: Option<Departure<D::Local<'_>>> = None;
    let mut radiance = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    let mut bounce = 0;
    loop {
        // The nearest surface.
        let from = left.as_ref().map_or(PrimitiveId::NONE, |l| l.id);
        log.counters.rays_nearest += 1;
        probe.nearest(&ray, from);
        let Some(hit) = scene.nearest(&ray, from) else { break };
        let surface = scene.surface(&ray, &hit);

        // Its emission, weighed against the chance that light sampling at the vertex before had found it.
        if surface.emitted != Vec3::ZERO {
            let weight = match &left {
                Some(departure) if surface.light != NO_LIGHT => {
                    departure.weight(view, surface.light, ray.direction_ws, hit.t)
                }
                _ => 1.0,
            };
            radiance += throughput * surface.emitted * weight;
        }
        if bounce > view.max_bounces {
            break;
        }

        // Direct light.
        let wo_ws = -ray.direction_ws;
        let may_hit_light = view.area_lights && is_glossy(&surface.bsdf);
        let continues =
            (bounce < view.max_bounces || may_hit_light) && !is_black(&surface.bsdf) && !scene.lights.is_empty();
        let point = ShadingPoint {
            position_ws: surface.position_ws,
            normal_ws: surface.bsdf.normal_ws,
            primary: bounce == 0,
        };
        let local = view.direct.local(scene, &point);
        let vertex = Vertex {
            surface: &surface,
            wo_ws,
            throughput,
            point,
            competes: continues && view.area_lights,
        };
        let direct = view.direct.estimate(scene, &local, &vertex, &numbers, log, probe);
        radiance += direct.radiance;
        if bounce == 0 {
            probe.first_hit(&surface, hit.t, direct.light);
        }
        if !continues {
            break;
        }

        // Russian roulette on the largest component: luminance would kill saturated blues with large weights.
        let survival = throughput.max_element().clamp(MIN_SURVIVAL, 1.0);
        let u = numbers.f32(5);
        if u >= survival {
            break;
        }

        // The next direction. One that only one of the two normals sees is lost, as it is for light sampling.
        let Some(sample) = surface.bsdf.sample(wo_ws, u / survival, numbers.vec2(6)) else {
            break;
        };
        if surface.geometric_normal_ws.dot(sample.wi_ws) <= 0.0 {
            break;
        }
        throughput *= sample.value / (sample.pdf_solid_angle * survival);
        ray = scene.ray_from(&surface, sample.wi_ws, f32::INFINITY);
        left = Some(Departure {
            local,
            position_ws: surface.position_ws,
            id: surface.id,
            pdf_solid_angle: sample.pdf_solid_angle,
        });
        bounce += 1;
        numbers = start.sequence.vertex(bounce);
    }
    radiance
}

/// The vertex that a path has left: what its hits are weighed by.
struct Departure<L> {
    local: L,
    position_ws: Vec3,
    id: PrimitiveId,
    /// Density with which the BSDF drew the direction.
    pdf_solid_angle: f32,
}

impl<L> Departure<L> {
    /// Multiple-importance weight of having met `light` at `distance` along `wi_ws` by drawing from the BSDF.
    fn weight<'f, D>(&self, view: &FrameView<'f, D>, light: u32, wi_ws: Vec3, distance: f32) -> f32
    where
        D: DirectLight<Local<'f> = L>,
    {
        let pdf_light = view.scene.lights[light as usize].pdf_solid_angle(self.position_ws, wi_ws, distance);
        mis::power(self.pdf_solid_angle, view.direct.pmf(&self.local, light) * pdf_light)
    }
}

/// Whether drawing from the BSDF is worth a ray of its own to find lights.
fn is_glossy(bsdf: &Bsdf) -> bool {
    !bsdf.is_lambert() && bsdf.alpha < GLOSSY_ALPHA
}

/// Whether nothing is reflected, as by the glass of most lamps.
fn is_black(bsdf: &Bsdf) -> bool {
    bsdf.diffuse == Vec3::ZERO && bsdf.is_lambert()
}

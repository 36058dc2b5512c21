//! Direct light at a path vertex by drawing one light (next-event estimation).

use crate::path::{Probe, TileLog};
use crate::resampling;
use crate::settings::MAX_LIGHT_SAMPLES;
use glam::{Vec2, Vec3};
use light_cache::{CellRecord, Choice, LightRecord, LightSampler, Observation, Pace, SamplerStats, ShadingPoint};
use sampling::HemisphereGuide;
use sampling::mis::Heuristic;
use sampling::{VertexSequence, unit_f32};
use scene::{PrimitiveId, Ray, Scene, Surface, luminance};
use std::f32::consts::FRAC_1_PI;

/// A path vertex that wants direct light.
pub(crate) struct Vertex<'v> {
    pub(crate) surface: &'v Surface,
    pub(crate) wo_ws: Vec3,
    /// Weight of the path up to here.
    pub(crate) throughput: Vec3,
    pub(crate) point: ShadingPoint,
    /// If a direction drawn from the BSDF will also look for lights: how both share what they find.
    pub(crate) shared: Option<Heuristic>,
    /// Lights compared for each one that is drawn; see [`crate::resampling`].
    pub(crate) candidates: u32,
    /// How the diffuse lobe is drawn where the path goes on; `None`: as it is.
    pub(crate) guide: Option<&'v HemisphereGuide>,
}

/// The random numbers of direct light at a vertex, 32 bits each.
#[derive(Clone, Copy, Default)]
pub(crate) struct LightNumbers {
    /// Chooses the light.
    pub(crate) choice: u32,
    /// Choose the point on it.
    pub(crate) point: [u32; 2],
}

impl LightNumbers {
    /// The dimensions of a vertex that are meant for it.
    #[inline]
    pub(crate) fn new(numbers: &VertexSequence) -> Self {
        Self {
            choice: numbers.u32(2),
            point: [numbers.u32(3), numbers.u32(4)],
        }
    }
}

/// An estimate of direct light.
pub(crate) struct Direct {
    /// Throughput included.
    pub(crate) radiance: Vec3,
    /// A control variate, of mean zero: throughput included.
    pub(crate) control: Vec3,
    /// The light that was chosen, the first of several, if one was.
    pub(crate) light: Option<u32>,
}

/// A way to estimate direct light: one light chosen by a sampler, or all of them.
pub(crate) trait DirectLight: Sync + Send {
    /// What is worked out once per vertex.
    type Local<'a>
    where
        Self: 'a;

    /// Prepares for `point`.
    fn local(&self, scene: &Scene, point: &ShadingPoint) -> Self::Local<'_>;

    /// The direct light at `vertex`: the mean of as many samples as there are `numbers`.
    fn estimate(
        &self,
        scene: &Scene,
        local: &Self::Local<'_>,
        vertex: &Vertex<'_>,
        numbers: &[LightNumbers],
        log: &mut TileLog<'_>,
        probe: &mut impl Probe,
    ) -> Direct;

    /// The probability with which [`DirectLight::estimate`] looks at `light`.
    fn pmf(&self, local: &Self::Local<'_>, light: u32) -> f32;

    /// See [`LightSampler::guides`].
    fn guides(&self) -> bool {
        false
    }

    /// See [`LightSampler::guide`].
    fn guide<'a>(&'a self, _local: &Self::Local<'a>) -> Option<&'a HemisphereGuide> {
        None
    }

    /// See [`LightSampler::add_pmfs`]; nothing where no choice is made.
    fn add_pmfs(&self, _local: &Self::Local<'_>, _sum: &mut [f64]) {}

    /// See [`LightSampler::pace`].
    fn pace(&self) -> Pace {
        Pace::STEADY
    }

    /// See [`LightSampler::is_controlled`].
    fn is_controlled(&self) -> bool {
        false
    }

    /// Tells where the eye is.
    fn set_eye(&mut self, _eye_ws: Vec3) {}

    /// Tells that the scene has changed: see [`LightSampler::scene_changed`].
    fn scene_changed(&mut self, _scene: &Scene) {}

    /// Learns from a frame.
    fn end_frame(&mut self, _scene: &Scene, _logs: &[Vec<Observation>]) {}

    /// See [`LightSampler::save`].
    fn save(&self) -> Option<Vec<u8>> {
        Some(Vec::new())
    }

    /// See [`LightSampler::restore`].
    fn restore(&mut self, state: &[u8]) -> bool {
        state.is_empty()
    }

    /// What a sampler can tell about itself; `None` if there is none.
    fn sampler_stats(&self) -> Option<SamplerStats> {
        None
    }

    /// What is known about each light.
    fn records(&self, _scene: &Scene) -> Vec<LightRecord> {
        Vec::new()
    }

    /// What is known in each cell.
    fn cells(&self, _scene: &Scene) -> Vec<CellRecord> {
        Vec::new()
    }

    /// The number of the cell that serves a point.
    fn cell_at(&self, _point: &ShadingPoint) -> Option<u64> {
        None
    }

    /// Chooses a light and does nothing with it; nothing where no choice is made.
    fn choose(&self, _scene: &Scene, _point: &ShadingPoint, _u: u32) -> Option<Choice> {
        None
    }
}

/// One light per vertex, chosen by a sampler.
pub(crate) struct OneLight<S>(pub(crate) S);

impl<S: LightSampler> DirectLight for OneLight<S> {
    type Local<'a>
        = S::Local<'a>
    where
        Self: 'a;

    #[inline]
    fn local(&self, scene: &Scene, point: &ShadingPoint) -> Self::Local<'_> {
        self.0.local(scene, point)
    }

    #[inline(always)]
    fn estimate(
        &self,
        scene: &Scene,
        local: &Self::Local<'_>,
        vertex: &Vertex<'_>,
        numbers: &[LightNumbers],
        log: &mut TileLog<'_>,
        probe: &mut impl Probe,
    ) -> Direct {
        if vertex.candidates > 1 {
            return resampling::estimate(&self.0, scene, local, vertex, numbers, log, probe);
        }
        let mut choices = [None; MAX_LIGHT_SAMPLES as usize];
        let choices = &mut choices[..numbers.len()];
        match numbers {
            [one] => choices[0] = self.0.sample(local, one.choice),
            _ => {
                let mut us = [0; MAX_LIGHT_SAMPLES as usize];
                us.iter_mut().zip(numbers).for_each(|(u, n)| *u = n.choice);
                self.0.sample_each(local, &us[..numbers.len()], choices);
            }
        }
        let count = numbers.len() as f32;
        let mut radiance = Vec3::ZERO;
        let mut control = Vec3::ZERO;
        for (choice, numbers) in choices.iter().zip(numbers) {
            let Some(choice) = choice else { continue };
            // Whether or not the light arrives: the mean over all draws is zero.
            control += vertex.throughput * vertex.surface.bsdf.diffuse * choice.control * (FRAC_1_PI / count);
            let on_light = Vec2::from(numbers.point.map(unit_f32));
            let connection = Connection::new(scene, vertex, choice.light, count * choice.pmf, on_light);
            let visible = connection
                .as_ref()
                .is_some_and(|c| c.is_visible(scene, vertex, log, probe));
            if S::LEARNS {
                log.observations
                    .push(observation(vertex, *choice, connection.as_ref(), visible));
            }
            if let Some(connection) = connection
                && visible
            {
                radiance += connection.contribution(count * choice.pmf);
            }
        }
        Direct {
            radiance,
            control,
            light: choices[0].map(|choice| choice.light),
        }
    }

    #[inline]
    fn pmf(&self, local: &Self::Local<'_>, light: u32) -> f32 {
        self.0.pmf(local, light)
    }

    fn guides(&self) -> bool {
        self.0.guides()
    }

    #[inline]
    fn guide<'a>(&'a self, local: &Self::Local<'a>) -> Option<&'a HemisphereGuide> {
        self.0.guide(local)
    }

    fn add_pmfs(&self, local: &Self::Local<'_>, sum: &mut [f64]) {
        self.0.add_pmfs(local, sum);
    }

    fn pace(&self) -> Pace {
        self.0.pace()
    }

    fn is_controlled(&self) -> bool {
        self.0.is_controlled()
    }

    fn set_eye(&mut self, eye_ws: Vec3) {
        self.0.set_eye(eye_ws);
    }

    fn scene_changed(&mut self, scene: &Scene) {
        self.0.scene_changed(scene);
    }

    fn end_frame(&mut self, scene: &Scene, logs: &[Vec<Observation>]) {
        self.0.end_frame(scene, logs);
    }

    fn save(&self) -> Option<Vec<u8>> {
        self.0.save()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        self.0.restore(state)
    }

    fn sampler_stats(&self) -> Option<SamplerStats> {
        Some(self.0.stats())
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        self.0.records(scene)
    }

    fn cells(&self, scene: &Scene) -> Vec<CellRecord> {
        self.0.cells(scene)
    }

    fn cell_at(&self, point: &ShadingPoint) -> Option<u64> {
        self.0.cell_at(point)
    }

    #[inline]
    fn choose(&self, scene: &Scene, point: &ShadingPoint, u: u32) -> Option<Choice> {
        self.0.sample(&self.0.local(scene, point), u)
    }
}

/// What was found out about a light; `connection`: `None` if it cannot reach the vertex.
#[inline(always)]
pub(crate) fn observation(
    vertex: &Vertex<'_>,
    choice: Choice,
    connection: Option<&Connection>,
    visible: bool,
) -> Observation {
    Observation {
        point: vertex.point,
        light: choice.light,
        unshadowed: connection.map_or(0.0, Connection::unshadowed),
        irradiance: connection.map_or(0.0, |c| c.irradiance),
        pmf: choice.pmf,
        visible,
        weight: 1,
        bounce: None,
    }
}

/// A vertex joined with a point on a light, visibility unknown.
pub(crate) struct Connection {
    /// Throughput x BSDF x cosine x radiance / pdf of the point; never black, not yet divided by the light's probability.
    unweighted: Vec3,
    /// Multiple-importance weight.
    weight: f32,
    /// The weight if the light had been chosen for certain: what is learned must not depend on what was learned.
    weight_if_certain: f32,
    /// Luminance of cosine x radiance / pdf of the point on the light.
    irradiance: f32,
    shadow_ray: Ray,
    to: PrimitiveId,
}

impl Connection {
    /// Joins `vertex` with the point `u` on `light`, chosen `pmf` times in the mean; `None` if no light can arrive.
    #[inline(always)]
    pub(crate) fn new(scene: &Scene, vertex: &Vertex<'_>, light: u32, pmf: f32, u: Vec2) -> Option<Self> {
        let surface = vertex.surface;
        let point = scene.sample_light(light, surface.position_ws, u)?;
        // Both normals must see the light: the shading normal by `eval_pdf`, the geometric one here. Otherwise light leaks
        // through surfaces, or the two strategies would disagree.
        if surface.geometric_normal_ws.dot(point.wi_ws) <= 0.0 {
            return None;
        }
        let (value, pdf_bsdf) = surface.bsdf.eval_pdf_guided(vertex.wo_ws, point.wi_ws, vertex.guide);
        let unweighted = vertex.throughput * value * point.radiance / point.pdf_solid_angle;
        if unweighted == Vec3::ZERO {
            return None;
        }
        let record = &scene.lights[light as usize];
        let (weight, weight_if_certain) = match vertex.shared {
            Some(heuristic) if !record.is_delta() => (
                heuristic.of_two(pmf * point.pdf_solid_angle, pdf_bsdf),
                heuristic.of_two(point.pdf_solid_angle, pdf_bsdf),
            ),
            _ => (1.0, 1.0),
        };
        Some(Self {
            unweighted,
            weight,
            weight_if_certain,
            irradiance: luminance(point.radiance) * surface.bsdf.normal_ws.dot(point.wi_ws).max(0.0)
                / point.pdf_solid_angle,
            shadow_ray: scene.shadow_ray(surface, point.wi_ws, point.distance),
            to: record.primitive,
        })
    }

    /// What the light adds if it is visible, having been chosen `pmf` times in the mean.
    #[inline]
    pub(crate) fn contribution(&self, pmf: f32) -> Vec3 {
        self.unweighted * (self.weight / pmf)
    }

    /// How much of the light that arrives is reflected along the path, by this strategy's part of the work; above 0, finite.
    #[inline]
    pub(crate) fn reflected_share(&self) -> f32 {
        let share = luminance(self.unweighted) * self.weight / self.irradiance;
        if share > f32::MIN_POSITIVE {
            share.min(1e30)
        } else {
            f32::MIN_POSITIVE
        }
    }

    /// Luminance of what the light would add if nothing stood in the way, the light being chosen for certain.
    #[inline]
    fn unshadowed(&self) -> f32 {
        let y = luminance(self.unweighted) * self.weight_if_certain;
        if y < f32::INFINITY { y } else { 0.0 }
    }

    /// Traces the shadow ray.
    #[inline(always)]
    pub(crate) fn is_visible(
        &self,
        scene: &Scene,
        vertex: &Vertex<'_>,
        log: &mut TileLog<'_>,
        probe: &mut impl Probe,
    ) -> bool {
        log.counters.rays_occluded += 1;
        probe.occluded(&self.shadow_ray, vertex.surface.id, self.to);
        !scene.occluded(&self.shadow_ray, vertex.surface.id, self.to)
    }
}

//! What `dump` writes about each light, and a wrapper that gathers it around any sampler.

use crate::{CellRecord, Choice, LightRecord, LightSampler, Observation, Pace, Packed, SamplerStats, ShadingPoint};
use glam::Vec3;
use sampling::HemisphereGuide;
use sampling::hemisphere::uniform_sphere;
use sampling::{Random, unit_f32};
use scene::Scene;

/// Points over which position-dependent probabilities are averaged, at most.
const MAX_POINTS: usize = 256;
/// Probabilities worked out for one set of records, at most: bounds its time for very many lights.
const MAX_PROBABILITIES: usize = 1 << 26;

/// Records that hold what the sampler itself can say: probabilities, averaged over `points` (over points strewn in the
/// scene's bounding sphere if there are none).
pub(crate) fn of_sampler<S: LightSampler>(sampler: &S, scene: &Scene, points: &[ShadingPoint]) -> Vec<LightRecord> {
    let count = scene.lights.len();
    let mut sum = vec![0.0; count];
    let strewn;
    let points = if points.is_empty() {
        strewn = strewn_points(scene);
        &strewn
    } else {
        points
    };
    let affordable = (MAX_PROBABILITIES / count.max(1)).clamp(16, MAX_POINTS);
    let step = points.len().div_ceil(affordable).max(1);
    for point in points.iter().step_by(step) {
        sampler.add_pmfs(&sampler.local(scene, point), &mut sum);
    }
    let total = sum.iter().sum::<f64>();
    let min_probability = sampler.stats().min_probability;
    sum.into_iter()
        .map(|p| LightRecord {
            probability: if total > 0.0 { p / total } else { 0.0 },
            min_probability,
            visible_fraction: f64::NAN,
            ..LightRecord::default()
        })
        .collect()
}

/// Points where light may be wanted when none is known: evenly in the scene's bounding sphere, facing anywhere.
fn strewn_points(scene: &Scene) -> Vec<ShadingPoint> {
    let random = |i: u32| Random::new(0, i, 0);
    (0..MAX_POINTS as u32)
        .map(|i| {
            let radius = scene.radius * unit_f32(random(i).u32(0)).cbrt();
            ShadingPoint {
                position_ws: scene.center_ws + radius * uniform_sphere(random(i).vec2(1)),
                normal_ws: uniform_sphere(random(i).vec2(3)),
                primary: true,
            }
        })
        .collect()
}

/// What has been observed of one light.
#[derive(Clone, Copy, Debug, Default)]
struct Observed {
    samples: u64,
    max: f64,
    visible: f64,
    unshadowed: f64,
}

/// Keeps a record of every light around any sampler; choice and learning are the inner sampler's own.
#[derive(Debug)]
pub struct Recording<S> {
    inner: S,
    observed: Vec<Observed>,
    observations: u64,
    /// Some of the last frame's points.
    points: Vec<ShadingPoint>,
    /// Factor by which the remembered maximum shrinks every frame.
    decay: f64,
    frame: u32,
    /// Frame of each light's maximum, so that decay costs nothing until it is asked for.
    max_frame: Vec<u32>,
}

impl<S: LightSampler> Recording<S> {
    /// Wraps `inner`; maxima shrink by `table_decay` (see [`crate::Settings::table_decay`]) per frame.
    pub fn new(inner: S, scene: &Scene, table_decay: f32) -> Self {
        Self {
            inner,
            observed: vec![Observed::default(); scene.lights.len()],
            observations: 0,
            points: Vec::new(),
            decay: f64::from(table_decay),
            frame: 0,
            max_frame: vec![0; scene.lights.len()],
        }
    }

    fn max_now(&self, light: usize) -> f64 {
        self.observed[light].max * self.decay.powi((self.frame - self.max_frame[light]) as i32)
    }
}

impl<S: LightSampler> LightSampler for Recording<S> {
    type Local<'a>
        = S::Local<'a>
    where
        Self: 'a;
    const LEARNS: bool = true;

    #[inline]
    fn local(&self, scene: &Scene, point: &ShadingPoint) -> Self::Local<'_> {
        self.inner.local(scene, point)
    }

    #[inline]
    fn sample(&self, local: &Self::Local<'_>, u: u32) -> Option<Choice> {
        self.inner.sample(local, u)
    }

    #[inline]
    fn pmf(&self, local: &Self::Local<'_>, light: u32) -> f32 {
        self.inner.pmf(local, light)
    }

    fn add_pmfs(&self, local: &Self::Local<'_>, sum: &mut [f64]) {
        self.inner.add_pmfs(local, sum);
    }

    #[inline]
    fn sample_each(&self, local: &Self::Local<'_>, us: &[u32], choices: &mut [Option<Choice>]) {
        self.inner.sample_each(local, us, choices);
    }

    fn guides(&self) -> bool {
        self.inner.guides()
    }

    #[inline]
    fn guide<'a>(&'a self, local: &Self::Local<'a>) -> Option<&'a HemisphereGuide> {
        self.inner.guide(local)
    }

    fn pace(&self) -> Pace {
        self.inner.pace()
    }

    fn is_controlled(&self) -> bool {
        self.inner.is_controlled()
    }

    fn set_eye(&mut self, eye_ws: Vec3) {
        self.inner.set_eye(eye_ws);
    }

    fn scene_changed(&mut self, scene: &Scene) {
        self.inner.scene_changed(scene);
    }

    fn end_frame(&mut self, scene: &Scene, logs: &[Vec<Observation>]) {
        self.inner.end_frame(scene, logs);
        self.frame += 1;
        let count = logs.iter().map(Vec::len).sum::<usize>();
        if count == 0 {
            return;
        }
        self.points.clear();
        let step = count.div_ceil(MAX_POINTS);
        self.points.extend(logs.iter().flatten().step_by(step).map(|o| o.point));
        self.observations += count as u64;
        for observation in logs.iter().flatten() {
            let light = observation.light as usize;
            let unshadowed = f64::from(observation.unshadowed);
            let weighted = unshadowed / f64::from(observation.pmf.max(f32::MIN_POSITIVE));
            let remembered = self.max_now(light);
            let record = &mut self.observed[light];
            record.samples += 1;
            record.unshadowed += weighted;
            if observation.visible {
                record.visible += weighted;
                if unshadowed >= remembered {
                    record.max = unshadowed;
                    self.max_frame[light] = self.frame;
                }
            }
        }
    }

    fn stats(&self) -> SamplerStats {
        self.inner.stats()
    }

    fn pack(&self) -> Option<Packed> {
        self.inner.pack()
    }

    fn cells(&self, scene: &Scene) -> Vec<CellRecord> {
        self.inner.cells(scene)
    }

    fn cell_at(&self, point: &ShadingPoint) -> Option<u64> {
        self.inner.cell_at(point)
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        let mut records = of_sampler(&self.inner, scene, &self.points);
        for (light, (record, observed)) in records.iter_mut().zip(&self.observed).enumerate() {
            record.max_contribution = self.max_now(light);
            record.mean_contribution = observed.visible / self.observations.max(1) as f64;
            record.visible_fraction = observed.visible / observed.unshadowed;
            record.samples = observed.samples;
        }
        records
    }
}

impl ShadingPoint {
    /// Bits that differ from point to point, to fill up random numbers below their last bit.
    #[inline]
    pub(crate) fn salt(&self) -> u32 {
        let Vec3 { x, y, z } = self.position_ws;
        x.to_bits() ^ y.to_bits().rotate_left(11) ^ z.to_bits().rotate_left(22)
    }
}

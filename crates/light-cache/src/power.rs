//! In proportion to emitted power.

use crate::records;
use crate::{Choice, LightRecord, LightSampler, Observation, SamplerStats, Settings, ShadingPoint};
use sampling::Discrete;
use scene::{Light, Scene};
use std::time::Instant;

/// Draws lights in proportion to their power, mixed with the uniform floor of [`Settings::min_probability_mass`].
#[derive(Clone, Debug)]
pub struct PowerSampler {
    /// `None` if there are no lights.
    distribution: Option<Discrete>,
    build_s: f64,
}

impl PowerSampler {
    /// The distribution over `lights`.
    pub fn new(lights: &[Light], settings: &Settings) -> Self {
        let start = Instant::now();
        let weights: Vec<f64> = lights.iter().map(|light| f64::from(light.power)).collect();
        Self {
            distribution: Discrete::new(&weights, f64::from(settings.min_probability_mass)),
            build_s: start.elapsed().as_secs_f64(),
        }
    }
}

impl LightSampler for PowerSampler {
    type Local<'a> = ();
    const LEARNS: bool = false;

    #[inline]
    fn local(&self, _scene: &Scene, _point: &ShadingPoint) {}

    #[inline]
    fn sample(&self, (): &(), u: u32) -> Option<Choice> {
        let draw = self.distribution.as_ref()?.sample(u);
        Some(Choice {
            light: draw.index,
            pmf: draw.pmf(),
        })
    }

    #[inline]
    fn pmf(&self, (): &(), light: u32) -> f32 {
        self.distribution.as_ref().map_or(0.0, |d| d.pmf(light))
    }

    fn end_frame(&mut self, _scene: &Scene, _logs: &[Vec<Observation>]) {}

    fn stats(&self) -> SamplerStats {
        SamplerStats {
            bytes: self.distribution.as_ref().map_or(0, Discrete::bytes),
            min_probability: self.distribution.as_ref().map_or(0.0, Discrete::floor),
            build_s: self.build_s,
            ..SamplerStats::default()
        }
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        records::of_sampler(self, scene, &[])
    }
}

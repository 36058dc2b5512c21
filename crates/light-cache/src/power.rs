//! In proportion to emitted power.

use crate::records;
use crate::{Choice, LightRecord, LightSampler, Observation, Packed, SamplerStats, Scheme, Settings, ShadingPoint};
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
        Some(Choice::new(draw.index, draw.pmf()))
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

    fn pack(&self) -> Option<Packed> {
        let mut words = vec![0; 2];
        let at = self.distribution.as_ref()?.pack(&mut words);
        words[..2].fill(at);
        Some(Packed {
            scheme: Scheme::Discrete,
            words,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check, check_each_light_is_drawn, mixed_lights, points, scene_of};

    #[test]
    fn keeps_the_promises_of_a_sampler() {
        for count in [1, 2, 300] {
            let scene = scene_of(mixed_lights(count, 3));
            let sampler = PowerSampler::new(&scene.lights, &Settings::default());
            check(&sampler, &scene, &points(4, 5));
            check_each_light_is_drawn(&sampler, &scene);
        }
    }

    #[test]
    fn black_and_missing_lights_do_no_harm() {
        let mut lights = mixed_lights(20, 3);
        for light in &mut lights {
            light.power = 0.0;
        }
        let sampler = PowerSampler::new(&lights, &Settings::default());
        assert!((sampler.pmf(&(), 3) - 0.05).abs() < 1e-6);
        assert!(PowerSampler::new(&[], &Settings::default()).sample(&(), 5).is_none());
    }
}

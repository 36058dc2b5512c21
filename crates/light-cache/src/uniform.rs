//! Every light alike.

use crate::records;
use crate::{Choice, LightRecord, LightSampler, Observation, Packed, SamplerStats, Scheme, ShadingPoint};
use sampling::discrete::TOTAL;
use scene::{Light, Scene};

/// Draws every light with the same probability, up to one unit of 2^-32: the 2^32 random numbers are dealt out in whole numbers, and
/// the first few lights get one more than the rest.
#[derive(Clone, Debug)]
pub struct UniformSampler {
    /// Number of lights.
    count: u32,
    /// Random numbers per light; the first `longer` lights have one more.
    units: u32,
    longer: u32,
    /// Where the lights with one unit less begin.
    boundary: u64,
    pmf_longer: f32,
    pmf_rest: f32,
}

impl UniformSampler {
    /// A uniform choice among `lights`.
    pub fn new(lights: &[Light]) -> Self {
        let count = lights.len() as u32;
        let (units, longer) = if count == 0 {
            (0, 0)
        } else {
            (TOTAL / u64::from(count), (TOTAL % u64::from(count)) as u32)
        };
        let probability = |units: u64| units as f32 / TOTAL as f32;
        Self {
            count,
            // One light owns all 2^32 numbers, one more than fits; `sample` never divides then.
            units: u32::try_from(units).unwrap_or(u32::MAX),
            longer,
            boundary: u64::from(longer) * (units + 1),
            pmf_longer: probability(units + 1),
            pmf_rest: probability(units),
        }
    }
}

impl LightSampler for UniformSampler {
    type Local<'a> = ();
    const LEARNS: bool = false;

    #[inline]
    fn local(&self, _scene: &Scene, _point: &ShadingPoint) {}

    #[inline]
    fn sample(&self, (): &(), u: u32) -> Option<Choice> {
        if self.count < 2 {
            return (self.count == 1).then_some(Choice::new(0, 1.0));
        }
        Some(if u64::from(u) < self.boundary {
            Choice::new(u / (self.units + 1), self.pmf_longer)
        } else {
            Choice::new(self.longer + (u - self.boundary as u32) / self.units, self.pmf_rest)
        })
    }

    #[inline]
    fn pmf(&self, (): &(), light: u32) -> f32 {
        if light < self.longer {
            self.pmf_longer
        } else {
            self.pmf_rest
        }
    }

    fn end_frame(&mut self, _scene: &Scene, _logs: &[Vec<Observation>]) {}

    fn stats(&self) -> SamplerStats {
        SamplerStats {
            bytes: size_of::<Self>(),
            min_probability: f64::from(self.pmf_rest),
            skipped: match self.count {
                0 => vec!["no lights: no light sampling, no bounces".into()],
                1 => vec!["one light: nothing to choose, nothing to learn".into()],
                _ => Vec::new(),
            },
            ..SamplerStats::default()
        }
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        records::of_sampler(self, scene, &[])
    }

    fn pack(&self) -> Option<Packed> {
        let (longer, rest) = match self.count {
            1 => (1.0, 1.0),
            _ => (self.pmf_longer, self.pmf_rest),
        };
        Some(Packed {
            scheme: Scheme::Uniform,
            words: vec![
                self.count,
                self.units,
                self.longer,
                // Below 2^32 where there is a choice, and not used where there is none.
                self.boundary as u32,
                longer.to_bits(),
                rest.to_bits(),
            ],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check, check_each_light_is_drawn, mixed_lights, points, scene_of};

    #[test]
    fn keeps_the_promises_of_a_sampler() {
        for count in [1, 2, 7, 300] {
            let scene = scene_of(mixed_lights(count, 3));
            let sampler = UniformSampler::new(&scene.lights);
            check(&sampler, &scene, &points(4, 5));
            check_each_light_is_drawn(&sampler, &scene);
        }
    }

    #[test]
    fn the_numbers_are_dealt_out_exactly() {
        let sampler = UniformSampler::new(&mixed_lights(7, 1));
        // 2^32 = 7 x 613,566,756 + 4.
        let last = |light: u64| 613_566_756 * light + light.min(4) - 1;
        for light in 1..=7 {
            let at = |u: u64| sampler.sample(&(), u as u32).unwrap().light;
            assert_eq!(u64::from(at(last(light))), light - 1);
            if light < 7 {
                assert_eq!(u64::from(at(last(light) + 1)), light);
            }
        }
    }

    #[test]
    fn no_lights_no_choice() {
        assert!(UniformSampler::new(&[]).sample(&(), 5).is_none());
    }
}

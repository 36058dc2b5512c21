//! What is remembered over millions of frames, and how soon it is forgotten when it is no longer true.

use super::bench::{Bench, NEVER};
use super::scenes::{square_lamp, still_life};
use anyhow::Result;
use glam::Vec3;
use light_cache::{LightSampler, Observation, Recording, SamplerKind, Settings, ShadingPoint, Visitor};
use sampling::{Moments, Random};
use scene::Scene;

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    let scene = Scene::new(still_life(square_lamp).0)?;
    let frames = bench.pick(1 << 16, 1 << 22, 1 << 25);
    for kind in [
        SamplerKind::Octree,
        SamplerKind::TreeVisible,
        SamplerKind::Table,
        SamplerKind::Adaptive,
    ] {
        bench.now(format_args!("{frames} frames, {}", kind.name()))?;
        let walk = Walk { scene: &scene, frames };
        let found = light_cache::build(&scene, &Settings::default(), kind, walk);
        let hazard = format!("{frames} frames");
        bench.check(&hazard, kind.name(), ("relative drift of the means", 1e-6), found.drift);
        bench.check(&hazard, kind.name(), ("samples miscounted", 0.0), found.miscounted);
        bench.check(
            &hazard,
            kind.name(),
            ("bytes per observation kept", 256.0),
            found.bytes_per_observation,
        );
        let hazard = format!("a light goes dark after {frames} frames");
        bench.check(
            &hazard,
            kind.name(),
            ("share of the old maximum after 100 frames", 1e-3),
            found.old_maximum,
        );
        bench.check(
            &hazard,
            kind.name(),
            ("relative error of the new maximum", 1e-6),
            found.new_maximum,
        );
        bench.check(&hazard, kind.name(), NEVER, found.faults as f64);
    }
    moments(bench)
}

/// Welford's moments of as many samples, noisy and sparse, against sums of integers, which are exact.
fn moments(bench: &mut Bench) -> Result<()> {
    let count = bench.pick(1_u32 << 16, 1 << 24, 1 << 25);
    let hazard = format!("{count} samples, one in a thousand large");
    bench.now(&hazard)?;
    let mut moments = Moments::default();
    let (mut sum, mut squares) = (0_u128, 0_u128);
    for i in 0..count {
        let bits = Random::new(9, i, 0).u32(0);
        let value = if bits.is_multiple_of(1000) {
            u64::from(bits) << 8
        } else {
            u64::from(bits >> 20)
        };
        moments.push(value as f64);
        sum += u128::from(value);
        squares += u128::from(value) * u128::from(value);
    }
    let n = f64::from(count);
    let variance = (squares as f64 - sum as f64 * (sum as f64 / n)) / (n - 1.0);
    bench.check(
        &hazard,
        "moments, mean",
        ("relative error", 1e-6),
        (moments.mean() / (sum as f64 / n) - 1.0).abs(),
    );
    bench.check(
        &hazard,
        "moments, variance",
        ("relative error", 1e-6),
        (moments.variance() / variance - 1.0).abs(),
    );
    Ok(())
}

/// Many frames of few observations for a sampler and the records around it.
struct Walk<'s> {
    scene: &'s Scene,
    frames: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Found {
    drift: f64,
    miscounted: f64,
    bytes_per_observation: f64,
    old_maximum: f64,
    new_maximum: f64,
    faults: u64,
}

impl Visitor for Walk<'_> {
    type Output = Found;

    fn visit<S: LightSampler + 'static>(self, sampler: S) -> Found {
        let settings = Settings::default();
        let mut found = Found::default();
        let mut sampler = Recording::new(sampler, self.scene, settings.table_decay);
        let lights = self.scene.lights.len();
        // Kahan's sums: the truth to the last bit.
        let mut sums = vec![[0.0_f64; 2]; lights];
        let mut samples = vec![0_u64; lights];
        let empty = sampler.stats().bytes as f64;
        for frame in 0..self.frames {
            let observation = self.observation(frame);
            let light = observation.light as usize;
            samples[light] += 1;
            if observation.visible {
                let [sum, lost] = &mut sums[light];
                let term = f64::from(observation.unshadowed) / f64::from(observation.pmf) - *lost;
                let new = *sum + term;
                *lost = (new - *sum) - term;
                *sum = new;
            }
            sampler.end_frame(self.scene, &[vec![observation], Vec::new()]);
        }
        for ((record, [sum, _]), samples) in sampler.records(self.scene).iter().zip(&sums).zip(samples) {
            let mean = sum / f64::from(self.frames);
            if mean > 0.0 {
                found.drift = found.drift.max((record.mean_contribution / mean - 1.0).abs());
            }
            found.miscounted += record.samples.abs_diff(samples) as f64;
        }
        // At most what eight frames and all surprises observe may be waiting; the rest of what grows is tables.
        found.bytes_per_observation = (sampler.stats().bytes as f64 - empty).max(0.0) / f64::from(self.frames);

        // Light 0 goes dark; light 1 is seen with a contribution of 0.5.
        let before = sampler.records(self.scene)[0].max_contribution;
        for frame in 0..100 {
            let log = [0, 1].map(|light| Observation {
                light,
                unshadowed: 0.5,
                visible: light == 1,
                ..self.observation(frame)
            });
            sampler.end_frame(self.scene, &[log.to_vec()]);
        }
        let records = sampler.records(self.scene);
        found.old_maximum = records[0].max_contribution / before;
        found.new_maximum = (records[1].max_contribution / 0.5 - 1.0).abs();
        let total: f64 = records.iter().map(|record| record.probability).sum();
        found.faults = u64::from((total - 1.0).abs() > 1e-6)
            + records
                .iter()
                .filter(|record| record.probability.is_nan() || record.probability < 0.0)
                .count() as u64;
        found
    }
}

impl Walk<'_> {
    /// What frame `frame` sees: all lights in turn, contributions over eight decades.
    fn observation(&self, frame: u32) -> Observation {
        let random = Random::new(10, frame, 0);
        let unshadowed = 10_f32.powf(8.0 * random.f32(0) - 4.0);
        Observation {
            point: ShadingPoint {
                position_ws: Vec3::new(8.0 * random.f32(1) - 4.0, 0.0, 8.0 * random.f32(2) - 4.0),
                normal_ws: Vec3::Y,
                primary: true,
            },
            light: random.u32(3) % self.scene.lights.len() as u32,
            unshadowed,
            irradiance: unshadowed,
            pmf: 0.01 + 0.99 * random.f32(4),
            visible: !random.u32(5).is_multiple_of(3),
            weight: 1,
            bounce: None,
        }
    }
}

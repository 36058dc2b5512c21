//! One importance table: what is known of each light, and the distribution that is made of it.

use crate::belief::chance_visible;
use crate::state::is_amount;
use crate::{Observation, Settings};
use sampling::Discrete;

/// Most samples' worth of trust in the prior, the light's power; how many it is worth is learned. Higher values follow
/// power longer where many lights are seen by few pixels.
const MAX_PRIOR_SAMPLES: f64 = 4.0;
/// Share of the running maximum in a light's weight. Higher values follow a light that has just turned up sooner, and let a
/// few strong samples own the table: on a building of 2,000 lights 0.1 costs twice the error of 0.
const MAX_SHARE: f64 = 0.01;
/// Samples of one light after which its older half is forgotten, so that the table follows changes.
const MEMORY: f64 = 65_536.0;
/// Lights that are ignored (if that is asked for) have been sampled this often.
const MIN_SAMPLES_TO_IGNORE: f64 = 32.0;

/// What is known about one light.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Entry {
    pub(super) samples: f64,
    /// How many of them saw it.
    sightings: u32,
    /// Sum of squared visible contributions.
    sum_sq: f64,
    /// Running maximum at the time of `frame`.
    pub(super) max: f32,
    pub(super) frame: u32,
}

/// One importance table.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Table {
    pub(super) entries: Vec<Entry>,
    /// `None` if there are no lights.
    pub(super) distribution: Option<Discrete>,
    weights: Vec<f64>,
    /// Observations since the distribution was last made.
    fresh: usize,
}

/// `max` after it has shrunk by `decay` for `frames` frames.
pub(super) fn decayed(max: f32, decay: f32, frames: u32) -> f32 {
    max * decay.powi(frames.min(100_000) as i32)
}

impl Table {
    pub(super) fn new(prior: &[f64], floor: f64) -> Self {
        Self {
            entries: vec![Entry::default(); prior.len()],
            distribution: Discrete::new(prior, floor),
            weights: Vec::new(),
            fresh: 0,
        }
    }

    pub(super) fn observe(&mut self, observation: &Observation, brightness: f32, frame: u32, decay: f32) {
        self.fresh += 1;
        let entry = &mut self.entries[observation.light as usize];
        entry.samples += f64::from(observation.weight);
        if !observation.visible {
            return;
        }
        // Its share of the light there: no more than all of it, however dark the surroundings.
        let light = observation.unshadowed;
        let contribution = light / brightness.max(light).max(f32::MIN_POSITIVE);
        entry.sum_sq += f64::from(observation.weight) * f64::from(contribution) * f64::from(contribution);
        entry.sightings = entry.sightings.saturating_add(observation.weight);
        if entry.frame != frame {
            entry.max = decayed(entry.max, decay, frame - entry.frame);
            entry.frame = frame;
        }
        entry.max = entry.max.max(contribution);
    }

    /// Makes the distribution anew if enough has been observed to pay for the pass over all lights.
    pub(super) fn refresh(&mut self, prior: &[f64], frame: u32, settings: &Settings, cautious: bool) {
        if self.fresh == 0 || self.fresh < self.entries.len() / 4 {
            return;
        }
        let Some(distribution) = &mut self.distribution else {
            return;
        };
        self.fresh = 0;
        let scale_sq = scale_sq(&self.entries, prior);
        let prior_samples = if cautious {
            MAX_PRIOR_SAMPLES
        } else {
            prior_samples(&self.entries)
        };
        self.weights.clear();
        for (entry, prior) in self.entries.iter_mut().zip(prior) {
            if entry.samples > MEMORY {
                entry.samples *= 0.5;
                entry.sum_sq *= 0.5;
            }
            let expected_sq = scale_sq * prior * prior;
            let alive = if entry.sum_sq > 0.0 {
                1.0
            } else {
                f64::from(chance_visible(entry.samples as f32))
            };
            let mean_sq = (entry.sum_sq + prior_samples * expected_sq) * alive / (entry.samples + prior_samples);
            let max = MAX_SHARE * f64::from(decayed(entry.max, settings.table_decay, frame - entry.frame));
            let weight = (mean_sq + max * max).sqrt();
            self.weights.push(weight);
        }
        let floor = f64::from(settings.min_probability_mass);
        if settings.ignore_below > 0.0 {
            ignore(
                &mut self.weights,
                &self.entries,
                f64::from(settings.ignore_below),
                floor,
            );
            distribution.set(&self.weights, 0.0);
        } else {
            distribution.set(&self.weights, floor);
        }
    }

    pub(super) fn is_sound(&self, lights: usize, frame: u32) -> bool {
        let sound = |entry: &Entry| {
            is_amount(entry.samples) && is_amount(entry.sum_sq) && is_amount(entry.max) && entry.frame <= frame
        };
        self.entries.len() == lights
            && self.entries.iter().all(sound)
            && match &self.distribution {
                Some(distribution) => distribution.len() == lights && distribution.is_sound(),
                None => lights == 0,
            }
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.entries[..])
            + size_of_val(&self.weights[..])
            + self.distribution.as_ref().map_or(0, Discrete::bytes)
    }
}

/// Mean over the lights seen so far of second moment / prior^2: what a unit of power is worth in the image, squared.
/// Lights count alike, however often they were drawn, so that one strong hidden light does not speak for all.
fn scale_sq(entries: &[Entry], prior: &[f64]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (entry, prior) in entries.iter().zip(prior) {
        if entry.samples > 0.0 && *prior > 0.0 {
            let trust = entry.samples.min(16.0);
            sum += trust * (entry.sum_sq / entry.samples) / (prior * prior);
            count += trust;
        }
    }
    if sum > 0.0 { sum / count } else { 1.0 }
}

/// Samples' worth of trust in the prior: how many lights were seen once for each that was sampled and not seen. By that
/// much, divided by its samples, a light not seen so far is expected to show at its next sample (Good 1953, equation 2,
/// for lights sampled alike).
fn prior_samples(entries: &[Entry]) -> f64 {
    let (mut once, mut never) = (1.0, 1.0);
    for entry in entries.iter().filter(|entry| entry.samples > 0.0) {
        match entry.sightings {
            0 => never += 1.0,
            1 => once += 1.0,
            _ => {}
        }
    }
    f64::min(once / never, MAX_PRIOR_SAMPLES)
}

/// Sets the weights of known lights below `share` of the mean to zero, and gives all others the floor.
fn ignore(weights: &mut [f64], entries: &[Entry], share: f64, floor: f64) {
    let threshold = share * weights.iter().sum::<f64>() / weights.len() as f64;
    for (weight, entry) in weights.iter_mut().zip(entries) {
        if entry.samples >= MIN_SAMPLES_TO_IGNORE && *weight < threshold {
            *weight = 0.0;
        }
    }
    let kept = weights.iter().filter(|&&weight| weight > 0.0).count();
    let even = floor / (1.0 - floor).max(1e-6) * weights.iter().sum::<f64>() / kept.max(1) as f64;
    for weight in weights.iter_mut().filter(|weight| **weight > 0.0) {
        *weight += even;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trust_in_the_prior_follows_the_lights_seen_once() {
        let entry = |samples, sightings| Entry {
            samples,
            sightings,
            ..Entry::default()
        };
        let of = |once: usize, never: usize| {
            let unsampled = vec![entry(0.0, 0); 1000];
            let often = vec![entry(50.0, 9); 50];
            prior_samples(&[vec![entry(9.0, 1); once], vec![entry(9.0, 0); never], unsampled, often].concat())
        };
        assert_eq!(of(0, 0), 1.0);
        assert!(of(0, 999) < 0.002);
        assert_eq!(of(199, 399), 0.5);
        assert_eq!(of(500, 10), MAX_PRIOR_SAMPLES);
    }
}

//! The global running importance table (Wald, Benthin and Slusallek 2003, "Interactive Global Illumination in Complex and Highly Occluded Environments").
//!
//! Eye paths report what each light contributes to the pixels, in units of the brightness around the point (errors are
//! judged by that). Per light the table keeps the running maximum, decayed with every lesson, and the second moment: the least
//! noisy distribution is proportional to its root (Rath et al. 2020, "Variance-Aware Path Guiding"). A light is drawn
//! in proportion to that root, lifted by a share of the maximum so that a light that has just turned up is not forgotten
//! again at once. Lights without samples are believed to be worth their power, and lights that were sampled and not seen
//! as much less as the lights seen just once say (Good 1953, "The population frequencies of species and the estimation
//! of population parameters"). Differs from Wald et al.: no separate estimation pass, frames teach those after them.

mod entries;

use crate::brightness::Brightness;
use crate::schedule::Schedule;
use crate::state::Saved;
use crate::{
    Choice, LightRecord, LightSampler, Observation, Pace, Packed, SamplerStats, Scheme, Settings, ShadingPoint,
    Thinning, records, state,
};
use entries::{Table, decayed};
use glam::Vec3;
use sampling::Discrete;
use scene::{Light, Scene};
use std::time::Instant;

/// The table as a sampler: position plays no part, first hits and later hits have tables of their own.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct TableSampler {
    primary: Table,
    /// Like the primary one until a later hit has been seen.
    secondary: Option<Table>,
    prior: Vec<f64>,
    brightness: Brightness,
    /// Cell of each observation of the frame that is learned from; kept for its memory only.
    cells: Vec<u16>,
    /// Whether the prior is trusted as much as ever allowed.
    cautious: bool,
    settings: Settings,
    /// Which frames are learned from.
    schedule: Schedule,
    /// Frames learned from so far.
    frame: u32,
    build_s: f64,
    learn_s: f64,
}

impl TableSampler {
    /// The table over `lights`, which starts as their power. `radius` of the scene, metres.
    pub fn new(lights: &[Light], radius: f32, settings: &Settings) -> Self {
        Self::with_caution(lights, radius, settings, false)
    }

    /// As the net under a sampler that learns more: lights that were not seen keep much of their prior, whatever the
    /// others say.
    pub(crate) fn net(lights: &[Light], radius: f32, settings: &Settings) -> Self {
        Self::with_caution(lights, radius, settings, true)
    }

    fn with_caution(lights: &[Light], radius: f32, settings: &Settings, cautious: bool) -> Self {
        let start = Instant::now();
        let strongest = lights.iter().map(|light| light.power).fold(f32::MIN_POSITIVE, f32::max);
        let prior: Vec<f64> = lights
            .iter()
            .map(|light| f64::from(light.power) / f64::from(strongest))
            .collect();
        let floor = f64::from(settings.min_probability_mass);
        Self {
            primary: Table::new(&prior, floor),
            secondary: None,
            prior,
            brightness: Brightness::new(radius),
            cells: Vec::new(),
            cautious,
            settings: settings.clone(),
            schedule: Schedule::new(2),
            frame: 0,
            build_s: start.elapsed().as_secs_f64(),
            learn_s: 0.0,
        }
    }

    fn table(&self, primary: bool) -> &Table {
        match &self.secondary {
            Some(secondary) if !primary => secondary,
            _ => &self.primary,
        }
    }

    /// Learns from a frame that is one to learn from.
    pub(crate) fn learn(&mut self, logs: &[Vec<Observation>]) {
        let start = Instant::now();
        self.frame += 1;
        let mut later_hits = false;
        self.cells.clear();
        for observation in logs.iter().flatten() {
            later_hits |= !observation.point.primary;
            self.cells.push(self.brightness.observe(observation));
        }
        if later_hits && self.secondary.is_none() {
            self.secondary = Some(Table::new(&self.prior, f64::from(self.settings.min_probability_mass)));
        }
        for (observation, &cell) in logs.iter().flatten().zip(&self.cells) {
            let brightness = self.brightness.of_cell(cell);
            let table = match &mut self.secondary {
                Some(secondary) if !observation.point.primary => secondary,
                _ => &mut self.primary,
            };
            table.observe(observation, brightness, self.frame, self.settings.table_decay);
        }
        for table in [Some(&mut self.primary), self.secondary.as_mut()].into_iter().flatten() {
            table.refresh(&self.prior, self.frame, &self.settings, self.cautious);
        }
        self.learn_s += start.elapsed().as_secs_f64();
    }
}

impl Saved for TableSampler {
    fn is_sound_like(&self, fresh: &Self) -> bool {
        let mut tables = [Some(&self.primary), self.secondary.as_ref()].into_iter().flatten();
        tables.all(|table| table.is_sound(fresh.prior.len(), self.frame))
            && self.prior == fresh.prior
            && self.brightness.is_sound_like(&fresh.brightness)
            && self.cautious == fresh.cautious
            && self.settings == fresh.settings
            && self.schedule.is_sound_like(&fresh.schedule, self.prior.len())
            && self.frame < u32::MAX / 2
    }
}

impl LightSampler for TableSampler {
    type Local<'a> = Option<&'a Discrete>;
    const LEARNS: bool = true;

    #[inline]
    fn local(&self, _scene: &Scene, point: &ShadingPoint) -> Option<&Discrete> {
        self.table(point.primary).distribution.as_ref()
    }

    #[inline]
    fn sample(&self, local: &Option<&Discrete>, u: u32) -> Option<Choice> {
        let draw = (*local)?.sample(u);
        Some(Choice::new(draw.index, draw.pmf()))
    }

    #[inline]
    fn pmf(&self, local: &Option<&Discrete>, light: u32) -> f32 {
        local.map_or(0.0, |distribution| distribution.pmf(light))
    }

    /// What was learned may be wrong, and is learned again in a few frames.
    fn scene_changed(&mut self, scene: &Scene) {
        *self = Self::with_caution(&scene.lights, scene.radius, &self.settings, self.cautious);
    }

    fn pace(&self) -> Pace {
        self.schedule.pace()
    }

    fn set_eye(&mut self, _eye_ws: Vec3) {
        self.schedule.restart();
    }

    fn end_frame(&mut self, _scene: &Scene, logs: &[Vec<Observation>]) {
        if let Some(logs) = self.schedule.end_frame(logs) {
            self.learn(&logs);
        }
    }

    fn thinning(&self) -> Option<Thinning> {
        Some(self.schedule.thinning())
    }

    fn end_thinned_frame(&mut self, _scene: &Scene, kept: Vec<Vec<Observation>>) {
        if let Some(logs) = self.schedule.end_thinned_frame(kept) {
            self.learn(&logs);
        }
    }

    fn save(&self) -> Option<Vec<u8>> {
        state::save(self)
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        state::restore(self, state)
    }

    fn stats(&self) -> SamplerStats {
        let ignoring = self.settings.ignore_below > 0.0;
        let floor = self.primary.distribution.as_ref().map_or(0.0, Discrete::floor);
        SamplerStats {
            bytes: self.primary.bytes()
                + self.schedule.bytes()
                + self.secondary.as_ref().map_or(0, Table::bytes)
                + size_of_val(&self.prior[..])
                + self.brightness.bytes(),
            min_probability: if ignoring { 0.0 } else { floor },
            build_s: self.build_s,
            learn_s: self.learn_s,
            skipped: if self.secondary.is_none() {
                vec!["no later hits: no secondary table".into()]
            } else {
                Vec::new()
            },
            biased: ignoring.then(|| {
                format!(
                    "lights below {} of the mean importance are ignored",
                    self.settings.ignore_below
                )
            }),
            ..SamplerStats::default()
        }
    }

    fn pack(&self) -> Option<Packed> {
        let mut words = vec![0; 2];
        for (header, primary) in [(0, true), (1, false)] {
            words[header] = self.table(primary).distribution.as_ref()?.pack(&mut words);
        }
        Some(Packed {
            scheme: Scheme::Discrete,
            words,
        })
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        let mut records = records::of_sampler(self, scene, &[]);
        for (record, entry) in records.iter_mut().zip(&self.primary.entries) {
            // In units of the brightness around the point.
            record.max_contribution =
                f64::from(decayed(entry.max, self.settings.table_decay, self.frame - entry.frame));
            record.samples = entry.samples as u64;
        }
        records
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{
        check, check_each_light_is_drawn, check_saving, mixed_lights, observe, point, points, scene_of,
    };

    fn taught(scene: &Scene, settings: &Settings, frames: u32, visible: impl Fn(u32) -> bool) -> TableSampler {
        let mut sampler = TableSampler::new(&scene.lights, scene.radius, settings);
        for frame in 0..frames {
            let logs = observe(&sampler, scene, frame, &visible);
            sampler.end_frame(scene, &logs);
        }
        sampler
    }

    #[test]
    fn keeps_the_promises_of_a_sampler() {
        for count in [1, 2, 300] {
            let scene = scene_of(mixed_lights(count, 3));
            for frames in [0, 4] {
                let sampler = taught(&scene, &Settings::default(), frames, |light| light.is_multiple_of(3));
                check(&sampler, &scene, &points(4, 5));
                check_each_light_is_drawn(&sampler, &scene);
            }
        }
    }

    #[test]
    fn is_saved_and_restored() {
        let scene = scene_of(mixed_lights(100, 3));
        let mut sampler = taught(&scene, &Settings::default(), 6, |light| light.is_multiple_of(3));
        let fresh = || TableSampler::new(&scene.lights, scene.radius, &Settings::default());
        check_saving(&mut sampler, fresh, &scene, 400);
    }

    #[test]
    fn starts_as_power_and_forgets_hidden_lights() {
        let scene = scene_of(mixed_lights(200, 3));
        let visible = |light: u32| light % 10 == 4;
        let share = |frames| {
            let records = taught(&scene, &Settings::default(), frames, visible).records(&scene);
            (0..)
                .zip(records)
                .filter(|(light, _)| visible(*light))
                .map(|(_, r)| r.probability)
                .sum::<f64>()
        };
        let power = crate::PowerSampler::new(&scene.lights, &Settings::default());
        let first = taught(&scene, &Settings::default(), 0, visible);
        assert_eq!(
            first.primary.distribution.as_ref().map(|d| d.pmf(7)),
            Some(power.pmf(&(), 7))
        );
        let (before, after) = (share(0), share(16));
        assert!(before < 0.1 && after > 5.0 * before, "{before} {after}");
    }

    #[test]
    fn first_and_later_hits_have_their_own_tables() {
        let scene = scene_of(mixed_lights(100, 3));
        let mut sampler = TableSampler::new(&scene.lights, scene.radius, &Settings::default());
        let mut logs = observe(&sampler, &scene, 0, |_| true);
        for observation in logs.iter_mut().flatten() {
            observation.point.primary = true;
        }
        sampler.end_frame(&scene, &logs);
        assert!(sampler.secondary.is_none());
        for observation in logs.iter_mut().flatten() {
            observation.point.primary = false;
            observation.visible = observation.light == 5;
        }
        sampler.end_frame(&scene, &logs);
        let pmf = |primary: bool| sampler.table(primary).distribution.as_ref().unwrap().pmf(5);
        assert!(pmf(false) > 2.0 * pmf(true));
    }

    #[test]
    fn the_maximum_is_remembered_and_shrinks() {
        let scene = scene_of(mixed_lights(50, 3));
        let settings = Settings::default();
        let mut sampler = TableSampler::new(&scene.lights, scene.radius, &settings);
        let mut observation = observe(&sampler, &scene, 0, |_| true)[0][0];
        observation.light = 9;
        observation.point.primary = true;
        observation.unshadowed = 3.0;
        observation.visible = true;
        sampler.end_frame(&scene, &[vec![observation]]);
        let first = sampler.records(&scene)[9].max_contribution;
        assert!(first > 0.0);
        sampler.end_frame(&scene, &[]);
        sampler.end_frame(&scene, &[]);
        let decayed = first * f64::from(settings.table_decay).powi(2);
        assert!((sampler.records(&scene)[9].max_contribution - decayed).abs() < 1e-5);
    }

    #[test]
    fn ignoring_is_off_until_asked_for_and_says_so() {
        let lights = (0..40).map(|i| point(glam::Vec3::splat(0.1 * i as f32), 1.0));
        let scene = scene_of(lights.collect());
        let visible = |light: u32| light.is_multiple_of(2);
        let plain = taught(&scene, &Settings::default(), 8, visible);
        assert!(plain.stats().biased.is_none());
        let settings = Settings {
            ignore_below: 0.5,
            ..Settings::default()
        };
        let ignoring = taught(&scene, &settings, 8, visible);
        assert!(ignoring.stats().biased.is_some());
        let zero = |s: &TableSampler| s.records(&scene).iter().filter(|r| r.probability == 0.0).count();
        assert_eq!(zero(&plain), 0);
        assert!(zero(&ignoring) > 10);
    }
}

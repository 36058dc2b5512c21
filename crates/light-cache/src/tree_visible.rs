//! The light tree with learned visibility.
//!
//! Every light's strength is multiplied by what has been seen of its visible share, every node's by the mean over its
//! lights, so a descent avoids groups that are hidden from the image; importance at the point itself stays that of the plain tree.
//!
//! The visible share is a posterior mean with few pseudo-samples of a prior, and the prior is the share of the parent
//! node (empirical Bayes, as in Vevoda, Kondapaneni and Krivanek 2018, "Bayesian online regression for adaptive direct
//! illumination sampling"): lights that were never drawn borrow from their neighbours. It never reaches zero, so
//! every light keeps its place in the tree, and a uniform floor is mixed in.

mod visibility;

use crate::schedule::Schedule;
use crate::state::Saved;
use crate::tree::{Descent, Floor, Tree, position, probability};
use crate::{Choice, LightRecord, LightSampler, Observation, Pace, SamplerStats, Settings, ShadingPoint};
use crate::{records, state};
use glam::Vec3;
use scene::{Light, Scene};
use std::time::Instant;
use visibility::Visibility;

/// Share by which the observations must have grown before the tree is weighted anew: later frames change little.
const GROWTH: f64 = 0.02;

/// Observations per light after which the tree is built anew with the lights that have been seen to arrive in a subtree of their own:
/// building costs much more than weighing. Higher values build less often; lower values profit sooner.
const OBSERVATIONS_TO_REGROUP: usize = 4;
/// By how much epochs grow: visible shares of lights are learned in a few frames. See [`Schedule`].
const EPOCH_GROWTH: u32 = 16;

/// The light tree, leaf flux times learned visibility.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct TreeVisibleSampler {
    tree: Tree,
    visibility: Visibility,
    floor: Floor,
    /// Which frames are learned from.
    schedule: Schedule,
    settings: Settings,
    /// Observations since the tree was last weighted.
    fresh: usize,
    observations: u64,
    /// Observations after which the tree is built anew.
    regroup_at: u64,
    build_s: f64,
    learn_s: f64,
}

/// The tree as seen from one shading point.
#[derive(Clone, Copy, Debug)]
pub struct Local<'t> {
    descent: Descent<'t>,
    salt: u32,
}

impl TreeVisibleSampler {
    /// Builds the tree over `lights`; nothing is known of visibility yet.
    pub fn new(lights: &[Light], settings: &Settings) -> Self {
        Self::with_caution(lights, settings, false)
    }

    /// As the prior of a sampler that learns more.
    pub(crate) fn prior(lights: &[Light], settings: &Settings) -> Self {
        Self::with_caution(lights, settings, true)
    }

    fn with_caution(lights: &[Light], settings: &Settings, cautious: bool) -> Self {
        let start = Instant::now();
        let tree = Tree::new(lights);
        Self {
            visibility: Visibility::new(&tree, cautious),
            floor: Floor::new(settings.min_probability_mass, lights.len()),
            schedule: Schedule::new(EPOCH_GROWTH),
            settings: settings.clone(),
            fresh: 0,
            observations: 0,
            regroup_at: (OBSERVATIONS_TO_REGROUP * tree.len()) as u64,
            build_s: start.elapsed().as_secs_f64(),
            learn_s: 0.0,
            tree,
        }
    }

    /// The tree, weighed by what has been learned.
    #[inline]
    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Learns from the frames of an epoch.
    pub(crate) fn learn(&mut self, logs: &[Vec<Observation>]) {
        let start = Instant::now();
        self.observe(logs);
        if self.knows_more() {
            self.visibility.apply(&mut self.tree);
        }
        self.learn_s += start.elapsed().as_secs_f64();
    }

    fn observe(&mut self, logs: &[Vec<Observation>]) {
        for observation in logs.iter().flatten() {
            let place = self.tree.rank[observation.light as usize];
            self.visibility.observe(place, observation);
            self.fresh += 1;
        }
    }

    /// Whether the tree should be weighed anew: a pass over all lights has to be paid for by a fair number of observations.
    fn knows_more(&mut self) -> bool {
        let many = self.fresh > 0 && self.fresh >= self.tree.len() / 4;
        let more = many && self.fresh as f64 >= GROWTH * self.observations as f64;
        if more {
            self.observations += self.fresh as u64;
            self.fresh = 0;
        }
        more
    }

    #[inline]
    fn pmf_at(&self, local: &Local<'_>, place: u32) -> f32 {
        probability(self.floor.width() + local.descent.width_of(place, self.floor.rest()))
    }
}

impl Saved for TreeVisibleSampler {
    fn is_sound_like(&self, fresh: &Self) -> bool {
        self.tree.is_sound_like(&fresh.tree)
            && self.visibility.is_sound_like(&fresh.visibility, &self.tree)
            && self.floor == fresh.floor
            && self.settings == fresh.settings
            && self.schedule.is_sound_like(&fresh.schedule, self.tree.len())
    }
}

impl LightSampler for TreeVisibleSampler {
    type Local<'a> = Local<'a>;
    const LEARNS: bool = true;

    #[inline]
    fn local(&self, _scene: &Scene, point: &ShadingPoint) -> Local<'_> {
        Local {
            descent: Descent::new(&self.tree, point.into()),
            salt: point.salt(),
        }
    }

    #[inline]
    fn sample(&self, local: &Local<'_>, u: u32) -> Option<Choice> {
        if !local.descent.alive() {
            return None;
        }
        if let Some(place) = self.floor.draw(u) {
            return Some(Choice::new(self.tree.light_at(place), self.pmf_at(local, place)));
        }
        let x = position(u, local.salt) - self.floor.start_of_rest();
        let (place, width) = local.descent.draw(x, self.floor.rest());
        Some(Choice::new(
            self.tree.light_at(place),
            probability(self.floor.width() + width),
        ))
    }

    #[inline]
    fn pmf(&self, local: &Local<'_>, light: u32) -> f32 {
        if !local.descent.alive() {
            return 0.0;
        }
        self.pmf_at(local, self.tree.rank[light as usize])
    }

    fn add_pmfs(&self, local: &Local<'_>, sum: &mut [f64]) {
        if local.descent.alive() {
            local
                .descent
                .add_probabilities(self.floor.width(), self.floor.rest(), sum);
        }
    }

    /// What was learned may be wrong, and is learned again in a few frames.
    fn scene_changed(&mut self, scene: &Scene) {
        *self = Self::with_caution(&scene.lights, &self.settings, false);
    }

    fn pace(&self) -> Pace {
        self.schedule.pace()
    }

    fn set_eye(&mut self, _eye_ws: Vec3) {
        self.schedule.restart();
    }

    fn end_frame(&mut self, scene: &Scene, logs: &[Vec<Observation>]) {
        let Some(logs) = self.schedule.end_frame(logs) else {
            return;
        };
        let start = Instant::now();
        self.observe(&logs);
        if self.knows_more() {
            if self.observations >= self.regroup_at {
                self.visibility.regroup(&mut self.tree, &scene.lights);
                self.regroup_at = self.observations + (OBSERVATIONS_TO_REGROUP * self.tree.len()) as u64;
            }
            self.visibility.apply(&mut self.tree);
        }
        self.learn_s += start.elapsed().as_secs_f64();
    }

    fn save(&self) -> Option<Vec<u8>> {
        state::save(self)
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        state::restore(self, state)
    }

    fn stats(&self) -> SamplerStats {
        SamplerStats {
            bytes: self.tree.bytes() + self.visibility.bytes() + self.schedule.bytes(),
            min_probability: self.floor.probability(),
            build_s: self.build_s,
            learn_s: self.learn_s,
            ..SamplerStats::default()
        }
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        let mut records = records::of_sampler(self, scene, &[]);
        for (record, &place) in records.iter_mut().zip(&self.tree.rank) {
            (record.samples, record.visible_fraction) = self.visibility.seen(place);
        }
        records
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check, check_each_light_is_drawn, check_saving, mixed_lights, observe, points, scene_of};

    #[test]
    fn keeps_the_promises_of_a_sampler() {
        for count in [1, 2, 5, 300] {
            let scene = scene_of(mixed_lights(count, 3));
            let mut sampler = TreeVisibleSampler::new(&scene.lights, &Settings::default());
            check(&sampler, &scene, &points(16, 5));
            for frame in 0..4 {
                let logs = observe(&sampler, &scene, frame, |light| light.is_multiple_of(3));
                sampler.end_frame(&scene, &logs);
            }
            check(&sampler, &scene, &points(16, 5));
            check_each_light_is_drawn(&sampler, &scene);
        }
    }

    #[test]
    fn is_saved_and_restored() {
        let scene = scene_of(mixed_lights(100, 3));
        let fresh = || TreeVisibleSampler::new(&scene.lights, &Settings::default());
        let mut sampler = fresh();
        for frame in 0..6 {
            let logs = observe(&sampler, &scene, frame, |light| light.is_multiple_of(3));
            sampler.end_frame(&scene, &logs);
        }
        assert!(sampler.tree.least_second > 0.0, "it was built anew");
        check_saving(&mut sampler, fresh, &scene, 400);
    }

    #[test]
    fn hidden_lights_lose_their_samples() {
        let scene = scene_of(mixed_lights(200, 3));
        let mut sampler = TreeVisibleSampler::new(&scene.lights, &Settings::default());
        let visible = |light: u32| light % 10 == 4;
        let share = |sampler: &TreeVisibleSampler| {
            let records = sampler.records(&scene);
            (0..)
                .zip(records)
                .filter(|(light, _)| visible(*light))
                .map(|(_, r)| r.probability)
                .sum::<f64>()
        };
        let before = share(&sampler);
        for frame in 0..16 {
            let logs = observe(&sampler, &scene, frame, visible);
            sampler.end_frame(&scene, &logs);
        }
        let after = share(&sampler);
        // Where no visible light shines, hidden ones are all that is left.
        assert!(before < 0.1 && after > 0.5, "{before} {after}");
    }

    #[test]
    fn lights_that_were_never_seen_keep_their_share() {
        let scene = scene_of(mixed_lights(100, 3));
        let mut sampler = TreeVisibleSampler::new(&scene.lights, &Settings::default());
        let logs = observe(&sampler, &scene, 0, |light| light.is_multiple_of(3));
        sampler.end_frame(&scene, &logs);
        let near = |light: u32| (sampler.tree.rank[light as usize] as usize) < sampler.tree.leaves.len();
        // Never drawn: not a number.
        let share_seen = |light: u32| sampler.visibility.seen(sampler.tree.rank[light as usize]).1;
        let unseen = |light: u32| share_seen(light).is_nan() || share_seen(light) <= 0.0;
        let mut small = 0;
        for point in points(200, 5) {
            let local = sampler.local(&scene, &point);
            let total = |wanted: &dyn Fn(u32) -> bool| -> f32 {
                let lights = (0..scene.lights.len() as u32).filter(|&light| near(light) && wanted(light));
                lights.map(|light| sampler.pmf(&local, light)).sum()
            };
            let (of_unseen, of_all) = (total(&unseen), total(&|_| true));
            assert!(of_unseen >= 0.0497 * of_all, "{of_unseen} {of_all}");
            small += i32::from(of_unseen < 0.06 * of_all);
        }
        assert!(small > 20, "without the least share it would have been less: {small}");
    }

    #[test]
    fn a_giant_that_is_never_visible_is_soon_left_alone() {
        let mut lights = mixed_lights(500, 3);
        lights[8].intensity *= 1e6;
        let scene = scene_of(lights);
        let mut sampler = TreeVisibleSampler::new(&scene.lights, &Settings::default());
        let before = sampler.records(&scene)[8].probability;
        for frame in 0..8 {
            let logs = observe(&sampler, &scene, frame, |light| light != 8);
            sampler.end_frame(&scene, &logs);
        }
        let giant = sampler.records(&scene)[8];
        // Half of all points turn away from it.
        assert!(before > 0.4 && giant.probability < 0.1, "{before} {giant:?}");
        assert_eq!(giant.visible_fraction, 0.0);
    }

    #[test]
    fn learning_does_not_depend_on_how_tiles_are_cut() {
        let scene = scene_of(mixed_lights(200, 3));
        let mut whole = TreeVisibleSampler::new(&scene.lights, &Settings::default());
        let mut tiles = TreeVisibleSampler::new(&scene.lights, &Settings::default());
        let logs = observe(&whole, &scene, 0, |light| light.is_multiple_of(2));
        whole.end_frame(&scene, &[logs.concat()]);
        tiles.end_frame(&scene, &logs);
        let weights = |s: &TreeVisibleSampler| {
            s.tree
                .leaves
                .iter()
                .map(|leaf| leaf.weight.to_bits())
                .collect::<Vec<_>>()
        };
        assert_eq!(weights(&whole), weights(&tiles));
    }
}

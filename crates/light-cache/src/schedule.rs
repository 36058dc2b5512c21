//! When samplers learn, and from which observations.
//!
//! Learning changes what is drawn, so it must not know the random numbers that are still to come; but those of one sequence
//! are anything but independent of each other: each avoids the strata that the ones before it have been in. So frames come in epochs:
//! within one nothing is learned and the sequence keeps its strata, and after it a new sequence begins
//! ([`crate::Pace::lessons`]). The first epochs are single frames, later ones grow by a factor, 2 for samplers that have much to learn
//! (cf. Mueller, Gross and Novak 2017, "Practical Path Guiding for Efficient Light-Transport Simulation", section 5).
//!
//! Long epochs observe more than is worth learning, all but what was not expected: a light that adds much more than its
//! probability allowed for. Those observations are kept, and of the others a few, which stand for all.

use crate::state::is_amount;
use crate::tree::Receiver;
use crate::{Observation, Pace};
use sampling::guide::PARTS;
use sampling::hash::hash3;
use std::borrow::Cow;
use std::ops::Range;

/// Epochs of one frame each, after the eye has moved; a power of two. Higher values learn sooner; lower values keep more strata.
const SINGLE_FRAMES: u32 = 4;
/// Weights of these frames in the image, against 1 for those of the epoch after them: about their inverse variances.
const FIRST_WEIGHTS: [f32; SINGLE_FRAMES as usize] = [0.0625, 0.5, 0.625, 0.625];
/// Of how many frames' observations a longer epoch keeps as many. Higher values learn more; lower values are faster.
const LESSON_FRAMES: u32 = 8;
/// A sample is surprising that adds this many times the mean of its tile. Higher values are faster; lower values find sooner what was
/// overlooked.
const SURPRISE: f32 = 2.0;
/// The same per observation that each kept one stands for, where that is more: bounds what is kept.
const SURPRISE_PER_WEIGHT: f32 = 0.25;

/// Frames after which epochs grow as the sampler wishes; until then they double. A power of two.
const EARLY_FRAMES: u32 = 16;

/// How the observations of one frame are thinned, tile by tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thinning {
    /// Number of the frame: which observations are kept depends on it, and on tile and place in the tile's log.
    pub frame: u32,
    /// One in so many is kept for every [`Thinning::MAX_OBSERVATIONS`] that the frame has begun, besides those that surprise.
    pub stride: u32,
    /// Whether the frame is the first of those that are learned from together.
    pub is_first: bool,
    /// Whether it is the last.
    pub is_last: bool,
}

impl Thinning {
    /// Observations kept of one frame, at most, but for surprising ones: larger images are thinned, so that learning costs the
    /// same at any size. Higher values learn more; lower values are faster.
    pub const MAX_OBSERVATIONS: usize = 1 << 16;

    /// For how many observations each kept one of a frame that has `count` stands.
    pub fn weight(&self, count: usize) -> u32 {
        self.stride * count.div_ceil(Self::MAX_OBSERVATIONS).max(1) as u32
    }

    /// More than are ever kept of one frame, for all that is likely: of those that surprise there are fewer than four in `weight`, or half.
    pub fn most_kept(&self) -> usize {
        6 * Self::MAX_OBSERVATIONS / self.stride as usize + 1024
    }
}

/// Where a sampler is in the course of its learning.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Schedule {
    /// By how much the end of each later epoch is further than that of the one before; a power of two. Higher values keep more strata;
    /// lower values learn more.
    growth: u32,
    /// Frames done since the eye has moved.
    frame: u32,
    /// Times that the sampler has learned.
    lessons: u32,
    /// What the frames of this epoch have taught so far.
    kept: Vec<Vec<Observation>>,
}

impl Schedule {
    /// Nothing done yet; `growth`: by how much epochs grow, a power of two.
    pub(crate) fn new(growth: u32) -> Self {
        debug_assert!(growth > 1 && growth.is_power_of_two());
        Self {
            growth,
            frame: 0,
            lessons: 0,
            kept: Vec::new(),
        }
    }

    /// The eye has moved: what is seen is new.
    pub(crate) fn restart(&mut self) {
        self.frame = 0;
        self.kept.clear();
    }

    /// See [`crate::LightSampler::pace`]. Where much is learned the variance of later frames has been measured to fall about with the root
    /// of their number, so weights grow like that.
    pub(crate) fn pace(&self) -> Pace {
        let first = FIRST_WEIGHTS.get(self.frame as usize);
        let epochs = self.epoch().start as f32 / SINGLE_FRAMES as f32;
        Pace {
            frame_weight: first.copied().unwrap_or(epochs.sqrt()),
            lessons: self.lessons,
        }
    }

    /// The frames of this epoch.
    fn epoch(&self) -> Range<u32> {
        if self.frame < SINGLE_FRAMES {
            return self.frame..self.frame + 1;
        }
        let mut start = SINGLE_FRAMES;
        loop {
            let growth = if start < EARLY_FRAMES { 2 } else { self.growth };
            // The last one has no end: after more frames than anyone waits for.
            let end = start.saturating_mul(growth);
            if self.frame < end {
                return start..end;
            }
            start = end;
        }
    }

    /// How the coming frame is thinned.
    pub(crate) fn thinning(&self) -> Thinning {
        let epoch = self.epoch();
        Thinning {
            frame: self.frame,
            stride: ((epoch.end - epoch.start) / LESSON_FRAMES).max(1),
            is_first: self.frame == epoch.start,
            is_last: self.next_frame() == epoch.end,
        }
    }

    /// Ends a frame; at the end of an epoch, returns what is to be learned.
    pub(crate) fn end_frame<'l>(&mut self, logs: &'l [Vec<Observation>]) -> Option<Cow<'l, [Vec<Observation>]>> {
        let thinning = self.thinning();
        let weight = thinning.weight(logs.iter().map(Vec::len).sum());
        if weight == 1 && thinning.is_first && thinning.is_last {
            self.pass_frame();
            return Some(Cow::Borrowed(logs));
        }
        // Most tiles of a long epoch's frame leave nothing: even an empty list each would fill the memory in the end.
        let kept = (0..)
            .zip(logs)
            .map(|(tile, log)| thinned(log, weight, [thinning.frame, tile]));
        let kept = kept.filter(|log| !log.is_empty()).collect();
        self.end_thinned_frame(kept).map(Cow::Owned)
    }

    /// The same of a frame that was thinned before; `kept` may hold what is left of earlier frames of the epoch too.
    pub(crate) fn end_thinned_frame(&mut self, kept: Vec<Vec<Observation>>) -> Option<Vec<Vec<Observation>>> {
        self.kept.extend(kept);
        self.pass_frame().then(|| std::mem::take(&mut self.kept))
    }

    /// Returns whether an epoch has ended.
    fn pass_frame(&mut self) -> bool {
        let is_last = self.thinning().is_last;
        self.frame = self.next_frame();
        self.lessons = self.lessons.wrapping_add(u32::from(is_last));
        is_last
    }

    fn next_frame(&self) -> u32 {
        (self.frame + 1).min(u32::MAX - 1)
    }

    /// Whether it can be what another of as many lights has become.
    pub(crate) fn is_sound_like(&self, other: &Self, lights: usize) -> bool {
        let sound = |o: &Observation| {
            (o.light as usize) < lights
                && Receiver::from(&o.point).is_sound()
                && [o.unshadowed, o.irradiance, o.pmf].into_iter().all(is_amount)
                && o.pmf > 0.0
                && o.weight > 0
                && o.bounce
                    .is_none_or(|bounce| usize::from(bounce.part) < PARTS && is_amount(bounce.radiance))
        };
        self.growth == other.growth && self.frame < u32::MAX && self.kept.iter().flatten().all(sound)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let of_log = |log: &Vec<Observation>| size_of_val(log) + size_of_val(&log[..]);
        self.kept.iter().map(of_log).sum()
    }
}

/// The surprising observations of a tile, and one in `weight` of the others, which then stands for that many. `salt`: which are
/// chosen depends on it.
fn thinned(log: &[Observation], weight: u32, salt: [u32; 2]) -> Vec<Observation> {
    if weight == 1 {
        return log.to_vec();
    }
    let added = |o: &Observation| if o.visible { o.unshadowed / o.pmf } else { 0.0 };
    let mean = log.iter().map(added).sum::<f32>() / log.len().max(1) as f32;
    let surprising = mean * SURPRISE.max(SURPRISE_PER_WEIGHT * weight as f32);
    let chosen = u32::MAX / weight;
    let of = |(index, o): (u32, &Observation)| {
        if added(o) > surprising {
            Some(*o)
        } else {
            (hash3(salt[0], salt[1], index) <= chosen).then_some(Observation { weight, ..*o })
        }
    };
    (0..).zip(log).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ShadingPoint;
    use glam::Vec3;

    /// What a tile reports of which one sample in a hundred adds fifty times what the others do.
    fn log(count: u32) -> Vec<Observation> {
        let observation = |light: u32| Observation {
            point: ShadingPoint {
                position_ws: Vec3::ZERO,
                normal_ws: Vec3::Y,
                primary: true,
            },
            light,
            unshadowed: 1.0,
            irradiance: 1.0,
            pmf: if light % 100 == 7 { 0.02 } else { 1.0 },
            visible: true,
            weight: 1,
            bounce: None,
        };
        (0..count).map(observation).collect()
    }

    #[test]
    fn observations_that_no_path_makes_are_not_taken_over() {
        let sound = |bounce| {
            let mut schedule = Schedule::new(2);
            let observation = Observation { bounce, ..log(1)[0] };
            (0..SINGLE_FRAMES + 1).for_each(|_| drop(schedule.end_frame(&[vec![observation]])));
            schedule.is_sound_like(&Schedule::new(2), 1)
        };
        let bounce = |part: usize, radiance| {
            let part = part as u16;
            Some(crate::Bounce { part, radiance })
        };
        assert!(sound(None) && sound(bounce(PARTS - 1, 2.0)));
        for odd in [
            bounce(PARTS, 1.0),
            bounce(0, -1.0),
            bounce(0, f32::NAN),
            bounce(0, f32::INFINITY),
        ] {
            assert!(!sound(odd), "{odd:?}");
        }
    }

    #[test]
    fn every_first_frame_teaches_then_each_epoch() {
        let mut schedule = Schedule::new(2);
        let logs = [log(3)];
        for _ in 0..2 {
            let before = schedule.pace().lessons;
            let mut learned_at = Vec::new();
            for frame in 1..=130 {
                if let Some(lesson) = schedule.end_frame(&logs) {
                    learned_at.push(frame);
                    if frame <= 2 * LESSON_FRAMES {
                        let length = if frame <= SINGLE_FRAMES { 1 } else { frame as usize / 2 };
                        assert_eq!(lesson.iter().map(Vec::len).sum::<usize>(), 3 * length);
                    }
                }
            }
            let expected: Vec<u32> = (1..=SINGLE_FRAMES).chain([8, 16, 32, 64, 128]).collect();
            assert_eq!(learned_at, expected);
            assert_eq!(schedule.pace().lessons - before, expected.len() as u32);
            schedule.restart();
        }
    }

    #[test]
    fn later_epochs_grow_as_asked() {
        let mut schedule = Schedule::new(16);
        let mut learned_at = Vec::new();
        for frame in 1..=300 {
            if schedule.end_frame(&[]).is_some() {
                learned_at.push(frame);
            }
        }
        assert_eq!(learned_at, [1, 2, 3, 4, 8, 16, 256]);
        assert_eq!(schedule.pace().frame_weight, 8.0);
    }

    #[test]
    fn frames_weigh_more_as_epochs_pass() {
        let mut schedule = Schedule::new(2);
        let mut weights = Vec::new();
        for _ in 0..17 {
            weights.push(schedule.pace().frame_weight);
            schedule.end_frame(&[]);
        }
        assert!(weights.is_sorted());
        assert_eq!([weights[3], weights[4], weights[7]], [0.625, 1.0, 1.0]);
        assert_eq!(
            [weights[8], weights[15], weights[16]],
            [2.0_f32.sqrt(), 2.0_f32.sqrt(), 2.0]
        );
    }

    #[test]
    fn the_last_epoch_never_ends() {
        let mut schedule = Schedule {
            frame: u32::MAX - 20,
            ..Schedule::new(2)
        };
        for _ in 0..40 {
            assert!(schedule.end_frame(&[log(1)]).is_none());
            assert!(schedule.pace().frame_weight < 1e5);
        }
    }

    /// Of 16,000 observations one in 16: 7 standard deviations.
    #[test]
    fn what_is_kept_stands_for_all_and_holds_every_surprise() {
        let all = log(16_000);
        let mut kept = std::collections::HashSet::new();
        for frame in 0..4 {
            let thinned = thinned(&all, 16, [frame, 3]);
            let surprises = thinned.iter().filter(|o| o.pmf < 1.0);
            assert!(surprises.clone().all(|o| o.weight == 1));
            assert_eq!(surprises.count(), 160);
            let total = thinned.iter().map(|o| o.weight).sum::<u32>();
            assert!(total.abs_diff(16_000) < 16 * 7 * 31, "{total}");
            kept.extend(thinned.iter().filter(|o| o.weight == 16).map(|o| o.light));
        }
        assert!(kept.len() > 3 * 990 * 9 / 10, "other ones in every frame");
        // Far fewer, when each stands for very many.
        assert!(thinned(&all, 1 << 12, [0, 0]).len() < 20);
    }

    #[test]
    fn large_images_teach_no_more_than_small_ones() {
        let logs: Vec<_> = (0..4).map(|_| log(Thinning::MAX_OBSERVATIONS as u32)).collect();
        let mut schedule = Schedule::new(2);
        let lesson = schedule.end_frame(&logs).expect("first frames are learned from");
        let ordinary = lesson.iter().flatten().filter(|o| o.weight > 1).count();
        assert!(
            ordinary.abs_diff(Thinning::MAX_OBSERVATIONS) < Thinning::MAX_OBSERVATIONS / 20,
            "{ordinary}"
        );
    }
}

//! When samplers learn, and from which observations.
//!
//! Learning changes what is drawn, so it must not know the random numbers that are still to come; but those of one sequence
//! are anything but independent of each other: each avoids the strata that the ones before it have been in. So frames come in epochs:
//! within one nothing is learned and the sequence keeps its strata, and after it a new sequence begins
//! ([`crate::LightSampler::lessons`]). The first epochs are single frames, later ones double
//! (cf. Mueller, Gross and Novak 2017, "Practical Path Guiding for Efficient Light-Transport Simulation", section 5).

use crate::Observation;
use std::borrow::Cow;

/// Epochs of one frame each, after the eye has moved; a power of two. Higher values learn sooner; lower values keep more strata.
const SINGLE_FRAMES: u32 = 4;
/// Frames at the end of an epoch that are learned from. Higher values learn more; lower values are faster.
const LESSON_FRAMES: u32 = 8;
/// Observations that are learned from in one frame, at most: larger images are thinned, so that learning costs the same
/// at any size. Higher values learn more; lower values are faster.
const MAX_OBSERVATIONS: usize = 1 << 16;

/// Frames until an image weighs a frame in full. Higher values hide more of the first frames' noise; lower values waste
/// fewer of their samples.
const RAMP: u32 = 4;

/// Where a sampler is in the course of its learning.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schedule {
    /// Frames done since the eye has moved.
    frame: u32,
    /// Times that the sampler has learned.
    lessons: u32,
    /// What the frames of this epoch have taught so far.
    kept: Vec<Vec<Observation>>,
}

impl Schedule {
    /// The eye has moved: what is seen is new.
    pub(crate) fn restart(&mut self) {
        self.frame = 0;
        self.kept.clear();
    }

    /// Weight of the coming frame in the image: the first ones teach more than they show.
    pub(crate) fn frame_weight(&self) -> f32 {
        let grown = (self.frame + 1).min(RAMP) as f32 / RAMP as f32;
        grown * grown
    }

    /// Times that the sampler has learned.
    pub(crate) fn lessons(&self) -> u32 {
        self.lessons
    }

    /// Number of the first frame after this epoch.
    #[inline]
    fn epoch_end(&self) -> u32 {
        let next = self.frame + 1;
        if next <= SINGLE_FRAMES {
            next
        } else {
            next.checked_next_power_of_two().unwrap_or(u32::MAX)
        }
    }

    /// Whether the frame that is being rendered will be learned from.
    #[inline]
    pub(crate) fn wants_observations(&self) -> bool {
        self.epoch_end() - self.frame <= LESSON_FRAMES
    }

    /// Ends a frame; at the end of an epoch, returns what is to be learned: the observations of its last frames, of each every nth, so
    /// that at most [`MAX_OBSERVATIONS`] or so are left. Which ones changes with the frame.
    pub(crate) fn end_frame<'l>(&mut self, logs: &'l [Vec<Observation>]) -> Option<Cow<'l, [Vec<Observation>]>> {
        let (wanted, end) = (self.wants_observations(), self.epoch_end());
        // An epoch without end, after more frames than anyone waits for.
        self.frame = (self.frame + 1).min(u32::MAX - LESSON_FRAMES - 1);
        if !wanted {
            return None;
        }
        let count = logs.iter().map(Vec::len).sum::<usize>();
        let step = count.div_ceil(MAX_OBSERVATIONS).max(1);
        let first = self.frame as usize % step;
        let thinned = logs
            .iter()
            .map(|log| log.iter().skip(first).step_by(step).copied().collect());
        if self.frame < end {
            self.kept.extend(thinned);
            return None;
        }
        self.lessons = self.lessons.wrapping_add(1);
        if step == 1 && self.kept.is_empty() {
            return Some(Cow::Borrowed(logs));
        }
        self.kept.extend(thinned);
        Some(Cow::Owned(std::mem::take(&mut self.kept)))
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.kept.iter().map(|log| size_of_val(&log[..])).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ShadingPoint;
    use glam::Vec3;

    fn log(count: u32) -> Vec<Observation> {
        let observation = |light| Observation {
            point: ShadingPoint {
                position_ws: Vec3::ZERO,
                normal_ws: Vec3::Y,
                primary: true,
            },
            light,
            unshadowed: 1.0,
            irradiance: 1.0,
            pmf: 1.0,
            visible: true,
        };
        (0..count).map(observation).collect()
    }

    #[test]
    fn every_first_frame_teaches_then_the_last_of_each_epoch() {
        let mut schedule = Schedule::default();
        let logs = [log(3)];
        for _ in 0..2 {
            let before = schedule.lessons();
            let mut learned_at = Vec::new();
            let mut wanted = 0;
            for frame in 1..=130 {
                wanted += u32::from(schedule.wants_observations());
                if let Some(lesson) = schedule.end_frame(&logs) {
                    learned_at.push(frame);
                    let observations = lesson.iter().map(Vec::len).sum::<usize>();
                    // Epochs are half as long as what is done when they end.
                    let frames = if frame <= SINGLE_FRAMES { 1 } else { frame / 2 };
                    assert_eq!(observations, 3 * frames.min(LESSON_FRAMES) as usize);
                }
            }
            let expected: Vec<u32> = (1..=SINGLE_FRAMES).chain([8, 16, 32, 64, 128]).collect();
            assert_eq!(learned_at, expected);
            assert_eq!(wanted, 8 + 4 * LESSON_FRAMES);
            assert_eq!(schedule.lessons() - before, expected.len() as u32);
            schedule.restart();
        }
    }

    #[test]
    fn the_last_epoch_never_ends() {
        let mut schedule = Schedule {
            frame: u32::MAX - 20,
            ..Schedule::default()
        };
        for _ in 0..40 {
            assert!(schedule.end_frame(&[log(1)]).is_none());
        }
    }

    #[test]
    fn large_logs_are_thinned_to_other_observations_every_frame() {
        let logs: Vec<_> = (0..4).map(|_| log(MAX_OBSERVATIONS as u32)).collect();
        let mut schedule = Schedule::default();
        let mut seen = std::collections::HashSet::new();
        for _ in 0..4 {
            let thinned = schedule.end_frame(&logs).expect("first frames are learned from");
            assert_eq!(thinned.iter().map(Vec::len).sum::<usize>(), MAX_OBSERVATIONS);
            seen.extend(thinned[0].iter().map(|observation| observation.light));
        }
        assert_eq!(seen.len(), MAX_OBSERVATIONS);
    }
}

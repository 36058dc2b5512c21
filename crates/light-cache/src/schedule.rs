//! Which frames are learned from, and which of their observations.

use crate::Observation;
use std::borrow::Cow;

/// Frames after the eye has moved that are all learned from; later every [`LATER_STEP`]th is, for little is new in them.
/// Higher values learn more; lower values are faster.
const FIRST_FRAMES: u32 = 24;
/// See [`FIRST_FRAMES`].
const LATER_STEP: u32 = 2;
/// Observations that are learned from in one frame, at most: larger images are thinned, so that learning costs the same
/// at any size. Higher values learn more; lower values are faster.
const MAX_OBSERVATIONS: usize = 1 << 16;

/// Frames until an image weighs a frame in full. Higher values hide more of the first frames' noise; lower values waste
/// fewer of their samples.
const RAMP: u32 = 4;

/// Where a sampler is in the course of its learning.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Schedule {
    /// Frames done since the eye has moved.
    frame: u32,
}

impl Schedule {
    /// The eye has moved: what is seen is new.
    pub(crate) fn restart(&mut self) {
        self.frame = 0;
    }

    /// Weight of the coming frame in the image: the first ones teach more than they show.
    pub(crate) fn frame_weight(self) -> f32 {
        let grown = (self.frame + 1).min(RAMP) as f32 / RAMP as f32;
        grown * grown
    }

    /// Whether the frame that is being rendered will be learned from.
    #[inline]
    pub(crate) fn wants_observations(self) -> bool {
        self.frame < FIRST_FRAMES || (self.frame + 1).is_multiple_of(LATER_STEP)
    }

    /// Ends a frame; returns what is to be learned from its logs, if it is one to learn from: every nth observation, so
    /// that at most [`MAX_OBSERVATIONS`] or so are left. Which ones changes with the frame.
    pub(crate) fn end_frame<'l>(&mut self, logs: &'l [Vec<Observation>]) -> Option<Cow<'l, [Vec<Observation>]>> {
        let wanted = self.wants_observations();
        // Wraps round to a frame that is one of the later ones.
        self.frame = self.frame.checked_add(1).unwrap_or(FIRST_FRAMES);
        if !wanted {
            return None;
        }
        let count = logs.iter().map(Vec::len).sum::<usize>();
        let step = count.div_ceil(MAX_OBSERVATIONS).max(1);
        if step == 1 {
            return Some(Cow::Borrowed(logs));
        }
        let first = self.frame as usize % step;
        let thinned = logs
            .iter()
            .map(|log| log.iter().skip(first).step_by(step).copied().collect());
        Some(thinned.collect())
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
    fn all_first_frames_are_learned_from_then_every_other_until_the_eye_moves() {
        let mut schedule = Schedule::default();
        let logs = [log(3)];
        let learned = |schedule: &mut Schedule| {
            let wanted = schedule.wants_observations();
            assert_eq!(schedule.end_frame(&logs).is_some(), wanted);
            wanted
        };
        assert!((0..FIRST_FRAMES).all(|_| learned(&mut schedule)));
        assert_eq!((0..40).filter(|_| learned(&mut schedule)).count(), 20);
        schedule.restart();
        assert!((0..FIRST_FRAMES).all(|_| learned(&mut schedule)));
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

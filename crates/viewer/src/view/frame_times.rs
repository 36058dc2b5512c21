//! How long frames take, and how long an input takes to be seen.

use std::collections::VecDeque;
use std::time::Instant;

/// Frames that are looked back on.
const KEPT: usize = 240;

/// The last values of something measured in milliseconds.
#[derive(Clone, Debug, Default)]
pub(super) struct Recent {
    values: VecDeque<f64>,
}

/// What the values are like.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub(super) struct Summary {
    pub(super) min: f64,
    pub(super) median: f64,
    pub(super) p95: f64,
    pub(super) max: f64,
    pub(super) count: usize,
}

impl Recent {
    /// One more; the oldest is forgotten.
    pub(super) fn push(&mut self, milliseconds: f64) {
        if self.values.len() == KEPT {
            self.values.pop_front();
        }
        self.values.push_back(milliseconds);
    }

    /// `None` if there are none.
    pub(super) fn summary(&self) -> Option<Summary> {
        let mut sorted: Vec<f64> = self.values.iter().copied().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        Some(Summary {
            min: sorted[0],
            median: sorted[last / 2],
            p95: sorted[(last as f64 * 0.95).ceil() as usize],
            max: sorted[last],
            count: sorted.len(),
        })
    }

    /// The newest last.
    pub(super) fn values(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.values.iter().copied()
    }
}

/// Times of the window.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameTimes {
    /// From one frame of the window to the next, while it is busy.
    pub(super) window: Recent,
    /// Rendering one picture.
    pub(super) render: Recent,
    /// From an input to the frame that shows it.
    pub(super) latency: Recent,
    last: Option<Instant>,
}

impl FrameTimes {
    /// A frame begins; returns the seconds since the last one. After a pause (`idle`) there was none.
    pub(super) fn begin(&mut self, idle: bool) -> f32 {
        let now = Instant::now();
        let last = self.last.replace(now);
        match last {
            Some(last) if !idle => {
                let seconds = now.duration_since(last).as_secs_f64();
                self.window.push(seconds * 1e3);
                seconds as f32
            }
            _ => 1.0 / 60.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_is_of_the_last_values() {
        assert_eq!(Recent::default().summary(), None);
        let mut recent = Recent::default();
        recent.push(1e6);
        (1..=KEPT).for_each(|i| recent.push(i as f64));
        let summary = recent.summary().expect("values");
        assert_eq!((summary.min, summary.max, summary.count), (1.0, KEPT as f64, KEPT));
        assert!(summary.median < summary.p95 && summary.p95 < summary.max, "{summary:?}");
        let mut one = Recent::default();
        one.push(7.0);
        let summary = one.summary().expect("one");
        assert_eq!((summary.min, summary.p95, summary.max), (7.0, 7.0, 7.0));
    }
}

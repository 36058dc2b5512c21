//! One entry of a cell's cut: a part of the light tree, and what was seen of it in the cell.

use super::branch::Branch;
use super::emitter::Emitter;
use super::subcell::Count;
use crate::state::is_amount;
use crate::tree::Tree;

/// How many observations the prior is worth.
const PRIOR_COUNT: f32 = 2.0;
/// Part of the prior that does not fade with what was learned. Higher values waste samples on hidden lights; lower values
/// leave bright specks where a light reaches a few points of a cell only.
const LASTING_PRIOR: f32 = 0.1;
/// Contributions are counted as no more than this many times what is expected of the entry, so that one spike does not
/// own the cell. Statistics only: the image is not clamped.
const SPIKE: f32 = 16.0;

/// At how many points its share in what is drawn must be known before it is believed.
const ENOUGH_POINTS: f32 = 8.0;

/// A part of the light tree and what was seen of it here. What is seen is counted as a ratio: irradiance divided by the
/// probability of the light within the entry, over what the emitter was estimated to send to the point.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Entry {
    /// Which part of the light tree.
    pub(super) branch: Branch,
    /// Strength that the tree believed in when the entry was made.
    believed: f32,
    /// Root mean square of the emitter's estimate over the cell's probes.
    pub(super) scale: f32,
    /// How often it was drawn.
    pub(super) count: Count,
    /// Sum of the ratios, visible ones only.
    sum: f32,
    /// Sum of their squares.
    sum_sq: f32,
    /// Root mean square ratio expected beforehand.
    pub(super) prior: f32,
    /// Sum of its shares in what is drawn, over the points where that was looked up.
    shares: f32,
    /// How many points those are.
    points: f32,
}

impl Entry {
    /// One of which nothing is known but what the tree believes, with `scale` as the estimate over the cell's probes.
    pub(super) fn unseen(branch: Branch, emitter: &Emitter, scale: f32) -> Self {
        Self {
            branch,
            believed: emitter.strength(),
            scale,
            count: Count::default(),
            sum: 0.0,
            sum_sq: 0.0,
            prior: 1.0,
            shares: 0.0,
            points: 0.0,
        }
    }

    /// Whether numbers read from a file can be those of an entry.
    pub(super) fn is_sound(&self) -> bool {
        let amounts = [
            self.believed,
            self.scale,
            self.count.drawn,
            self.count.visible,
            self.sum,
            self.sum_sq,
            self.prior,
            self.shares,
            self.points,
        ];
        amounts.into_iter().all(is_amount)
    }

    /// What was learned: estimated root mean square ratio. The prior fades as 1 / n where nothing was ever visible, as it
    /// is weighed down once for the count and once for what the count taught, and in the long run as n^-1/2 with a
    /// small constant: what was not visible so far may still be, to few points.
    pub(super) fn ratio(&self) -> f32 {
        let n = self.count.drawn + PRIOR_COUNT;
        let fade = PRIOR_COUNT / n + LASTING_PRIOR;
        ((self.sum_sq + PRIOR_COUNT * fade * self.prior * self.prior) / n).sqrt()
    }

    /// Estimated mean ratio over the root mean square. Of what was never seen nothing is expected.
    pub(super) fn mean_over_ratio(&self) -> f32 {
        let mean = self.sum / (self.count.drawn + PRIOR_COUNT);
        let ratio = self.ratio();
        if mean > 0.0 && ratio > 0.0 { mean / ratio } else { 0.0 }
    }

    /// Weight in the cell as a whole.
    pub(super) fn weight(&self) -> f32 {
        self.ratio() * self.scale
    }

    /// Takes note of its share in what is drawn at a point that stands for so many.
    pub(super) fn observe_share(&mut self, share: f32, times: f32) {
        self.shares += times * share;
        self.points += times;
    }

    /// Its share in the `total` weight of all entries, or in what is drawn as a mean over the points of the cell, if that is known and
    /// more: what matters in a corner of the cell has next to no weight in the cell as a whole.
    pub(super) fn share(&self, total: f32) -> f32 {
        (self.weight() / total).max(self.shares / self.points.max(ENOUGH_POINTS))
    }

    /// The emitter, as strong as was believed before anything was seen.
    pub(super) fn emitter(&self, tree: &Tree) -> Emitter {
        Emitter::of(tree, self.branch).with_strength(self.believed)
    }

    /// The emitter, as strong as was learned.
    pub(super) fn learned(&self, tree: &Tree) -> Emitter {
        Emitter::of(tree, self.branch).with_strength(self.believed * self.ratio())
    }

    /// Takes note of a ratio, `times` times. `most`: what no light can exceed by much.
    pub(super) fn observe(&mut self, ratio: f32, visible: bool, most: f32, times: f32) {
        let expected = self.prior.max((self.sum_sq / self.count.drawn.max(1.0)).sqrt());
        self.count.drawn += times;
        if visible {
            self.count.visible += times;
            let ratio = ratio.min((SPIKE * expected).max(most));
            self.sum += times * ratio;
            self.sum_sq += times * ratio * ratio;
        }
    }
}

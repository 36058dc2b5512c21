//! The weights of a cut at a point, all of them at once, and the exact probabilities made from them.
//!
//! Entries stand in tree order lane by lane: lane `l` holds entries `l * rows` to `(l + 1) * rows - 1`, one per row, so
//! that rows are evaluated with vector instructions, lanes add up along the way, and a draw looks at the sums of the
//! lanes first and then at one lane only. The arithmetic is the same on every processor (no fused multiply-add), and so
//! are the images.

use super::branch::Branch;
use super::cut::Cut;
use super::emitter::Emitter;
use super::row::{Attenuation, Expected, LANES, Lanes, Row, Weighed};
use crate::tree::Receiver;
use glam::Vec3;

/// Rows of the longest cut.
const MAX_ROWS: usize = super::cell::MAX_ENTRIES.div_ceil(LANES);

/// A cut, ready to be evaluated.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Weights {
    rows: Vec<Row>,
    /// Empty if no entry is attenuated.
    attenuation: Vec<Attenuation>,
    /// Empty if there is no control variate.
    expected: Vec<Expected>,
}

/// By what a place within a cell differs from the cell, entries laid out as in [`Weights`]; both empty for 1.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Factors<'f> {
    /// How often entries are drawn.
    pub(super) drawn: &'f [Lanes],
    /// What they are expected to bring.
    pub(super) expected: &'f [Lanes],
}

/// A cut as it is seen from a point: an interval cut in proportion to the weights there.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'v> {
    /// The point.
    pub(super) receiver: &'v Receiver,
    /// By which weights and expectations are multiplied.
    pub(super) factors: Factors<'v>,
    /// Of the interval, at most 2^52.
    pub(super) width: u64,
}

/// What to look for in an interval.
#[derive(Clone, Copy, Debug)]
pub(super) enum Wanted {
    /// A position.
    At(u64),
    /// An entry of the cut.
    Entry(usize),
}

/// An entry and its part of an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    /// What the entry stands for.
    pub(super) branch: Branch,
    /// Where its part begins.
    pub(super) start: u64,
    /// How wide it is.
    pub(super) width: u64,
    /// What is expected here.
    pub(super) expected: Expectation,
}

/// What is expected at a point, by channel, in the units of weights; zero without a control variate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Expectation {
    /// Of all entries together.
    pub(super) total: Vec3,
    /// Of one entry, over its share of the interval.
    pub(super) own: Vec3,
}

impl Weights {
    /// The cut of `entries`, in tree order; at most as many as a cell may have. `controlled`: with what is expected of them.
    pub(super) fn new(entries: &[Weighed], controlled: bool) -> Self {
        let count = entries.len().div_ceil(LANES);
        let mut weights = Self {
            rows: Vec::with_capacity(count),
            ..Self::default()
        };
        let attenuated = entries.iter().any(|entry| entry.emitter.is_attenuated());
        for row in 0..count {
            let of: [Weighed; LANES] = std::array::from_fn(|lane| {
                let entry = entries.get(lane * count + row).copied();
                entry.unwrap_or(Weighed {
                    branch: Branch::ROOT,
                    emitter: Emitter::DARK,
                    expected: Vec3::ZERO,
                })
            });
            weights.rows.push(Row::of(&of));
            if attenuated {
                weights.attenuation.push(Attenuation::of(&of));
            }
            if controlled {
                weights.expected.push(Expected::of(&of));
            }
        }
        weights
    }

    /// The first `count` entries, in tree order.
    pub(super) fn entries(&self, count: usize) -> impl Iterator<Item = (Branch, Emitter)> {
        (0..count).map(|entry| {
            let (row, lane) = (entry % self.rows.len(), entry / self.rows.len());
            let mut emitter = self.rows[row].emitter(lane);
            if let Some(attenuation) = self.attenuation.get(row) {
                attenuation.attenuate(lane, &mut emitter);
            }
            (self.rows[row].branch[lane], emitter)
        })
    }

    /// What each of the first `count` entries is expected to bring, by channel, over what it weighs, in tree order; nothing without
    /// a control variate.
    pub(super) fn expected(&self, count: usize) -> impl Iterator<Item = Vec3> {
        let rows = self.expected.len();
        (0..count).filter_map(move |entry| {
            let Expected(channels) = self.expected.get(entry % rows.max(1))?;
            Some(Vec3::from(channels.map(|lanes| lanes[entry / rows])))
        })
    }

    /// Whether there is a control variate.
    pub(super) fn is_controlled(&self) -> bool {
        !self.expected.is_empty()
    }

    /// Whether any entry is attenuated.
    pub(super) fn is_attenuated(&self) -> bool {
        !self.attenuation.is_empty()
    }

    /// Whether these can be the weights of a cut into `branches`.
    pub(super) fn is_sound(&self, mut branches: impl ExactSizeIterator<Item = Branch>, controlled: bool) -> bool {
        let rows = branches.len().div_ceil(LANES);
        let none_or_all = |count: usize| count == 0 || count == rows;
        self.rows.len() == rows
            && none_or_all(self.attenuation.len())
            && self.expected.len() == if controlled { rows } else { 0 }
            && (0..branches.len()).all(|entry| branches.next() == Some(self.rows[entry % rows].branch[entry / rows]))
            && self.rows.iter().all(Row::is_sound)
            && self.attenuation.iter().all(Attenuation::is_sound)
            && self.expected.iter().all(Expected::is_sound)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>()
            + self.attenuation.capacity() * size_of::<Attenuation>()
            + self.expected.capacity() * size_of::<Expected>()
    }

    /// For each of `wanted` the part that holds it; `None` if all weights are zero. The weights are worked out once.
    #[cfg(target_arch = "x86_64")]
    #[inline]
    #[allow(unsafe_code, reason = "compiled for instructions that not every processor has")]
    pub(super) fn find_each(&self, view: &View<'_>, wanted: &[Wanted], parts: &mut [Option<Part>]) {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
        {
            // SAFETY: the processor has the instructions.
            unsafe { self.find_avx512(view, wanted, parts) }
        } else if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the instructions.
            unsafe { self.find_avx2(view, wanted, parts) }
        } else {
            self.find_anywhere(view, wanted, parts);
        }
    }

    /// The same on other processors.
    #[cfg(not(target_arch = "x86_64"))]
    #[inline]
    pub(super) fn find_each(&self, view: &View<'_>, wanted: &[Wanted], parts: &mut [Option<Part>]) {
        self.find_anywhere(view, wanted, parts);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq")]
    fn find_avx512(&self, view: &View<'_>, wanted: &[Wanted], parts: &mut [Option<Part>]) {
        self.find_anywhere(view, wanted, parts);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn find_avx2(&self, view: &View<'_>, wanted: &[Wanted], parts: &mut [Option<Part>]) {
        self.find_anywhere(view, wanted, parts);
    }

    #[inline(always)]
    fn find_anywhere(&self, view: &View<'_>, wanted: &[Wanted], parts: &mut [Option<Part>]) {
        let (weights, lanes, total) = match (self.attenuation.is_empty(), self.expected.is_empty()) {
            (true, true) => self.evaluate::<false, false>(view),
            (true, false) => self.evaluate::<false, true>(view),
            (false, true) => self.evaluate::<true, false>(view),
            (false, false) => self.evaluate::<true, true>(view),
        };
        let Some(cut) = Cut::new(&lanes, view.width) else {
            parts.fill(None);
            return;
        };
        for (part, &wanted) in parts.iter_mut().zip(wanted) {
            *part = Some(self.part(view, &weights, &cut, total, wanted));
        }
    }

    /// The share of each of the first `count` entries in all weights, in tree order; `None` where nothing arrives.
    pub(super) fn shares(&self, view: &View<'_>, count: usize) -> Option<impl Iterator<Item = f32>> {
        let (weights, lanes, _) = if self.attenuation.is_empty() {
            self.evaluate::<false, false>(view)
        } else {
            self.evaluate::<true, false>(view)
        };
        let (rows, total) = (self.rows.len(), sum(lanes));
        let share = move |entry: usize| weights[entry % rows][entry / rows] / total;
        (total > 0.0 && total.is_finite()).then(|| (0..count).map(share))
    }

    #[inline(always)]
    fn part(
        &self,
        view: &View<'_>,
        weights: &[Lanes; MAX_ROWS],
        cut: &Cut,
        total_expected: Vec3,
        wanted: Wanted,
    ) -> Part {
        let lane = match wanted {
            Wanted::At(x) => cut.index_at(x),
            Wanted::Entry(entry) => entry / self.rows.len(),
        };
        let (lane_start, lane_width) = cut.part(lane);
        // A lane without weight is never drawn, but its entries may be asked for.
        let of_lane = Cut::new(&column(weights, lane), lane_width);
        let row = match (wanted, &of_lane) {
            (Wanted::At(x), Some(cut)) => cut.index_at(x - lane_start),
            (Wanted::At(_), None) => 0,
            (Wanted::Entry(entry), _) => entry % self.rows.len(),
        };
        let (start, width) = of_lane.map_or((0, 0), |cut| cut.part(row));
        // The entry's share of the interval is its share of all weights.
        let own = self.expected.get(row).map_or(Vec3::ZERO, |Expected(channels)| {
            let per_weight = Vec3::from(channels.map(|lanes| lanes[lane]));
            let drawn = view.factors.drawn.get(row).map_or(1.0, |lanes| lanes[lane]);
            let expected = view.factors.expected.get(row).map_or(1.0, |lanes| lanes[lane]);
            per_weight * (cut.total() * expected / drawn)
        });
        Part {
            branch: self.rows[row].branch[lane],
            start: lane_start + start,
            width,
            expected: Expectation {
                total: total_expected,
                own,
            },
        }
    }

    /// All weights, the sums of the lanes, and what is expected in all.
    #[inline(always)]
    fn evaluate<const ATTENUATED: bool, const CONTROLLED: bool>(
        &self,
        view: &View<'_>,
    ) -> ([Lanes; MAX_ROWS], Lanes, Vec3) {
        let mut all = [[0.0; LANES]; MAX_ROWS];
        let mut lanes = [0.0; LANES];
        let mut expected = [[0.0; LANES]; 3];
        for (index, (row, weights)) in self.rows.iter().zip(&mut all).enumerate() {
            let drawn = view.factors.drawn.get(index).unwrap_or(&[1.0; LANES]);
            let brought = view.factors.expected.get(index).unwrap_or(&[1.0; LANES]);
            let attenuation = ATTENUATED.then(|| &self.attenuation[index]);
            let per_weight = CONTROLLED.then(|| &self.expected[index].0);
            // One loop over the lanes, so that a row stays in registers until it is done.
            for lane in 0..LANES {
                let mut emitter = row.emitter(lane);
                if let Some(attenuation) = attenuation {
                    attenuation.attenuate(lane, &mut emitter);
                }
                let importance = emitter.importance::<ATTENUATED>(view.receiver);
                weights[lane] = importance * drawn[lane];
                lanes[lane] += weights[lane];
                if let Some(per_weight) = per_weight {
                    let importance = importance * brought[lane];
                    for (expected, per_weight) in expected.iter_mut().zip(per_weight) {
                        expected[lane] += importance * per_weight[lane];
                    }
                }
            }
        }
        (all, lanes, Vec3::from(expected.map(sum)))
    }
}

/// The sum of all lanes, by halves: vector instructions, and the same order everywhere.
#[inline(always)]
fn sum(mut lanes: Lanes) -> f32 {
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            lanes[i] += lanes[i + half];
        }
        half /= 2;
    }
    lanes[0]
}

/// The weights of one lane, zeros after them.
#[inline(always)]
fn column(weights: &[Lanes; MAX_ROWS], lane: usize) -> Lanes {
    std::array::from_fn(|row| if row < MAX_ROWS { weights[row][lane] } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{mixed_lights, points};
    use crate::tree::Tree;

    const WIDTH: u64 = (1 << 52) - 12_345;

    #[test]
    fn every_processor_finds_the_same() {
        let tree = Tree::new(&mixed_lights(200, 3));
        let weighed = |branch| Weighed {
            branch,
            emitter: Emitter::of(&tree, branch),
            expected: Vec3::new(0.5, 0.25, 0.75),
        };
        let mut entries = vec![weighed(Branch::DISTANT)];
        for node in (2..tree.nodes.len() as u32)
            .step_by(7)
            .take(super::super::cell::MAX_ENTRIES - 1)
        {
            entries.push(weighed(Branch::of_node(&tree, node)));
        }
        let weights = Weights::new(&entries, true);
        let dimmed: Vec<Lanes> = (0..8)
            .map(|row| std::array::from_fn(|lane| 1.0 / (1 + row * lane) as f32))
            .collect();
        for (i, point) in (0..).zip(points(200, 5)) {
            let receiver = Receiver::from(&point);
            let view = View {
                receiver: &receiver,
                factors: if i % 2 == 0 {
                    Factors::default()
                } else {
                    Factors {
                        drawn: &dimmed,
                        expected: &dimmed,
                    }
                },
                width: WIDTH,
            };
            let x = sampling::Random::new(1, i, 0).u32(0);
            for wanted in [
                Wanted::At(u64::from(x) << 19),
                Wanted::Entry(x as usize % entries.len()),
            ] {
                let mut portable = [None];
                weights.find_anywhere(&view, &[wanted], &mut portable);
                let mut fastest = [None];
                weights.find_each(&view, &[wanted], &mut fastest);
                assert_eq!(fastest, portable);
            }
            let mut end = 0;
            for entry in 0..entries.len() {
                let mut part = [None];
                weights.find_each(&view, &[Wanted::Entry(entry)], &mut part);
                let [Some(part)] = part else {
                    end = WIDTH; // nothing arrives here
                    break;
                };
                assert_eq!(part.start, end);
                end += part.width;
            }
            assert_eq!(end, WIDTH);
        }
    }
}

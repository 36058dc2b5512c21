//! One cell: a cut of the light tree, what was seen of each of its entries, and the distribution made from it.
//!
//! The distribution is fixed within the cell. Its entries' weights estimate the root of the second moment of their
//! contribution, visibility included, which is the optimum for a table shared by many points (Rath et al. 2020; see
//! Wang et al. 2021 for cuts refined while rendering). An entry that is one light needs nothing more to be drawn; an
//! entry that is a cluster is finished by the light tree's own descent at the point.

use super::branch::Branch;
use crate::Observation;
use crate::tree::{Descent, MAX_LEAF_LIGHTS, Receiver, Tree, UNIT, probability};

/// Most entries of a cut. Higher values resolve more lights one by one; lower values learn faster and cost less memory.
pub(super) const MAX_ENTRIES: usize = 128;
/// Entries of a new cell's cut.
const FIRST_ENTRIES: usize = 48;
/// How many observations the prior is worth.
const PRIOR_COUNT: f32 = 2.0;
/// Entries of at least this share of the whole weight that are clusters are split.
const SPLIT_SHARE: f32 = 0.5 / MAX_ENTRIES as f32;
/// Sibling entries that together have less than this share of the whole weight may be merged.
const MERGE_SHARE: f32 = 0.05 / MAX_ENTRIES as f32;
/// Contributions are counted as no more than this many times the entry's root mean square, so that one spike does not
/// own the cell. Statistics only: the image is not clamped.
const SPIKE: f32 = 16.0;
/// Points at which a new entry's prior is evaluated.
const PROBES: usize = 8;
/// Least prior of an entry, as a share of the mean over the cell's entries: the probes may all lie where a light does not
/// reach, and other points of the cell not.
const LEAST_PRIOR: f32 = 0.02;
/// Observations after which a cell is halved.
const HALVE_AT: f32 = 400.0;
/// How many observations a half takes over from the whole, at most.
const INHERITED_COUNT: f32 = 4.0;
/// A distribution is made anew when the cell has seen this many times more than when it was last made.
const REBUILD_GROWTH: f32 = 1.15;

/// A node of the light tree and what was seen of it here. Contributions are irradiances divided by the probability of the light within
/// the entry, luminance, in units of the tree's strongest light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// Which part of the light tree.
    pub(super) branch: Branch,
    /// First light of it, in tree order.
    pub(super) first: u32,
    /// Times drawn.
    pub(super) drawn: f32,
    /// Times drawn and visible.
    pub(super) visible: f32,
    /// Sum of the squared contributions, visible ones only.
    pub(super) sum_sq: f32,
    /// Root mean square contribution expected beforehand, visibility included.
    pub(super) prior: f32,
}

impl Entry {
    const UNSEEN: Self = Self {
        branch: Branch::ROOT,
        first: 0,
        drawn: 0.0,
        visible: 0.0,
        sum_sq: 0.0,
        prior: 0.0,
    };

    /// Estimated root of the second moment. The prior fades as 1 / n where nothing was ever visible, as it is weighed
    /// down once for the count and once for what the count taught; the root of an unseen share would fade as n^-1/2 and
    /// waste samples on what is hidden.
    pub(super) fn weight(&self) -> f32 {
        let n = self.drawn + PRIOR_COUNT;
        let fade = PRIOR_COUNT / n;
        ((self.sum_sq + PRIOR_COUNT * fade * self.prior * self.prior) / n).sqrt()
    }

    /// `total`: the weight of the whole cell, which no single light can exceed by much.
    fn observe(&mut self, contribution: f32, visible: bool, total: f32) {
        let expected = self.prior.max((self.sum_sq / self.drawn.max(1.0)).sqrt());
        self.drawn += 1.0;
        if visible {
            self.visible += 1.0;
            self.sum_sq += contribution.min((SPIKE * expected).max(total)).powi(2);
        }
    }
}

/// A cell of the grid.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// Its key in the grid.
    pub(super) key: u64,
    /// Whether it has been halved: it then serves only where a half is missing.
    pub(super) split: bool,
    /// Points of the cell, at most [`PROBES`].
    probes: Vec<Receiver>,
    /// The cut, in tree order: its entries' lights are all lights, each once.
    pub(super) entries: Vec<Entry>,
    /// Per entry the last value of the 32-bit number that draws it.
    pub(super) last: Vec<u32>,
    /// Observations so far, and when the distribution was last made.
    pub(super) seen: f32,
    built_at: f32,
    refined_at: f32,
    /// Sum of the entries' weights when the distribution was last made.
    total: f32,
}

/// The total mass of a cell's entries runs from `first_mass` (the share of the guaranteed part) to 2^32.
pub(super) type FirstMass = u32;

impl Cell {
    fn empty(key: u64, points: &[Receiver]) -> Self {
        let step = points.len().div_ceil(PROBES).max(1);
        Self {
            key,
            split: false,
            probes: points.iter().step_by(step).copied().collect(),
            entries: Vec::with_capacity(FIRST_ENTRIES + MAX_LEAF_LIGHTS),
            last: Vec::new(),
            seen: 0.0,
            built_at: 0.0,
            refined_at: 0.0,
            total: 0.0,
        }
    }

    /// A half of `parent`: it starts with the parent's cut and with what is known from there, as far as the tree's
    /// importance says that it applies.
    pub(super) fn half(key: u64, parent: &Self, points: &[Receiver], tree: &Tree, first_mass: FirstMass) -> Self {
        let mut cell = Self::empty(key, points);
        for known in &parent.entries {
            let there = parent.importance(tree, known.branch);
            let here = cell.importance(tree, known.branch);
            let ratio = if there > 0.0 {
                (here / there).clamp(0.125, 8.0)
            } else {
                1.0
            };
            let weight = known.weight() * ratio;
            let drawn = known.drawn.min(INHERITED_COUNT);
            let visible = if known.drawn > 0.0 {
                known.visible * (drawn / known.drawn)
            } else {
                0.0
            };
            // What was never visible stays known as such: its weight is all prior.
            let sum_sq = if known.visible > 0.0 {
                drawn * weight * weight
            } else {
                0.0
            };
            let prior = if known.visible > 0.0 {
                weight
            } else {
                weight * (drawn + PRIOR_COUNT) / PRIOR_COUNT
            };
            cell.entries.push(Entry {
                drawn,
                visible,
                sum_sq,
                prior,
                ..*known
            });
        }
        cell.build(first_mass);
        cell
    }

    /// A new cell at its first observed points: a cut from the tree's own importance.
    pub(super) fn new(key: u64, points: &[Receiver], tree: &Tree, first_mass: FirstMass) -> Self {
        let mut cell = Self::empty(key, points);
        if !tree.leaves.is_empty() {
            cell.entries.push(cell.unseen(tree, Branch::ROOT));
        }
        if !tree.distant.is_empty() {
            cell.entries.push(cell.unseen(tree, Branch::DISTANT));
        }
        // Split what weighs most until the cut is long enough. The cut stays in tree order.
        while cell.entries.len() < FIRST_ENTRIES {
            let heaviest = (0..cell.entries.len())
                .filter(|&j| cell.entries[j].prior > 0.0 && cell.entries[j].branch.node().is_some())
                .max_by(|&a, &b| cell.entries[a].prior.total_cmp(&cell.entries[b].prior));
            let Some(j) = heaviest else { break };
            cell.divide(tree, j);
        }
        let mean = cell.entries.iter().map(|e| e.prior).sum::<f32>() / cell.entries.len().max(1) as f32;
        for entry in &mut cell.entries {
            entry.prior = entry.prior.max(LEAST_PRIOR * mean);
        }
        cell.build(first_mass);
        cell
    }

    /// Root mean square over the probes of what the tree thinks of `branch`.
    fn importance(&self, tree: &Tree, branch: Branch) -> f32 {
        let sum_sq: f32 = self.probes.iter().map(|p| branch.importance(tree, p).powi(2)).sum();
        (sum_sq / self.probes.len().max(1) as f32).sqrt()
    }

    /// An entry of which nothing is known but the tree's importance at the probes.
    fn unseen(&self, tree: &Tree, branch: Branch) -> Entry {
        Entry {
            branch,
            first: branch.first(tree),
            prior: self.importance(tree, branch),
            ..Entry::UNSEEN
        }
    }

    /// Replaces entry `j`, a cluster, by its parts, which share the weight that it had.
    fn divide(&mut self, tree: &Tree, j: usize) {
        let parent = self.entries[j];
        let (branches, count) = parent.branch.children(tree);
        let mut parts = branches.map(|branch| self.unseen(tree, branch));
        let parts = &mut parts[..count];
        if parent.drawn > 0.0 {
            let weight = parent.weight();
            let sum: f32 = parts.iter().map(|e| e.prior).sum();
            for part in parts.iter_mut() {
                let share = if sum > 0.0 {
                    part.prior / sum
                } else {
                    1.0 / count as f32
                };
                part.prior = weight * share.max(LEAST_PRIOR);
            }
        }
        self.entries.splice(j..=j, parts.iter().copied());
    }

    /// The entry that holds the light at `position` in tree order.
    #[inline]
    pub(super) fn entry_of(&self, position: u32) -> usize {
        self.entries.partition_point(|e| e.first <= position) - 1
    }

    /// Bounds of entry `j` among 32-bit numbers: first, and how many.
    #[inline]
    pub(super) fn range(&self, j: usize, first_mass: FirstMass) -> (u32, u64) {
        let first = if j == 0 { first_mass } else { self.last[j - 1] + 1 };
        (first, u64::from(self.last[j]) - u64::from(first) + 1)
    }

    /// The entry that `u` (at least the share of the guaranteed part) draws.
    #[inline]
    pub(super) fn draw(&self, u: u32) -> usize {
        self.last.partition_point(|&last| last < u)
    }

    /// Learns from the cell's observations of one frame, in order. `unit`: what the tree's importance is measured in.
    pub(super) fn learn<'o>(
        &mut self,
        tree: &Tree,
        unit: f32,
        observations: impl Iterator<Item = &'o Observation>,
        first_mass: FirstMass,
    ) {
        for o in observations {
            let j = self.entry_of(tree.rank[o.light as usize]);
            let within = match self.entries[j].branch {
                branch if branch.light().is_some() => 1.0,
                branch => {
                    let descent = Descent::inside(tree, Receiver::from(&o.point));
                    probability(descent.width_in(branch.node(), tree.rank[o.light as usize], UNIT))
                }
            };
            if within > 0.0 {
                self.entries[j].observe(o.irradiance / (within * unit), o.visible, self.total);
            }
            self.seen += 1.0;
        }
        if self.seen >= 2.0 * self.refined_at.max(8.0) {
            self.refine(tree);
            self.refined_at = self.seen;
            self.build(first_mass);
        } else if self.seen >= REBUILD_GROWTH * self.built_at {
            self.build(first_mass);
        }
    }

    /// Whether enough has been seen for finer cells to pay.
    pub(super) fn wants_halves(&self) -> bool {
        !self.split && self.seen >= HALVE_AT
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.last.capacity() * size_of::<u32>()
            + self.probes.capacity() * size_of::<Receiver>()
    }

    /// Splits clusters that weigh much; merges parts that together weigh next to nothing, to make room.
    fn refine(&mut self, tree: &Tree) {
        let total: f32 = self.entries.iter().map(Entry::weight).sum();
        if total <= 0.0 {
            return;
        }
        let mut j = 0;
        while j < self.entries.len() {
            j = if self.merge_at(tree, j, MERGE_SHARE * total) {
                j.saturating_sub(MAX_LEAF_LIGHTS)
            } else {
                j + 1
            };
        }
        j = 0;
        while j < self.entries.len() && self.entries.len() < MAX_ENTRIES {
            let entry = self.entries[j];
            if entry.weight() > SPLIT_SHARE * total && entry.branch.node().is_some() {
                self.divide(tree, j); // its parts are looked at next
            } else {
                j += 1;
            }
        }
    }

    /// Replaces the entries from `j` on by their parent if they are all of its parts and weigh less than `limit`.
    fn merge_at(&mut self, tree: &Tree, j: usize, limit: f32) -> bool {
        if self.entries[j].weight() >= limit {
            return false;
        }
        let Some(parent) = self.entries[j].branch.parent(tree) else {
            return false;
        };
        let (branches, count) = parent.children(tree);
        let Some(parts) = self.entries.get(j..j + count) else {
            return false;
        };
        let weight: f32 = parts.iter().map(Entry::weight).sum();
        if weight >= limit || !parts.iter().map(|e| e.branch).eq(branches[..count].iter().copied()) {
            return false;
        }
        // What was seen of the parts says nothing of the parent's own second moment: it starts with their joint weight.
        let merged = Entry {
            branch: parent,
            first: parts[0].first,
            prior: weight,
            ..Entry::UNSEEN
        };
        self.entries.splice(j..j + count, [merged]);
        true
    }

    /// Integer masses in proportion to the weights, each at least 1, all together 2^32 - `first_mass`.
    fn build(&mut self, first_mass: FirstMass) {
        self.built_at = self.seen;
        let n = self.entries.len();
        let total: f64 = self.entries.iter().map(|e| f64::from(e.weight())).sum();
        self.total = total as f32;
        let room = (1u64 << 32) - u64::from(first_mass) - n as u64;
        let mut sum = 0.0;
        self.last.clear();
        for (j, e) in self.entries.iter().enumerate() {
            sum += if total > 0.0 {
                f64::from(e.weight()) / total
            } else {
                1.0 / n as f64
            };
            let end = u64::from(first_mass) + (sum.min(1.0) * room as f64) as u64 + (j as u64 + 1);
            self.last.push((end - 1) as u32);
        }
        *self.last.last_mut().expect("a cut has at least one entry") = u32::MAX;
    }
}

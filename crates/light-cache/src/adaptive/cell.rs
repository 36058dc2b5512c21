//! One cell: a cut of the light tree, and what was seen of each of its entries.
//!
//! At a point every entry weighs its estimated irradiance there times what was learned of it in the cell: the root mean
//! square of contribution / estimate, visibility included (second moments: Rath et al. 2020; cuts refined while
//! rendering: Wang et al. 2021). An entry that is one light needs nothing more to be drawn; an entry that is a cluster is
//! finished by the light tree's own descent at the point.

use super::branch::Branch;
use super::cube::Cube;
use super::directions::Directions;
use super::emitter::Emitter;
use super::entry::Entry;
use super::palette::Palette;
use super::row::Weighed;
use super::subcell::Count;
use super::subcells::SubCells;
use super::weights::{Factors, Part, View, Wanted, Weights};
use crate::Observation;
use crate::state::is_amount;
use crate::tree::{Descent, MAX_LEAF_LIGHTS, Receiver, Tree, UNIT, probability};
use glam::Vec3;
use sampling::HemisphereGuide;

/// Most entries of a cut. Higher values resolve more lights one by one; lower values learn faster and cost less.
pub(super) const MAX_ENTRIES: usize = 96;
/// Entries of a new cell's cut.
const FIRST_ENTRIES: usize = 72;
/// Entries of at least this share of the whole weight that are clusters are split.
const SPLIT_SHARE: f32 = 0.5 / MAX_ENTRIES as f32;
/// Sibling entries that together have less than this share of the whole weight, and of what is drawn, may be merged.
const MERGE_SHARE: f32 = 0.05 / MAX_ENTRIES as f32;
/// Points that stand for the cell where an entry's weight is wanted without a point.
const PROBES: usize = 8;
/// Points of a lesson at which the entries' shares are looked up, at most. Higher values know better what may be merged; lower values
/// are faster.
const SHARE_POINTS: usize = 32;
/// Weights are made anew when the cell has seen this many times more than when they were last made.
const REBUILD_GROWTH: f32 = 1.15;

/// Which cell a cell is, and since when.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Origin {
    /// Its level in the grid.
    pub(super) level: u32,
    /// Whether it holds first hits.
    pub(super) primary: bool,
    /// Number of the frame that it was made after.
    pub(super) frame: u64,
}

/// The lights of the scene, as cells know them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lights<'l> {
    /// All of them.
    pub(super) tree: &'l Tree,
    /// Their colours, for a control variate; `None` if there is none.
    pub(super) palette: Option<&'l Palette>,
}

/// Whether there may be more of what is kept within cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct MayGrow {
    /// Layers of [`SubCells`], largest cubes first.
    pub(super) cubes: usize,
    /// [`Directions`]
    pub(super) places: bool,
}

/// A cell of the grid.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Cell {
    /// Which cell it is.
    pub(super) origin: Origin,
    /// Points of the cell, at most [`PROBES`].
    pub(super) probes: Vec<Receiver>,
    /// The cut, in tree order: its entries' lights are all lights, each once.
    pub(super) entries: Vec<Entry>,
    /// First light of each entry, in tree order.
    firsts: Vec<u32>,
    /// The learned weights, ready for use.
    weights: Weights,
    /// Where in the cell which entry was visible.
    subcells: SubCells,
    /// Where paths go on that leave from here; `None` if none did.
    directions: Option<Box<Directions>>,
    /// Observations so far, and when the weights were last made.
    pub(super) seen: f32,
    built_at: f32,
    refined_at: f32,
    /// Sum of the entries' weights when they were last made.
    total: f32,
}

impl Cell {
    /// A new cell at its first observed points: a cut from the tree's own importance.
    pub(super) fn new(origin: Origin, points: &[Receiver], lights: Lights<'_>) -> Self {
        let tree = lights.tree;
        let step = points.len().div_ceil(PROBES).max(1);
        let mut cell = Self {
            origin,
            probes: points.iter().step_by(step).copied().collect(),
            entries: Vec::with_capacity(FIRST_ENTRIES + MAX_LEAF_LIGHTS),
            firsts: Vec::new(),
            weights: Weights::default(),
            subcells: SubCells::new(lights.palette.is_some()),
            directions: None,
            seen: 0.0,
            built_at: 0.0,
            refined_at: 0.0,
            total: 0.0,
        };
        if !tree.leaves.is_empty() {
            cell.entries.push(cell.unseen(tree, Branch::ROOT));
        }
        if !tree.distant.is_empty() {
            cell.entries.push(cell.unseen(tree, Branch::DISTANT));
        }
        // Split what weighs most until the cut is long enough. The cut stays in tree order.
        while cell.entries.len() < FIRST_ENTRIES {
            let heaviest = (0..cell.entries.len())
                .filter(|&j| cell.entries[j].scale > 0.0 && cell.entries[j].branch.node().is_some())
                .max_by(|&a, &b| cell.entries[a].scale.total_cmp(&cell.entries[b].scale));
            let Some(j) = heaviest else { break };
            cell.divide(tree, j);
        }
        cell.build(lights);
        cell
    }

    /// Root mean square over the probes of what `emitter` sends there.
    fn scale(&self, emitter: &Emitter) -> f32 {
        let sum_sq: f32 = self
            .probes
            .iter()
            .map(|probe| emitter.importance::<true>(probe).powi(2))
            .sum();
        (sum_sq / self.probes.len().max(1) as f32).sqrt()
    }

    /// An entry of which nothing is known but what the tree believes.
    fn unseen(&self, tree: &Tree, branch: Branch) -> Entry {
        let emitter = Emitter::of(tree, branch);
        Entry::unseen(branch, &emitter, self.scale(&emitter))
    }

    /// Replaces entry `j`, a cluster, by its parts, which share the weight that it had.
    fn divide(&mut self, tree: &Tree, j: usize) {
        let parent = self.entries[j];
        let (branches, count) = parent.branch.children(tree);
        let mut parts = branches.map(|branch| self.unseen(tree, branch));
        let parts = &mut parts[..count];
        if parent.count.drawn > 0.0 {
            let sum: f32 = parts.iter().map(|e| e.scale).sum();
            let ratio = if sum > 0.0 {
                parent.weight() / sum
            } else {
                parent.ratio()
            };
            for part in parts.iter_mut() {
                part.prior = ratio;
            }
        }
        self.entries.splice(j..=j, parts.iter().copied());
    }

    /// The entry that holds the light at `position` in tree order.
    #[inline]
    fn entry_of(&self, position: u32) -> usize {
        self.firsts.partition_point(|&first| first <= position) - 1
    }

    /// Around a point in one of its cubes.
    #[inline]
    pub(super) fn around(&self, cube: Cube) -> Nearby<'_> {
        Nearby {
            cell: self,
            cube,
            factors: self.subcells.factors(cube),
        }
    }

    /// Learns from the cell's observations of one lesson, in order. `unit`: what the tree's importance is measured in.
    pub(super) fn learn(
        &mut self,
        lights: Lights<'_>,
        unit: f32,
        may_grow: MayGrow,
        observations: &[(&Observation, Cube)],
    ) {
        let tree = lights.tree;
        self.look_up_shares(observations);
        for &(o, cube) in observations {
            let times = o.weight as f32;
            if let Some(bounce) = o.bounce {
                let directions = self.directions.get_or_insert_with(|| Box::new(Directions::new()));
                directions.observe(cube, bounce, times, may_grow.places);
            }
            let place = tree.rank[o.light as usize];
            let j = self.entry_of(place);
            let receiver = Receiver::from(&o.point);
            let within = match self.entries[j].branch {
                branch if branch.light().is_some() => 1.0,
                branch => probability(Descent::inside(tree, receiver).width_in(branch.node(), place, UNIT)),
            };
            let estimate = self.entries[j].emitter(tree).importance::<true>(&receiver);
            if within > 0.0 && estimate > 0.0 {
                let ratio = o.irradiance / (within * unit * estimate);
                self.entries[j].observe(ratio, o.visible, self.total / estimate, times);
                self.subcells
                    .observe(cube, j, Count::of(o), self.entries.len(), may_grow.cubes);
            }
            self.seen += times;
        }
        if let Some(directions) = &mut self.directions {
            directions.refresh();
        }
        if self.seen >= 2.0 * self.refined_at.max(8.0) {
            let old: Vec<Branch> = self.branches().collect();
            self.refine(tree);
            let new: Vec<Branch> = self.branches().collect();
            self.subcells.recut(tree, &old, &new);
            self.refined_at = self.seen;
            self.build(lights);
            self.subcells.refresh(&self.counts(), true);
            return;
        } else if self.seen >= REBUILD_GROWTH * self.built_at {
            self.build(lights);
        }
        self.subcells.refresh(&self.counts(), false);
    }

    /// Takes note of the share that each entry has in what is drawn at some of the points.
    fn look_up_shares(&mut self, observations: &[(&Observation, Cube)]) {
        let step = observations.len().div_ceil(SHARE_POINTS).max(1);
        for (o, cube) in observations.iter().step_by(step) {
            let view = View {
                receiver: &Receiver::from(&o.point),
                factors: self.subcells.factors(*cube),
                width: 1,
            };
            let Some(shares) = self.weights.shares(&view, self.entries.len()) else {
                continue;
            };
            for (entry, share) in self.entries.iter_mut().zip(shares) {
                entry.observe_share(share, o.weight as f32);
            }
        }
    }

    /// The learned weights.
    pub(super) fn weights(&self) -> &Weights {
        &self.weights
    }

    /// First light of each entry, in tree order.
    pub(super) fn firsts(&self) -> &[u32] {
        &self.firsts
    }

    /// See [`SubCells::factors_by_cube`].
    pub(super) fn factors_by_cube(&self) -> impl Iterator<Item = (u32, u32, Factors<'_>)> {
        self.subcells.factors_by_cube()
    }

    /// Where paths go on that leave from here; `None` if none did.
    pub(super) fn directions(&self) -> Option<&Directions> {
        self.directions.as_deref()
    }

    /// How many of its cubes anything was seen in.
    pub(super) fn cubes(&self) -> usize {
        self.subcells.len()
    }

    /// From how many of its places paths have gone on.
    pub(super) fn places(&self) -> usize {
        self.directions.as_ref().map_or(0, |directions| directions.len())
    }

    fn branches(&self) -> impl ExactSizeIterator<Item = Branch> {
        self.entries.iter().map(|entry| entry.branch)
    }

    fn counts(&self) -> Vec<Count> {
        self.entries.iter().map(|entry| entry.count).collect()
    }

    /// Whether it can be a cell of these `lights` after so many `frames`.
    pub(super) fn is_sound(&self, lights: Lights<'_>, frames: u64) -> bool {
        let tree = lights.tree;
        let mut next = 0;
        let in_order = |entry: &Entry| {
            let sound = entry.branch.is_in(tree) && entry.branch.first(tree) == next;
            next += if sound { entry.branch.count(tree) } else { 0 };
            sound && entry.is_sound()
        };
        let firsts = |entry: &Entry| entry.branch.first(tree);
        self.origin.level <= super::grid::MAX_LEVEL
            && self.origin.frame <= frames
            && (1..=PROBES).contains(&self.probes.len())
            && self.probes.iter().all(Receiver::is_sound)
            && (1..=MAX_ENTRIES).contains(&self.entries.len())
            && self.entries.iter().all(in_order)
            && next as usize == tree.len()
            && self.firsts.iter().copied().eq(self.entries.iter().map(firsts))
            && self.weights.is_sound(self.branches(), lights.palette.is_some())
            && self.subcells.is_sound(self.entries.len(), lights.palette.is_some())
            && self.directions.as_ref().is_none_or(|directions| directions.is_sound())
            && [self.seen, self.built_at, self.refined_at, self.total]
                .into_iter()
                .all(is_amount)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.firsts.capacity() * size_of::<u32>()
            + self.weights.bytes()
            + self.subcells.bytes()
            + self.directions.as_ref().map_or(0, |directions| directions.bytes())
            + self.probes.capacity() * size_of::<Receiver>()
    }

    /// Splits clusters that weigh much; merges parts that together weigh next to nothing and are hardly drawn, to make room.
    fn refine(&mut self, tree: &Tree) {
        let total: f32 = self.entries.iter().map(Entry::weight).sum();
        if total <= 0.0 {
            return;
        }
        let mut j = 0;
        while j < self.entries.len() {
            j = if self.merge_at(tree, j, total) {
                j.saturating_sub(MAX_LEAF_LIGHTS)
            } else {
                j + 1
            };
        }
        j = 0;
        while j < self.entries.len() && self.entries.len() + MAX_LEAF_LIGHTS <= MAX_ENTRIES {
            let entry = self.entries[j];
            if entry.weight() > SPLIT_SHARE * total && entry.branch.node().is_some() {
                self.divide(tree, j); // its parts are looked at next
            } else {
                j += 1;
            }
        }
    }

    /// Replaces the entries from `j` on by their parent if they are all of its parts and matter little. `total`: the weight of all.
    fn merge_at(&mut self, tree: &Tree, j: usize, total: f32) -> bool {
        if self.entries[j].share(total) >= MERGE_SHARE {
            return false;
        }
        let Some(parent) = self.entries[j].branch.parent(tree) else {
            return false;
        };
        let (branches, count) = parent.children(tree);
        let Some(parts) = self.entries.get(j..j + count) else {
            return false;
        };
        let share: f32 = parts.iter().map(|part| part.share(total)).sum();
        if share >= MERGE_SHARE || !parts.iter().map(|e| e.branch).eq(branches[..count].iter().copied()) {
            return false;
        }
        let weight: f32 = parts.iter().map(Entry::weight).sum();
        // What was seen of the parts says nothing of the parent's own second moment: it starts with their joint weight.
        let mut merged = self.unseen(tree, parent);
        if weight > 0.0 {
            merged.prior = weight / merged.scale.max(f32::MIN_POSITIVE);
        }
        self.entries.splice(j..j + count, [merged]);
        true
    }

    /// Makes the learned weights ready for use.
    fn build(&mut self, lights: Lights<'_>) {
        let Lights { tree, palette } = lights;
        self.built_at = self.seen;
        self.total = self.entries.iter().map(Entry::weight).sum();
        self.firsts.clear();
        self.firsts
            .extend(self.entries.iter().map(|entry| entry.branch.first(tree)));
        let weighed = self.entries.iter().map(|entry| Weighed {
            branch: entry.branch,
            emitter: entry.learned(tree),
            expected: palette.map_or(Vec3::ZERO, |palette| {
                palette.color(tree, entry.branch) * entry.mean_over_ratio()
            }),
        });
        let weighed: Vec<Weighed> = weighed.collect();
        self.weights = Weights::new(&weighed, palette.is_some());
    }
}

/// A cell as seen from one of its cubes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearby<'c> {
    cell: &'c Cell,
    cube: Cube,
    factors: Factors<'c>,
}

impl<'c> Nearby<'c> {
    /// The entry at position `x` of an interval of `width` (at most 2^52), as it is cut at a point; `None` if nothing
    /// arrives there.
    #[inline]
    pub(super) fn draw(&self, receiver: &Receiver, x: u64, width: u64) -> Option<Part> {
        self.find(receiver, Wanted::At(x), width)
    }

    /// Where paths go on that leave from here, if that is known.
    #[inline]
    pub(super) fn guide(&self) -> Option<&'c HemisphereGuide> {
        self.cell.directions.as_ref()?.guide(self.cube)
    }

    /// The same for several positions.
    #[inline]
    pub(super) fn draw_each(&self, receiver: &Receiver, wanted: &[Wanted], width: u64, parts: &mut [Option<Part>]) {
        let view = View {
            receiver,
            factors: self.factors,
            width,
        };
        self.cell.weights.find_each(&view, wanted, parts);
    }

    /// The entry that holds the light at `position` in tree order, and its part of the interval.
    #[inline]
    pub(super) fn part_of(&self, receiver: &Receiver, position: u32, width: u64) -> Option<Part> {
        self.find(receiver, Wanted::Entry(self.cell.entry_of(position)), width)
    }

    #[inline]
    fn find(&self, receiver: &Receiver, wanted: Wanted, width: u64) -> Option<Part> {
        let mut part = [None];
        self.draw_each(receiver, &[wanted], width, &mut part);
        part[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{mixed_lights, points};

    /// What was never visible but to a few points has next to no weight in the cell as a whole, and is kept apart by what it is at those.
    #[test]
    fn what_is_drawn_in_a_corner_of_the_cell_is_not_merged() {
        let tree = Tree::new(&mixed_lights(32, 3));
        let lights = Lights {
            tree: &tree,
            palette: None,
        };
        let origin = Origin {
            level: 0,
            primary: true,
            frame: 0,
        };
        let probes: Vec<Receiver> = points(64, 5).iter().map(Receiver::from).collect();
        let is_kept = |cornered: usize, share: f32| {
            let mut cell = Cell::new(origin, &probes, lights);
            let heaviest = cell.entries.iter().map(|entry| entry.scale).fold(0.0, f32::max);
            for (j, entry) in cell.entries.iter_mut().enumerate() {
                let times = if entry.scale == heaviest { 1.0 } else { 1e16 };
                entry.observe(0.0, false, 0.0, times);
                entry.observe_share(if j == cornered { share } else { 0.0 }, 100.0);
            }
            let branch = cell.entries[cornered].branch;
            cell.refine(&tree);
            cell.branches().any(|kept| kept == branch)
        };
        let merged: Vec<usize> = (1..24).filter(|&entry| !is_kept(entry, 0.0)).collect();
        assert!(merged.len() > 4, "{merged:?}");
        assert!(merged.iter().all(|&entry| is_kept(entry, 2.0 * MERGE_SHARE)));
    }
}

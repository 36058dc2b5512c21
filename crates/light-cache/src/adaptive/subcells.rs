//! Where in a cell a light is visible: the cell cut into cubes, and these into smaller ones, which share the cell's cut and
//! count visibility of their own.
//!
//! Ratios and the cut need many observations, so they are learned by the cell as a whole; shadows need resolution, and for
//! them a few observations of each entry in a cube are enough, with the visible share in the larger cube around it as the prior.

use super::branch::Branch;
use super::weights::{Factors, LANES, Lanes};
use crate::Observation;
use crate::state::is_amount;
use crate::tree::Tree;

/// Cubes of each layer along an edge of the cell: 2 to this power. Higher values follow finer shadows; lower values learn faster.
const LAYERS: [u32; 2] = [2, LEVELS];
/// The same for the smallest.
pub(super) const LEVELS: u32 = 4;
/// How many observations the share around a cube is worth in it.
const PRIOR_COUNT: f32 = 4.0;
/// Part of the prior that does not fade, as in the whole cell: what was not visible so far may still be, to few points.
const LASTING_PRIOR: f32 = 0.03;
/// With a control variate, by how much the squared weight of an entry that is certain to be visible is reduced. Where visibility V has mean
/// q, a draw without one brings V with a mean square of q, and with one V - q with a mean square of q (1 - q): higher values trust
/// that; lower values allow for all else that an entry's contribution varies by.
const CERTAINTY: f32 = 0.8;
/// Factors are made anew when the cube has seen this many times more than when they were last made.
const REBUILD_GROWTH: f32 = 1.15;
/// No cube yet.
const NONE: u16 = u16::MAX;

/// Which of the smallest cubes of its cell a point is in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cube([u16; 3]);

impl Cube {
    /// By whole numbers of cubes along the axes, of which the lowest bits count.
    #[inline]
    pub(super) fn at(position: [i32; 3]) -> Self {
        Self(position.map(|c| c as u16 & ((1 << LEVELS) - 1)))
    }

    /// Which cube of a layer that is in, if the layer has 2^`bits` along an edge.
    #[inline]
    pub(super) fn within(self, bits: u32) -> usize {
        let [x, y, z] = self.0.map(|c| usize::from(c >> (LEVELS - bits)));
        x | y << bits | z << (2 * bits)
    }
}

/// What was seen of one entry.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Count {
    /// Times drawn.
    pub(super) drawn: f32,
    /// Times drawn and visible.
    pub(super) visible: f32,
}

impl Count {
    /// What one observation says.
    pub(super) fn of(observation: &Observation) -> Self {
        let drawn = observation.weight as f32;
        let visible = if observation.visible { drawn } else { 0.0 };
        Self { drawn, visible }
    }

    /// Visible share, given what is expected.
    fn share(self, expected: f32) -> f32 {
        let n = self.drawn + PRIOR_COUNT;
        // The prior counts less the longer nothing is seen, as in `Entry::ratio`.
        let fade = PRIOR_COUNT / n + LASTING_PRIOR;
        (self.visible + PRIOR_COUNT * fade.min(1.0) * expected) / n
    }
}

/// One cube.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct SubCell {
    /// Number of the one around it in the layer before.
    around: u16,
    /// Of every entry of the cell's cut.
    counts: Vec<Count>,
    /// [`Factors::drawn`]; empty before anything is known.
    drawn: Vec<Lanes>,
    /// [`Factors::expected`]: visible share here over that in the whole cell.
    expected: Vec<Lanes>,
    seen: f32,
    built_at: f32,
}

impl SubCell {
    /// Takes note of draws of an entry.
    fn observe(&mut self, entry: usize, draws: Count) {
        let count = &mut self.counts[entry];
        count.drawn += draws.drawn;
        count.visible += draws.visible;
        self.seen += draws.drawn;
    }

    /// Makes the factors. `whole`: what the whole cell has seen of each entry; `around`: how much more or less the cube around this one
    /// expects of each, empty for 1; `certainty`: see [`CERTAINTY`], 0 without a control variate.
    fn build(&mut self, whole: &[Count], around: &[Lanes], certainty: f32) {
        self.built_at = self.seen;
        let rows = whole.len().div_ceil(LANES);
        for factors in [&mut self.drawn, &mut self.expected] {
            factors.clear();
            factors.resize(rows, [1.0; LANES]);
        }
        for (entry, (own, whole)) in self.counts.iter().zip(whole).enumerate() {
            // As if it had been visible once in half as many draws more: never 0.
            let share = (whole.visible + 0.5) / (whole.drawn + 1.0);
            let (row, lane) = (entry % rows, entry / rows);
            let around = around.get(row).map_or(1.0, |row| row[lane]);
            let own = own.share(share * around);
            self.expected[row][lane] = own / share;
            self.drawn[row][lane] = (own / share * (1.0 - certainty * own.min(1.0))).sqrt();
        }
    }

    #[inline]
    fn factors(&self) -> Factors<'_> {
        Factors {
            drawn: &self.drawn,
            expected: &self.expected,
        }
    }

    /// Whether it can be one of a cut into so many `entries`, with so many cubes in the layer `before`.
    fn is_sound(&self, entries: usize, before: usize) -> bool {
        let rows = entries.div_ceil(LANES);
        let factors = [&self.drawn, &self.expected];
        (self.around == NONE) == (before == 0)
            && (before == 0 || usize::from(self.around) < before)
            && self.counts.len() == entries
            && self
                .counts
                .iter()
                .all(|count| is_amount(count.drawn) && is_amount(count.visible))
            && (factors.iter().all(|lanes| lanes.is_empty()) || factors.iter().all(|lanes| lanes.len() == rows))
            && factors
                .iter()
                .all(|lanes| lanes.as_flattened().iter().copied().all(is_amount))
            && is_amount(self.seen)
            && is_amount(self.built_at)
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.counts.capacity() * size_of::<Count>()
            + (self.drawn.capacity() + self.expected.capacity()) * size_of::<Lanes>()
    }
}

/// All cubes of one size in which anything was seen.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Layer {
    /// Number of each cube's [`SubCell`].
    numbers: Vec<u16>,
    subcells: Vec<SubCell>,
}

/// All cubes of a cell in which anything was seen.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct SubCells {
    /// Largest first.
    layers: [Layer; LAYERS.len()],
    certainty: f32,
}

impl SubCells {
    /// None yet; `controlled`: for a control variate.
    pub(super) fn new(controlled: bool) -> Self {
        let layer = |bits| Layer {
            numbers: vec![NONE; 1_usize << (3 * bits)],
            subcells: Vec::new(),
        };
        Self {
            layers: LAYERS.map(layer),
            certainty: if controlled { CERTAINTY } else { 0.0 },
        }
    }

    /// How many of the smallest cubes there are.
    pub(super) fn len(&self) -> usize {
        self.layers[LAYERS.len() - 1].subcells.len()
    }

    /// By what a cube differs from the cell.
    #[inline]
    pub(super) fn factors(&self, cube: Cube) -> Factors<'_> {
        for (layer, bits) in self.layers.iter().zip(LAYERS).rev() {
            if let Some(subcell) = layer.subcells.get(usize::from(layer.numbers[cube.within(bits)])) {
                return subcell.factors();
            }
        }
        Factors::default()
    }

    /// All factors, each with the number of its cube in its layer; bit 12 is set for the smallest cubes.
    pub(super) fn factors_by_cube(&self) -> impl Iterator<Item = (u32, Factors<'_>)> {
        self.layers.iter().zip([0, 1 << 12]).flat_map(|(layer, bit)| {
            let numbered = (0..).zip(&layer.numbers);
            numbered.filter_map(move |(cube, &number)| {
                let subcell = layer.subcells.get(usize::from(number))?;
                (!subcell.drawn.is_empty()).then(|| (bit | cube, subcell.factors()))
            })
        })
    }

    /// Takes note of draws of an entry, one of `entries`. Cubes are made where they are missing, if they `may_grow` in number.
    pub(super) fn observe(&mut self, cube: Cube, entry: usize, draws: Count, entries: usize, may_grow: bool) {
        let mut around = NONE;
        for (layer, bits) in self.layers.iter_mut().zip(LAYERS) {
            let number = &mut layer.numbers[cube.within(bits)];
            if *number == NONE {
                if !may_grow {
                    return;
                }
                *number = layer.subcells.len() as u16;
                layer.subcells.push(SubCell {
                    around,
                    counts: vec![Count::default(); entries],
                    drawn: Vec::new(),
                    expected: Vec::new(),
                    seen: 0.0,
                    built_at: 0.0,
                });
            }
            around = *number;
            layer.subcells[usize::from(around)].observe(entry, draws);
        }
    }

    /// Makes the factors of the cubes that have seen enough that is new, or of `all`. `whole`: what the whole cell has seen of each entry.
    pub(super) fn refresh(&mut self, whole: &[Count], all: bool) {
        let mut before: &[SubCell] = &[];
        for layer in &mut self.layers {
            for subcell in &mut layer.subcells {
                if all || subcell.seen >= REBUILD_GROWTH * subcell.built_at {
                    let around = before.get(usize::from(subcell.around));
                    subcell.build(whole, around.map_or(&[], |subcell| &subcell.expected), self.certainty);
                }
            }
            before = &layer.subcells;
        }
    }

    /// The cell has another cut: what was seen of the old entries is dealt out to the new ones, by the number of lights.
    pub(super) fn recut(&mut self, tree: &Tree, old: &[Branch], new: &[Branch]) {
        let overlaps = overlaps(tree, old, new);
        for subcell in self.layers.iter_mut().flat_map(|layer| &mut layer.subcells) {
            let mut counts = vec![Count::default(); new.len()];
            for &(from, to, share) in &overlaps {
                let seen = subcell.counts[from as usize];
                counts[to as usize].drawn += share * seen.drawn;
                counts[to as usize].visible += share * seen.visible;
            }
            subcell.counts = counts;
        }
    }

    /// Whether these can be the cubes of a cell with a cut into so many `entries`.
    pub(super) fn is_sound(&self, entries: usize, controlled: bool) -> bool {
        let mut before = 0;
        let mut sound = |(layer, bits): (&Layer, u32)| {
            let count = layer.subcells.len();
            let numbered = |&number: &u16| number == NONE || usize::from(number) < count;
            let sound = layer.numbers.len() == 1 << (3 * bits)
                && layer.numbers.iter().all(numbered)
                && layer.subcells.iter().all(|subcell| subcell.is_sound(entries, before));
            before = count;
            sound
        };
        self.certainty == Self::new(controlled).certainty && self.layers.iter().zip(LAYERS).all(&mut sound)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let of =
            |layer: &Layer| size_of_val(&layer.numbers[..]) + layer.subcells.iter().map(SubCell::bytes).sum::<usize>();
        self.layers.iter().map(of).sum()
    }
}

/// Which old entry has lights in common with which new one, and which share of the old one's lights that is. Both cuts are in tree
/// order and hold the same lights.
fn overlaps(tree: &Tree, old: &[Branch], new: &[Branch]) -> Vec<(u32, u32, f32)> {
    let range = |branch: Branch| {
        let first = branch.first(tree);
        first..first + branch.count(tree)
    };
    let mut found = Vec::with_capacity(old.len().max(new.len()));
    let mut from = 0;
    for (to, branch) in (0..).zip(new) {
        let wanted = range(*branch);
        while let Some(lights) = old.get(from).map(|branch| range(*branch)) {
            let common = lights
                .end
                .min(wanted.end)
                .saturating_sub(lights.start.max(wanted.start));
            if common > 0 {
                found.push((from as u32, to, common as f32 / lights.len() as f32));
            }
            if lights.end > wanted.end {
                break;
            }
            from += 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mixed_lights;

    fn whole(entries: usize) -> Vec<Count> {
        vec![
            Count {
                drawn: 200.0,
                visible: 100.0
            };
            entries
        ]
    }

    #[test]
    fn cubes_are_told_apart_and_believe_what_is_around_them() {
        let mut subcells = SubCells::new(false);
        let (lit, dark) = (Cube::at([0, 3, 12]), Cube::at([-1, 3, 12]));
        for (cube, visible) in [(lit, 1.0), (dark, 0.0)] {
            for _ in 0..50 {
                let draws = Count {
                    drawn: 2.0,
                    visible: 2.0 * visible,
                };
                subcells.observe(cube, 17, draws, 20, true);
            }
        }
        subcells.refresh(&whole(20), false);
        // 20 entries in two rows.
        let factor = |cube: Cube, entry: usize| subcells.factors(cube).drawn[entry % 2][entry / 2];
        assert!(subcells.factors(Cube::at([6, 6, 6])).drawn.is_empty());
        assert!((factor(Cube::at([16, 3, -4]), 17) - 2.0_f32.sqrt()).abs() < 0.05);
        assert!(factor(dark, 17) < 0.1 && factor(dark, 17) > 0.0);
        assert!((factor(dark, 3) - 1.0).abs() < 0.1);
        // In the larger cube around, not in the small one.
        assert!(factor(Cube::at([3, 0, 13]), 17) > 1.3 && factor(Cube::at([13, 0, 13]), 17) < 0.2);
    }

    #[test]
    fn a_new_cut_keeps_what_was_seen() {
        let tree = Tree::new(&mixed_lights(200, 3));
        let (halves, _) = Branch::ROOT.children(&tree);
        let coarse = vec![halves[0], halves[1], Branch::DISTANT];
        let (parts, count) = coarse[0].children(&tree);
        let mut fine = parts[..count].to_vec();
        fine.extend(&coarse[1..]);
        let mut subcells = SubCells::new(false);
        for entry in [0, 0, 1] {
            let draw = Count {
                drawn: 1.0,
                visible: 1.0,
            };
            subcells.observe(Cube::at([1, 2, 3]), entry, draw, 3, true);
        }
        let drawn = |subcells: &SubCells| {
            let of = |layer: &Layer| layer.subcells[0].counts.iter().map(|c| c.drawn).collect::<Vec<_>>();
            let [a, b] = [of(&subcells.layers[0]), of(&subcells.layers[1])];
            assert_eq!(a, b);
            a
        };
        subcells.recut(&tree, &coarse, &fine);
        let now = drawn(&subcells);
        assert_eq!((now.len(), now[count], now[count + 1]), (count + 2, 1.0, 0.0));
        assert!((now[..count].iter().sum::<f32>() - 2.0).abs() < 1e-5 && now[..count].iter().all(|&n| n > 0.0));
        subcells.recut(&tree, &fine, &coarse);
        assert!(
            drawn(&subcells)
                .iter()
                .zip([2.0, 1.0, 0.0])
                .all(|(a, b)| (a - b).abs() < 1e-5)
        );
    }
}

//! Where in a cell a light is visible: the cell cut into cubes, and these into smaller ones, which share the cell's cut and
//! count visibility of their own.
//!
//! Ratios and the cut need many observations, so they are learned by the cell as a whole; shadows need resolution, and for
//! them a few observations of each entry in a cube are enough, with the visible share in the larger cube around it as the prior,
//! and with what the cubes beside it have seen for as long as it has seen little itself.

use super::branch::Branch;
use super::cube::{Cube, LEVELS};
use super::subcell::{Count, NONE, SubCell};
use super::weights::Factors;
use crate::tree::Tree;

/// Cubes of the layers along an edge of the cell: 2 to this power, largest cubes first. Higher values follow finer shadows; lower values
/// learn faster.
pub(super) const LAYERS: [u32; 3] = [LARGE_LAYER, MIDDLE_LAYER, LEVELS];
const LARGE_LAYER: u32 = 2;
const MIDDLE_LAYER: u32 = 4;
/// How many observations a cube of each layer needs around it before it is made. Higher values save time and memory while little is known;
/// lower values follow fine shadows sooner.
const SEEN_BEFORE: [f32; LAYERS.len()] = [0.0, 0.0, 64.0];
/// Part of what the six cubes beside a cube have seen that counts in it too. Higher values learn faster; lower values keep the borders of shadows.
const BESIDE_SHARE: f32 = 0.5;
/// How many observations of an entry that is worth at most: the same trade.
const BESIDE_COUNT: f32 = 8.0;
/// With a control variate, by how much the squared weight of an entry that is certain to be visible is reduced. Where visibility V has mean
/// q, a draw without one brings V with a mean square of q, and with one V - q with a mean square of q (1 - q): higher values trust
/// that; lower values allow for all else that an entry's contribution varies by.
const CERTAINTY: f32 = 0.8;

/// All cubes of one size in which anything was seen.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Layer {
    /// Number of the [`SubCell`] of each part of the cubes of the layer before, cube by cube.
    numbers: Vec<u16>,
    subcells: Vec<SubCell>,
}

impl Layer {
    /// The cube that holds `place` in the cube number `around` of the layer before; `None` if nothing was seen there. `bits`, `step`: see [`LAYERS`] and [`steps`].
    #[inline]
    fn find(&self, around: usize, place: Cube, bits: u32, step: u32) -> Option<usize> {
        let number = self.numbers[around << (3 * step) | place.part(bits, step)];
        (number != NONE).then_some(usize::from(number))
    }
}

/// Of each layer its power of two, and how much higher that is than that of the layer before.
#[inline]
fn steps() -> impl Iterator<Item = (u32, u32)> {
    let before = [0].into_iter().chain(LAYERS);
    LAYERS
        .into_iter()
        .zip(before)
        .map(|(bits, before)| (bits, bits - before))
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
            // Of the largest cubes the cell itself is what is around them.
            numbers: if bits == LAYERS[0] {
                vec![NONE; 1_usize << (3 * bits)]
            } else {
                Vec::new()
            },
            subcells: Vec::new(),
        };
        Self {
            layers: LAYERS.map(layer),
            certainty: if controlled { CERTAINTY } else { 0.0 },
        }
    }

    /// How many cubes there are, of all sizes.
    pub(super) fn len(&self) -> usize {
        self.layers.iter().map(|layer| layer.subcells.len()).sum()
    }

    /// By what a cube differs from the cell.
    #[inline]
    pub(super) fn factors(&self, cube: Cube) -> Factors<'_> {
        let mut smallest = None;
        let mut around = 0;
        for (layer, (bits, step)) in self.layers.iter().zip(steps()) {
            let Some(number) = layer.find(around, cube, bits, step) else {
                break;
            };
            smallest = Some(&layer.subcells[number]);
            around = number;
        }
        smallest.map_or_else(Factors::default, SubCell::factors)
    }

    /// All factors, each with the number of its layer and that of its cube in the layer.
    pub(super) fn factors_by_cube(&self) -> impl Iterator<Item = (u32, u32, Factors<'_>)> {
        (0..)
            .zip(self.layers.iter().zip(LAYERS))
            .flat_map(|(number, (layer, bits))| {
                let built = layer.subcells.iter().filter(|subcell| !subcell.drawn.is_empty());
                built.map(move |subcell| (number, subcell.place.within(bits) as u32, subcell.factors()))
            })
    }

    /// Takes note of draws of an entry, one of `entries`. Cubes are made where they are missing in as many layers as `may_grow`, each once [enough](SEEN_BEFORE) was seen around it.
    pub(super) fn observe(&mut self, cube: Cube, entry: usize, draws: Count, entries: usize, may_grow: usize) {
        let (mut around, mut seen_around) = (NONE, 0.0);
        for (index, (bits, step)) in steps().enumerate() {
            let (layer, finer) = self.layers[index..]
                .split_first_mut()
                .expect("there are as many layers as steps");
            let whole = if index == 0 { 0 } else { usize::from(around) };
            let number = &mut layer.numbers[whole << (3 * step) | cube.part(bits, step)];
            if *number == NONE {
                if index >= may_grow || seen_around < SEEN_BEFORE[index] {
                    return;
                }
                *number = layer.subcells.len() as u16;
                layer.subcells.push(SubCell::new(around, cube, entries));
                if let (Some(finer), Some((_, step))) = (finer.first_mut(), steps().nth(index + 1)) {
                    finer.numbers.resize(layer.subcells.len() << (3 * step), NONE);
                }
            }
            around = *number;
            let subcell = &mut layer.subcells[usize::from(around)];
            subcell.observe(entry, draws);
            seen_around = subcell.seen();
        }
    }

    /// Makes the factors of the cubes that have seen enough that is new, or of `all`. `whole`: what the whole cell has seen of each entry.
    pub(super) fn refresh(&mut self, whole: &[Count], all: bool) {
        for index in 0..LAYERS.len() {
            for number in 0..self.layers[index].subcells.len() {
                let subcell = &self.layers[index].subcells[number];
                if all || subcell.is_due() {
                    let counts = self.counts(index, subcell);
                    let (before, rest) = self.layers.split_at_mut(index);
                    let subcell = &mut rest[0].subcells[number];
                    let around = before.last().map(|layer| &layer.subcells[usize::from(subcell.around)]);
                    subcell.build(
                        &counts,
                        whole,
                        around.map_or(&[], |subcell| &subcell.expected),
                        self.certainty,
                    );
                }
            }
        }
    }

    /// What was seen of each entry in a cube of layer `index`, with a part of what was seen beside it.
    fn counts(&self, index: usize, subcell: &SubCell) -> Vec<Count> {
        let mut beside = vec![Count::default(); subcell.counts.len()];
        for place in subcell.place.beside(LAYERS[index]) {
            if let Some(other) = self.find(index, place) {
                for (sum, seen) in beside.iter_mut().zip(&other.counts) {
                    sum.drawn += seen.drawn;
                    sum.visible += seen.visible;
                }
            }
        }
        let both = subcell.counts.iter().zip(&beside).map(|(own, beside)| {
            let share = BESIDE_SHARE.min(BESIDE_COUNT / beside.drawn.max(1.0));
            Count {
                drawn: own.drawn + share * beside.drawn,
                visible: own.visible + share * beside.visible,
            }
        });
        both.collect()
    }

    /// The cube of layer `index` that holds `place`.
    fn find(&self, index: usize, place: Cube) -> Option<&SubCell> {
        let mut around = 0;
        for (layer, (bits, step)) in self.layers[..=index].iter().zip(steps()) {
            around = layer.find(around, place, bits, step)?;
        }
        self.layers[index].subcells.get(around)
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
        let mut before = None;
        let mut sound = |(layer, (_, step)): (&Layer, (u32, u32))| {
            let count = layer.subcells.len();
            let numbered = |&number: &u16| number == NONE || usize::from(number) < count;
            let sound = layer.numbers.len() == before.unwrap_or(1) << (3 * step)
                && layer.numbers.iter().all(numbered)
                && layer.subcells.iter().all(|subcell| subcell.is_sound(entries, before));
            before = Some(count);
            sound
        };
        self.certainty == Self::new(controlled).certainty && self.layers.iter().zip(steps()).all(&mut sound)
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

    /// So that cubes of all layers are made at once.
    const ENOUGH: Count = Count {
        drawn: SEEN_BEFORE[2],
        visible: SEEN_BEFORE[2],
    };

    fn whole(entries: usize) -> Vec<Count> {
        vec![
            Count {
                drawn: 200.0,
                visible: 100.0
            };
            entries
        ]
    }

    fn see(subcells: &mut SubCells, cube: Cube, entry: usize, times: u32, visible: f32) {
        for _ in 0..times {
            let draws = Count {
                drawn: 2.0,
                visible: 2.0 * visible,
            };
            subcells.observe(cube, entry, draws, 20, LAYERS.len());
        }
    }

    /// Of one of 20 entries, which lie in two rows.
    fn factor(subcells: &SubCells, cube: Cube, entry: usize) -> f32 {
        subcells.factors(cube).drawn[entry % 2][entry / 2]
    }

    #[test]
    fn cubes_are_told_apart_and_believe_what_is_around_them() {
        let mut subcells = SubCells::new(false);
        let (lit, dark) = (Cube::at([0, 6, 24]), Cube::at([-1, 6, 24]));
        for (cube, visible) in [(lit, 1.0), (dark, 0.0)] {
            see(&mut subcells, cube, 17, 200, visible);
        }
        subcells.refresh(&whole(20), false);
        assert!(subcells.factors(Cube::at([12, 12, 12])).drawn.is_empty());
        assert!((factor(&subcells, Cube::at([32, 6, -8]), 17) - 2.0_f32.sqrt()).abs() < 0.05);
        assert!(factor(&subcells, dark, 17) < 0.1 && factor(&subcells, dark, 17) > 0.0);
        assert!((factor(&subcells, dark, 3) - 1.0).abs() < 0.1);
        // In the larger cube around, not in the small one.
        assert!(factor(&subcells, Cube::at([6, 0, 26]), 17) > 1.3);
        assert!(factor(&subcells, Cube::at([26, 0, 26]), 17) < 0.2);
        assert_eq!(subcells.len(), 6);
    }

    #[test]
    fn a_cube_that_has_seen_little_believes_those_beside_it() {
        let mut subcells = SubCells::new(false);
        let border = 15;
        for x in [border - 1, border, border + 1] {
            // Light falls on one side of the border, in another large cube.
            let visible = if x > border { 1.0 } else { 0.0 };
            see(
                &mut subcells,
                Cube::at([x, 6, 24]),
                17,
                if x == border { 2 } else { 60 },
                visible,
            );
        }
        see(&mut subcells, Cube::at([7, 6, 24]), 17, 60, 0.0);
        subcells.refresh(&whole(20), false);
        let factor = |x: i32| factor(&subcells, Cube::at([x, 6, 24]), 17);
        assert!(factor(border + 1) > 1.3 && factor(border - 1) < 0.2 && factor(7) < 0.2);
        assert!((0.5..0.9).contains(&factor(border)), "{}", factor(border));
    }

    #[test]
    fn no_smaller_cubes_are_made_than_may_be() {
        let mut subcells = SubCells::new(false);
        for (layers, cubes) in [(0, 0), (2, 2), (0, 2), (LAYERS.len(), 3)] {
            subcells.observe(Cube::at([1, 2, 3]), 0, ENOUGH, 1, layers);
            assert_eq!(subcells.len(), cubes);
            assert!(subcells.is_sound(1, false) && subcells.is_sound(2, false) == (cubes == 0));
        }
    }

    #[test]
    fn the_smallest_cubes_wait_until_enough_was_seen_around_them() {
        let mut subcells = SubCells::new(false);
        for (drawn, cubes) in [(SEEN_BEFORE[2] - 1.0, 2), (1.0, 3)] {
            let draws = Count { drawn, visible: 0.0 };
            subcells.observe(Cube::at([1, 2, 3]), 0, draws, 1, LAYERS.len());
            assert_eq!(subcells.len(), cubes);
        }
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
            subcells.observe(Cube::at([1, 2, 3]), entry, ENOUGH, 3, LAYERS.len());
        }
        let drawn = |subcells: &SubCells| {
            let of = |layer: &Layer| layer.subcells[0].counts.iter().map(|c| c.drawn).collect::<Vec<_>>();
            let [a, b, c] = subcells.layers.each_ref().map(of);
            assert!(a == b && b == c);
            a
        };
        subcells.recut(&tree, &coarse, &fine);
        let now = drawn(&subcells);
        assert_eq!((now.len(), now[count], now[count + 1]), (count + 2, ENOUGH.drawn, 0.0));
        assert!(
            (now[..count].iter().sum::<f32>() - 2.0 * ENOUGH.drawn).abs() < 1e-3
                && now[..count].iter().all(|&n| n > 0.0)
        );
        subcells.recut(&tree, &fine, &coarse);
        assert!(
            drawn(&subcells)
                .iter()
                .zip([2.0, 1.0, 0.0])
                .all(|(a, b)| (a - b * ENOUGH.drawn).abs() < 1e-3)
        );
    }
}

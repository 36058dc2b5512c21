//! The learned cuts as words: what `shaders/light_cache/adaptive.wgsl` draws from.

use super::AdaptiveSampler;
use super::cell::Cell;
use super::directions::Directions;
use crate::packed::{self, Packed, Scheme, align};
use crate::{LightSampler, TableSampler};
use sampling::HemisphereGuide;

/// Words of the header; the tree's are the first.
const HEADER: usize = 25;
/// Where in the header the global table begins, the grid, the cells, and the unit of their weights.
const TABLE: usize = packed::TREE_HEADER;
const GRID: usize = TABLE + 3;
const CELLS: usize = GRID + 10;
const UNIT: usize = CELLS + 3;

/// No such thing.
const NONE: u32 = u32::MAX;

/// What is kept for a cube: factors, by the number of their layer, or a guide.
const GUIDE: u32 = 3;

/// The factors of one cube, or its guide: key, and where they are.
type CubeSlot = [u32; 2];

impl AdaptiveSampler {
    /// See [`LightSampler::pack`].
    pub(super) fn packed(&self) -> Option<Packed> {
        let mut words = vec![0; HEADER];
        packed::pack_tree(self.tree(), 0, &mut words);
        let [primary, secondary] = self.table.pack_distributions(&mut words)?;
        words[TABLE..TABLE + 3].copy_from_slice(&[primary, secondary, self.table_mass]);
        let grid = self.cells.grid().pack(&mut words);
        words[GRID..GRID + 10].copy_from_slice(&grid);
        let mut cubes = Vec::new();
        let records: Vec<[u32; 8]> = (0..)
            .zip(self.cells.all())
            .map(|(number, cell)| pack_cell(number, cell, &mut words, &mut cubes))
            .collect();
        let cells = align(&mut words);
        words.extend(records.iter().flatten());
        let (table, bits) = pack_cubes(&cubes, &mut words);
        words[CELLS..UNIT].copy_from_slice(&[cells, table, bits]);
        words[UNIT] = self.cells.unit().to_bits();
        // Positions of words are 32-bit numbers.
        u32::try_from(words.len()).ok()?;
        Some(Packed {
            scheme: Scheme::Adaptive,
            words,
        })
    }
}

/// Appends the cut of a cell, its factors and its guides; returns its record.
fn pack_cell(number: u32, cell: &Cell, words: &mut Vec<u32>, cubes: &mut Vec<CubeSlot>) -> [u32; 8] {
    let count = cell.entries.len();
    let entries = align(words);
    for (branch, e) in cell.weights().entries(count) {
        let ball = [e.center.extend(e.radius), e.axis.extend(e.depth)];
        words.extend(ball.iter().flat_map(|v| v.to_array()).map(f32::to_bits));
        let shape = [
            e.quarter_inverse_radius,
            e.quarter_inverse_depth,
            e.one_sided,
            e.isotropic,
        ];
        words.extend(shape.map(f32::to_bits));
        words.extend([e.weight.to_bits(), e.everywhere.to_bits(), branch.bits(), 0]);
    }
    let mut attenuations = NONE;
    if cell.weights().is_attenuated() {
        attenuations = words.len() as u32;
        for (_, e) in cell.weights().entries(count) {
            words.extend([e.cone_scale, e.cone_offset, e.inverse_range_sq, 0.0].map(f32::to_bits));
        }
    }
    let mut expected = NONE;
    if cell.weights().is_controlled() {
        expected = align(words);
        for per_weight in cell.weights().expected(count) {
            words.extend(per_weight.extend(0.0).to_array().map(f32::to_bits));
        }
    }
    let firsts = words.len() as u32;
    words.extend(cell.firsts());
    for (layer, cube, factors) in cell.factors_by_cube() {
        cubes.push([key(number, layer, cube), words.len() as u32]);
        for lanes in [factors.drawn, factors.expected] {
            let rows = lanes.len();
            words.extend((0..count).map(|entry| lanes[entry % rows][entry / rows].to_bits()));
        }
    }
    let guide = match cell.directions() {
        Some(directions) => pack_guides(number, directions, words, cubes),
        None => NONE,
    };
    [count as u32, entries, attenuations, firsts, expected, guide, 0, 0]
}

/// Of what is kept for a cube of a cell. There are fewer than 2^14 cells, and 2^15 cubes in the finest layer.
fn key(cell: u32, kind: u32, cube: u32) -> u32 {
    cell << 17 | kind << 15 | cube
}

/// Appends the guides of a cell; returns where that of the whole cell is.
fn pack_guides(number: u32, directions: &Directions, words: &mut Vec<u32>, cubes: &mut Vec<CubeSlot>) -> u32 {
    let mut pack = |guide: &HemisphereGuide| {
        let at = align(words);
        words.extend(guide.starts().map(f32::to_bits));
        at
    };
    for (cube, guide) in directions.of_places() {
        cubes.push([key(number, GUIDE, cube), pack(guide)]);
    }
    directions.of_whole_cell().map_or(NONE, pack)
}

/// Appends a hash table, at most half full; returns where it is and the binary logarithm of its size.
fn pack_cubes(cubes: &[CubeSlot], words: &mut Vec<u32>) -> (u32, u32) {
    let size = (2 * cubes.len()).next_power_of_two().max(16);
    let bits = size.trailing_zeros();
    let mut slots = vec![[NONE, 0]; size];
    for cube in cubes {
        let mut at = (cube[0].wrapping_mul(0x9e37_79b9) >> (32 - bits)) as usize;
        while slots[at][0] != NONE {
            at = (at + 1) & (size - 1);
        }
        slots[at] = *cube;
    }
    let table = words.len() as u32;
    words.extend(slots.iter().flatten());
    (table, bits)
}

impl TableSampler {
    /// Appends the distributions for first and for later hits; returns where they are.
    pub(crate) fn pack_distributions(&self, words: &mut Vec<u32>) -> Option<[u32; 2]> {
        let packed = self.pack()?.words;
        // Their positions are counted from where the table begins.
        let start = words.len() as u32;
        words.extend(&packed);
        let at = [packed[0], packed[1]].map(|at| at + start);
        let mut moved = at.to_vec();
        moved.dedup();
        for at in moved {
            for position in [at + 3, at + 4] {
                words[position as usize] += start;
            }
        }
        Some(at)
    }
}

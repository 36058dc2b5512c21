//! All cells: which observation belongs to which, and making them.

use super::cell::{Cell, Lights, MayGrow, Nearby, Origin};
use super::cube::Cube;
use super::entry::Entry;
use super::grid::{Grid, NO_CELL, Spot, dominant_axis};
use super::subcells;
use crate::tree::{Receiver, Tree};
use crate::{CellRecord, Observation, ShadingPoint};
use glam::Vec3;
use rayon::prelude::*;

/// Most cells; points beyond are served by the tree.
const MAX_CELLS: usize = 1 << 14;
/// No cubes are added when there are more than this in all, and no smallest ones when there are more than half as many: places without know no more
/// than what is around them.
const MAX_CUBES: usize = 1 << 17;
const SMALLEST_CUBES: usize = MAX_CUBES / 2;

/// The same for places that paths go on from.
const MAX_PLACES: usize = 1 << 15;

/// The cells and the grid that finds them.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Cells {
    grid: Grid,
    cells: Vec<Cell>,
    /// Luminance of the irradiance that is 1 in the tree's importance.
    unit: f32,
}

impl Cells {
    /// No cells yet, for a scene in the given sphere.
    pub(super) fn new(center_ws: Vec3, radius: f32, unit: f32) -> Self {
        Self {
            grid: Grid::new(center_ws, radius),
            cells: Vec::new(),
            unit,
        }
    }

    /// Luminance of the irradiance that is 1 in the units of weights.
    #[inline]
    pub(super) fn unit(&self) -> f32 {
        self.unit
    }

    /// What finds the cells.
    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The cells, by number.
    pub(super) fn all(&self) -> &[Cell] {
        &self.cells
    }

    /// Number of cells.
    pub(super) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.grid.bytes() + self.cells.iter().map(Cell::bytes).sum::<usize>()
    }

    /// New cells are made finer near this point.
    pub(super) fn set_eye(&mut self, eye_ws: Vec3) {
        self.grid.set_eye(eye_ws);
    }

    /// What is known around `point`, if anything is.
    #[inline]
    pub(super) fn at(&self, point: &ShadingPoint) -> Option<Nearby<'_>> {
        let spot = self.grid.locate(point);
        let cell = self.cells.get(self.grid.find(spot.key) as usize)?;
        Some(cell.around(spot.cube))
    }

    /// Whether they can be what others of the same `lights` have become in so many `frames`.
    pub(super) fn is_sound_like(&self, other: &Self, lights: Lights<'_>, frames: u64) -> bool {
        self.cells.len() <= MAX_CELLS
            && self.unit == other.unit
            && self.grid.is_sound_like(&other.grid, self.cells.len())
            && self.cells.par_iter().all(|cell| cell.is_sound(lights, frames))
    }

    /// The number of the cell of `point`, if there is one.
    pub(super) fn number_at(&self, point: &ShadingPoint) -> Option<u64> {
        let number = self.grid.find(self.grid.locate(point).key);
        (number != NO_CELL).then_some(number.into())
    }

    /// What is known in each cell that is in use; `frame` is the number of frames done.
    pub(super) fn records(&self, tree: &Tree, frame: u64) -> Vec<CellRecord> {
        let numbered = (0..).zip(&self.cells);
        numbered
            .flat_map(|(number, cell)| {
                let probe = cell.probes[0];
                let (center_ws, size_m) = self.grid.bounds(probe.position, cell.origin.level);
                let total: f32 = cell.entries.iter().map(Entry::weight).sum();
                cell.entries.iter().map(move |entry| CellRecord {
                    cell: number,
                    x_m: center_ws.x,
                    y_m: center_ws.y,
                    z_m: center_ws.z,
                    size_m,
                    normal: ["+x", "-x", "+y", "-y", "+z", "-z"][dominant_axis(probe.normal) as usize],
                    primary: cell.origin.primary,
                    light: tree.light_at(entry.branch.first(tree)),
                    lights: entry.branch.count(tree),
                    probability: f64::from(entry.weight()) / f64::from(total.max(f32::MIN_POSITIVE)),
                    visible_fraction: (entry.count.drawn > 0.0)
                        .then(|| f64::from(entry.count.visible / entry.count.drawn)),
                    samples: entry.count.drawn as u64,
                    age: frame - cell.origin.frame,
                })
            })
            .collect()
    }

    /// The cell and the cube of each observation, new cells made where they are missing. Runs through the logs in order, so cells
    /// are numbered alike on any number of threads.
    fn assign(&mut self, lights: Lights<'_>, frame: u64, logs: &[Vec<Observation>]) -> Vec<(u32, Cube)> {
        let known = self.cells.len();
        let mut seeds: Vec<Seed> = Vec::new();
        let grid = &self.grid;
        let spots: Vec<Vec<(Spot, u32)>> = logs
            .par_iter()
            .map(|log| {
                let spots = log.iter().map(|o| grid.locate(&o.point));
                spots.map(|spot| (spot, grid.find(spot.key))).collect()
            })
            .collect();
        let assigned = logs
            .iter()
            .flatten()
            .zip(spots.iter().flatten())
            .map(|(o, &(spot, mut cell))| {
                if cell == NO_CELL {
                    // An observation before may have asked for the same cell.
                    cell = self.grid.find(spot.key);
                    if cell == NO_CELL && known + seeds.len() < MAX_CELLS {
                        cell = (known + seeds.len()) as u32;
                        self.grid.insert(spot.key, cell);
                        let origin = Origin {
                            level: spot.level,
                            primary: o.point.primary,
                            frame,
                        };
                        seeds.push((origin, Vec::new()));
                    }
                }
                if let Some((_, points)) = (cell as usize).checked_sub(known).and_then(|new| seeds.get_mut(new)) {
                    points.push(Receiver::from(&o.point));
                }
                (cell, spot.cube)
            })
            .collect();
        let new = seeds
            .par_iter()
            .map(|(origin, points)| Cell::new(*origin, points, lights));
        let new: Vec<Cell> = new.collect();
        self.cells.extend(new);
        assigned
    }

    /// Every cell learns from its own observations, in the order in which they were made.
    pub(super) fn learn(&mut self, lights: Lights<'_>, frame: u64, logs: &[Vec<Observation>]) {
        let assigned = self.assign(lights, frame, logs);
        let mut ends = vec![0u32; self.cells.len() + 1];
        for &(cell, _) in assigned.iter().filter(|(cell, _)| *cell != NO_CELL) {
            ends[cell as usize + 1] += 1;
        }
        for i in 1..ends.len() {
            ends[i] += ends[i - 1];
        }
        let starts = ends.clone();
        let mut by_cell: Vec<Option<(&Observation, Cube)>> = vec![None; assigned.len()];
        let observed = logs.iter().flatten().zip(&assigned);
        for (o, &(cell, cube)) in observed.filter(|(_, (cell, _))| *cell != NO_CELL) {
            let next = &mut ends[cell as usize];
            by_cell[*next as usize] = Some((o, cube));
            *next += 1;
        }
        let unit = self.unit;
        let may_grow = MayGrow {
            cubes: match self.cells.iter().map(Cell::cubes).sum::<usize>() {
                0..SMALLEST_CUBES => subcells::LAYERS.len(),
                SMALLEST_CUBES..MAX_CUBES => subcells::LAYERS.len() - 1,
                _ => 0,
            },
            places: self.cells.iter().map(Cell::places).sum::<usize>() < MAX_PLACES,
        };
        let by_cell = &by_cell;
        self.cells.par_iter_mut().enumerate().for_each(|(i, cell)| {
            let range = starts[i] as usize..starts[i + 1] as usize;
            if !range.is_empty() {
                let observations: Vec<_> = by_cell[range].iter().flatten().copied().collect();
                cell.learn(lights, unit, may_grow, &observations);
            }
        });
    }
}

/// A cell about to be made: what it is, and the points of its first observations.
type Seed = (Origin, Vec<Receiver>);

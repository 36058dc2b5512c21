//! All cells: which observation belongs to which, and making and splitting them.

use super::cell::{Cell, Entry, Origin};
use super::grid::{Grid, Missing, NO_CELL, Place, dominant_axis};
use crate::tree::{Receiver, Tree};
use crate::{CellRecord, Observation, ShadingPoint};
use glam::Vec3;
use rayon::prelude::*;

/// Most cells; points beyond are served by the tree.
const MAX_CELLS: usize = 1 << 17;

/// The cells and the grid that finds them.
#[derive(Debug)]
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

    /// The finest cell around `point`, if there is one.
    #[inline]
    pub(super) fn at(&self, point: &ShadingPoint) -> Option<&Cell> {
        self.cells.get(self.grid.locate(point).cell as usize)
    }

    /// What is known in each cell that is in use; `frame` is the number of frames done.
    pub(super) fn records(&self, tree: &Tree, frame: u64) -> Vec<CellRecord> {
        let used = (0..).zip(&self.cells).filter(|(_, cell)| !cell.split);
        used.flat_map(|(number, cell)| {
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
                visible_fraction: (entry.drawn > 0.0).then(|| f64::from(entry.visible / entry.drawn)),
                samples: entry.drawn as u64,
                age: frame - cell.origin.frame,
            })
        })
        .collect()
    }

    /// The cell of each observation, new cells made where they are missing. Runs through the logs in order, so cells
    /// are numbered alike on any number of threads.
    fn assign(&mut self, tree: &Tree, frame: u64, logs: &[Vec<Observation>]) -> Vec<u32> {
        let known = self.cells.len();
        let mut seeds: Vec<Seed> = Vec::new();
        let grid = &self.grid;
        let places: Vec<Vec<Place>> = logs
            .par_iter()
            .map(|log| log.iter().map(|o| grid.locate(&o.point)).collect())
            .collect();
        let assigned = logs
            .iter()
            .flatten()
            .zip(places.iter().flatten())
            .map(|(o, place)| {
                let mut cell = place.cell;
                if let Some(Missing { key, level }) = place.missing {
                    // An observation before may have asked for the same cell.
                    let made = self.grid.find(key);
                    if made != NO_CELL {
                        cell = made;
                    } else if known + seeds.len() < MAX_CELLS {
                        let parent = place.cell;
                        cell = (known + seeds.len()) as u32;
                        self.grid.insert(key, cell);
                        seeds.push(Seed {
                            key,
                            level,
                            parent,
                            primary: true,
                            points: Vec::new(),
                        });
                    }
                }
                if let Some(seed) = (cell as usize).checked_sub(known).and_then(|new| seeds.get_mut(new)) {
                    seed.primary = o.point.primary;
                    seed.points.push(Receiver::from(&o.point));
                }
                cell
            })
            .collect();
        let cells = &self.cells;
        let new = seeds.par_iter().map(|seed| match cells.get(seed.parent as usize) {
            Some(parent) => Cell::half(seed.origin(frame), parent, &seed.points, tree),
            None => Cell::new(seed.origin(frame), &seed.points, tree),
        });
        let new: Vec<Cell> = new.collect();
        self.cells.extend(new);
        assigned
    }

    /// Every cell learns from its own observations, in the order in which they were made.
    pub(super) fn learn(&mut self, tree: &Tree, frame: u64, logs: &[Vec<Observation>]) {
        let assigned = self.assign(tree, frame, logs);
        let mut ends = vec![0u32; self.cells.len() + 1];
        for &cell in assigned.iter().filter(|&&cell| cell != NO_CELL) {
            ends[cell as usize + 1] += 1;
        }
        for i in 1..ends.len() {
            ends[i] += ends[i - 1];
        }
        let starts = ends.clone();
        let mut by_cell: Vec<Option<&Observation>> = vec![None; assigned.len()];
        for (o, &cell) in logs
            .iter()
            .flatten()
            .zip(&assigned)
            .filter(|&(_, &cell)| cell != NO_CELL)
        {
            let next = &mut ends[cell as usize];
            by_cell[*next as usize] = Some(o);
            *next += 1;
        }
        let unit = self.unit;
        let by_cell = &by_cell;
        self.cells.par_iter_mut().enumerate().for_each(|(i, cell)| {
            let range = starts[i] as usize..starts[i + 1] as usize;
            if !range.is_empty() {
                cell.learn(tree, unit, by_cell[range].iter().flatten().copied());
            }
        });
        for cell in self.cells.iter_mut().filter(|cell| cell.wants_halves()) {
            cell.split = true;
            self.grid.split(cell.origin.key);
        }
    }
}

/// A cell about to be made.
struct Seed {
    key: u64,
    level: u32,
    /// The cell it is a half of, or [`NO_CELL`].
    parent: u32,
    /// Whether it holds first hits.
    primary: bool,
    /// The points of its first observations.
    points: Vec<Receiver>,
}

impl Seed {
    fn origin(&self, frame: u64) -> Origin {
        Origin {
            key: self.key,
            level: self.level,
            primary: self.primary,
            frame,
        }
    }
}

//! Blue noise by void and cluster: R. Ulichney, "The void-and-cluster method for dither array generation" (1993).

use crate::random::{Random, Stream, unit_f64};
use std::sync::OnceLock;

/// Width and height of the tile.
pub(crate) const SIZE: usize = 64;

/// Points that the tile has.
pub(crate) const MAX_POINTS: usize = SIZE * SIZE;

/// Standard deviation, in cells, of the Gaussian by which Ulichney tells crowded from empty: his section 4 recommends 1.5.
const SIGMA: f64 = 1.5;

/// Beyond this many cells the Gaussian is below 1e-6.
const REACH: isize = 8;

/// Share of the cells in the pattern that the first phase relaxes.
const INITIAL_SHARE: usize = 10;

/// The cells of the tile, `[column, row]`, in the order of their ranks: any number of first cells is blue noise on the torus.
pub(super) fn cells() -> &'static [[u16; 2]] {
    static CELLS: OnceLock<Vec<[u16; 2]>> = OnceLock::new();
    CELLS.get_or_init(void_and_cluster)
}

/// The tile as a dither mask: the rank of each cell, row by row, as 32 bits after the point.
pub(crate) fn mask() -> &'static [u32] {
    static MASK: OnceLock<Vec<u32>> = OnceLock::new();
    MASK.get_or_init(|| {
        let mut mask = vec![0; MAX_POINTS];
        for (rank, &[column, row]) in (0_u32..).zip(cells()) {
            mask[usize::from(row) * SIZE + usize::from(column)] = rank * (u32::MAX / MAX_POINTS as u32 + 1);
        }
        mask
    })
}

/// A pattern of chosen cells and how crowded it is around every cell.
#[derive(Clone)]
struct Pattern {
    chosen: Vec<bool>,
    energy: Vec<f64>,
    kernel: Vec<f64>,
}

impl Pattern {
    fn empty() -> Self {
        let kernel = (0..=REACH * REACH * 2).map(|r_sq| (-(r_sq as f64) / (2.0 * SIGMA * SIGMA)).exp());
        Self {
            chosen: vec![false; MAX_POINTS],
            energy: vec![0.0; MAX_POINTS],
            kernel: kernel.collect(),
        }
    }

    /// Chooses a cell, or gives it back.
    fn set(&mut self, cell: usize, chosen: bool) {
        self.chosen[cell] = chosen;
        let sign = if chosen { 1.0 } else { -1.0 };
        let (x, y) = ((cell % SIZE) as isize, (cell / SIZE) as isize);
        let wrap = |v: isize| v.rem_euclid(SIZE as isize) as usize;
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                self.energy[wrap(y + dy) * SIZE + wrap(x + dx)] += sign * self.kernel[(dx * dx + dy * dy) as usize];
            }
        }
    }

    /// The chosen cell with the most chosen ones around it.
    fn tightest_cluster(&self) -> usize {
        self.extreme(true, |energy, best| energy > best)
    }

    /// The free cell with the fewest chosen ones around it.
    fn largest_void(&self) -> usize {
        self.extreme(false, |energy, best| energy < best)
    }

    fn extreme(&self, chosen: bool, better: impl Fn(f64, f64) -> bool) -> usize {
        let among = (0..MAX_POINTS).filter(|&cell| self.chosen[cell] == chosen);
        let best = among.reduce(|best, cell| {
            if better(self.energy[cell], self.energy[best]) {
                cell
            } else {
                best
            }
        });
        best.expect("the tile is neither full nor empty while it is ranked")
    }
}

fn void_and_cluster() -> Vec<[u16; 2]> {
    // A random pattern, relaxed until moving the most crowded point to the emptiest place changes nothing.
    let mut initial = Pattern::empty();
    let mut random = Stream::new(0x_b1_0e, 0);
    let count = MAX_POINTS / INITIAL_SHARE;
    let mut placed = 0;
    while placed < count {
        let cell = (random.number() * MAX_POINTS as f64) as usize;
        if !initial.chosen[cell] {
            initial.set(cell, true);
            placed += 1;
        }
    }
    loop {
        let cluster = initial.tightest_cluster();
        initial.set(cluster, false);
        let void = initial.largest_void();
        initial.set(void, true);
        if void == cluster {
            break;
        }
    }

    // The ranks of that pattern downwards, by taking away the most crowded; upwards, by filling the emptiest. Ulichney's third
    // phase, crowding of the minority of free cells, agrees with the second: removing a cell from the free ones lowers the
    // energy of the free by what it raises that of the chosen.
    let mut ranks = vec![0_usize; MAX_POINTS];
    let mut pattern = initial.clone();
    for rank in (0..count).rev() {
        let cluster = pattern.tightest_cluster();
        pattern.set(cluster, false);
        ranks[rank] = cluster;
    }
    let mut pattern = initial;
    for rank in &mut ranks[count..] {
        let void = pattern.largest_void();
        pattern.set(void, true);
        *rank = void;
    }
    ranks
        .into_iter()
        .map(|cell| [(cell % SIZE) as u16, (cell / SIZE) as u16])
        .collect()
}

/// The coordinates of the first `n` points (at most [`MAX_POINTS`]): the tile is moved around the torus, and each point around its cell, at random. In the
/// middles of their cells many points would be a regular grid.
pub(super) fn points(n: usize, random: &Random) -> Vec<f64> {
    let moved = [0, 1].map(|axis| random.u32(axis) as usize % SIZE);
    let mut coordinates = Vec::with_capacity(2 * n);
    for (cell, first) in cells()[..n].iter().zip((2..).step_by(2)) {
        for axis in 0..2 {
            let cell = (usize::from(cell[axis]) + moved[axis]) % SIZE;
            coordinates.push((cell as f64 + unit_f64(random.u32(first + axis as u32))) / SIZE as f64);
        }
    }
    coordinates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_one_rank() {
        let mut seen = cells().to_vec();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), MAX_POINTS);
    }

    /// The mean distance to the nearest neighbour, as a share of that of the densest packing: 0.47 for random points.
    #[test]
    fn points_keep_their_distance() {
        for n in [64, 256, 400, 1024] {
            let points = points(n, &Random::new(1, 0, 0));
            let points: Vec<[f64; 2]> = points.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
            let torus = |a: f64, b: f64| (a - b).abs().min(1.0 - (a - b).abs());
            let distance = |p: &[f64; 2], q: &[f64; 2]| torus(p[0], q[0]).hypot(torus(p[1], q[1]));
            let nearest = |p| {
                points
                    .iter()
                    .filter(|q| *q != p)
                    .map(|q| distance(p, q))
                    .fold(1.0, f64::min)
            };
            let mean = points.iter().map(nearest).sum::<f64>() / n as f64;
            let densest = (2.0 / (3_f64.sqrt() * n as f64)).sqrt();
            assert!(mean > 0.6 * densest, "{n}: {}", mean / densest);
        }
    }
}

//! Where a point belongs: world-space cells, hashed.
//!
//! A cell is a cube of a size that grows with the distance from the eye (so that it spans about the same number of
//! pixels everywhere), split by the dominant direction of the normal and by first or later hit. Cf. Binder, Fricke and
//! Keller 2019 (Massively parallel path space filtering, section 3) for hashing position, level and normal.

use crate::ShadingPoint;
use glam::Vec3;
use sampling::hash::mix;

/// No cell.
pub(super) const NO_CELL: u32 = u32::MAX;

/// Edge of the largest cells as seen from the eye, in radians.
const CELL_ANGLE: f32 = 0.25;
/// How often a cell may be halved, as observations come in.
const MAX_HALVINGS: u32 = 3;
/// Marks the value of a slot whose cell has been split.
const SPLIT: u32 = 1 << 31;
/// Cells of later hits are this many times larger: they are visited more thinly.
const SECONDARY_SCALE: f32 = 4.0;
/// The smallest cell, as a share of the scene's radius.
const MIN_SIZE: f32 = 1.0 / 2048.0;

/// Maps keys to cells: open addressing, frozen during a frame.
#[derive(Debug)]
pub(super) struct Grid {
    eye_ws: Vec3,
    center_ws: Vec3,
    min_size: f32,
    inverse_min_size: f32,
    slots: Vec<(u64, u32)>,
    used: usize,
}

impl Grid {
    pub(super) fn new(center_ws: Vec3, radius: f32) -> Self {
        Self {
            eye_ws: center_ws,
            center_ws,
            min_size: radius * MIN_SIZE,
            inverse_min_size: 1.0 / (radius * MIN_SIZE).max(f32::MIN_POSITIVE),
            slots: vec![(0, NO_CELL); 1 << 10],
            used: 0,
        }
    }

    pub(super) fn set_eye(&mut self, eye_ws: Vec3) {
        self.eye_ws = eye_ws;
    }

    pub(super) fn bytes(&self) -> usize {
        self.slots.capacity() * size_of::<(u64, u32)>()
    }

    /// The level of the largest cell at a point: its edge is 2^level times the smallest.
    #[inline]
    fn top_level(&self, point: &ShadingPoint) -> u32 {
        let scale = if point.primary { 1.0 } else { SECONDARY_SCALE };
        let wanted = point.position_ws.distance(self.eye_ws) * CELL_ANGLE * scale;
        // The exponent of the ratio, read from its bits: floor(log2), at least 0.
        ((wanted / self.min_size).max(1.0).to_bits() >> 23)
            .saturating_sub(127)
            .min(31)
    }

    #[inline]
    fn key(&self, spot: &Spot, level: u32) -> u64 {
        // 2^-level, by its bits.
        let [x, y, z] = (spot.position * f32::from_bits((127 - level) << 23))
            .to_array()
            .map(|c| u64::from(floor(c) as u32 & 0xf_ffff));
        // 3 x 20 bits of position; level, normal and kind are mixed in. Two cells that clash share a distribution:
        // that costs noise and nothing else.
        let tag = u64::from(mix(level << 8 | spot.kind));
        (x | y << 20 | z << 40) ^ (tag << 32 | tag)
    }

    /// The finest cell at a point.
    #[inline]
    pub(super) fn locate(&self, point: &ShadingPoint) -> Place {
        let top = self.top_level(point);
        let spot = Spot {
            position: (point.position_ws - self.center_ws) * self.inverse_min_size,
            kind: dominant_axis(point.normal_ws) << 1 | u32::from(point.primary),
        };
        // From the finest up: after a while most points are in one of the finest.
        let mut missing: Option<Missing> = None;
        for level in top.saturating_sub(MAX_HALVINGS)..=top {
            let key = self.key(&spot, level);
            let value = self.find(key);
            if value != NO_CELL {
                let halved = value & SPLIT != 0;
                return Place {
                    cell: value & !SPLIT,
                    missing: missing.filter(|_| halved),
                };
            }
            missing = Some(Missing { key, level });
        }
        Place { cell: NO_CELL, missing }
    }

    /// Centre and edge, world space, of the cell of `level` that holds a position.
    pub(super) fn bounds(&self, position_ws: Vec3, level: u32) -> (Vec3, f32) {
        let size = self.min_size * (1u64 << level) as f32;
        let corner = ((position_ws - self.center_ws) / size).floor();
        (self.center_ws + (corner + 0.5) * size, size)
    }

    #[inline]
    fn slot(&self, key: u64) -> usize {
        (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - self.slots.len().trailing_zeros())) as usize
    }

    /// The cell with this key, or [`NO_CELL`]; marked if it has been split.
    #[inline]
    pub(super) fn find(&self, key: u64) -> u32 {
        self.slots[self.probe(key)].1
    }

    /// The slot that holds the key, or the free one where it belongs.
    #[inline]
    fn probe(&self, key: u64) -> usize {
        let mut at = self.slot(key);
        while self.slots[at].1 != NO_CELL && self.slots[at].0 != key {
            at = (at + 1) & (self.slots.len() - 1);
        }
        at
    }

    /// From now on points of this cell look for a finer one.
    pub(super) fn split(&mut self, key: u64) {
        let at = self.probe(key);
        self.slots[at].1 |= SPLIT;
    }

    /// Adds a key that is not there yet.
    pub(super) fn insert(&mut self, key: u64, cell: u32) {
        if (self.used + 1) * 2 > self.slots.len() {
            let old = std::mem::take(&mut self.slots);
            self.slots = vec![(0, NO_CELL); old.len() * 2];
            for slot in old.into_iter().filter(|slot| slot.1 != NO_CELL) {
                let at = self.probe(slot.0);
                self.slots[at] = slot;
            }
        }
        self.used += 1;
        let at = self.probe(key);
        self.slots[at] = (key, cell);
    }
}

/// Where a point lies in the grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// The finest cell that exists, or [`NO_CELL`].
    pub(super) cell: u32,
    /// The cell that ought to be made here, if one is missing.
    pub(super) missing: Option<Missing>,
}

/// A cell that does not exist yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Missing {
    /// Its key.
    pub(super) key: u64,
    /// Its level.
    pub(super) level: u32,
}

/// What the keys of all levels at a point have in common.
struct Spot {
    /// In edges of the smallest cells.
    position: Vec3,
    /// Side that the normal faces, first or later hit.
    kind: u32,
}

/// The largest whole number that is not above `x`: the library's floor is a call where the target lacks the instruction.
#[inline]
fn floor(x: f32) -> i32 {
    let truncated = x as i32;
    truncated - i32::from(truncated as f32 > x)
}

/// 0..6: the axis, and the side of it, to which the normal is nearest.
#[inline]
pub(super) fn dominant_axis(normal: Vec3) -> u32 {
    let a = normal.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    axis * 2 + u32::from(normal[axis as usize] < 0.0)
}

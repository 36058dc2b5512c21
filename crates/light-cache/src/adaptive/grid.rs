//! Where a point belongs: world-space cells, hashed.
//!
//! A cell is a cube of a size that grows with the distance from the eye (so that it spans about the same number of
//! pixels everywhere), told apart by the dominant direction of the normal and by first or later hit. Cf. Binder, Fricke and
//! Keller 2019 (Massively parallel path space filtering, section 3) for hashing position, level and normal.

use super::cube::{Cube, LEVELS};
use crate::ShadingPoint;
use crate::packed::align;
use glam::Vec3;
use sampling::hash::mix;

/// No cell.
pub(super) const NO_CELL: u32 = u32::MAX;

/// Edge of the largest cells as seen from the eye, in radians.
const CELL_ANGLE: f32 = 0.5;
/// Cells of later hits are this many times larger: they are visited more thinly.
const SECONDARY_SCALE: f32 = 4.0;
/// The smallest cube, as a share of the scene's radius.
const MIN_SIZE: f32 = 1.0 / 4096.0;
/// No cell is larger than 2 to this power times the smallest cube.
pub(super) const MAX_LEVEL: u32 = 31;

/// Maps keys to cells: open addressing, frozen during a frame.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
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

    /// Where a point is.
    #[inline]
    pub(super) fn locate(&self, point: &ShadingPoint) -> Spot {
        let scale = if point.primary { 1.0 } else { SECONDARY_SCALE };
        let wanted = point.position_ws.distance(self.eye_ws) * CELL_ANGLE * scale;
        // The exponent of the ratio, read from its bits: floor(log2), at least 0.
        let level = ((wanted / self.min_size).max(1.0).to_bits() >> 23).saturating_sub(127);
        let level = level.clamp(LEVELS, MAX_LEVEL);
        let position = (point.position_ws - self.center_ws) * self.inverse_min_size;
        let [x, y, z] = (position * power_of_two(LEVELS as i32 - level as i32))
            .to_array()
            .map(floor);
        let kind = dominant_axis(point.normal_ws) << 1 | u32::from(point.primary);
        // 3 x 20 bits of position; the rest is mixed in. Two cells that clash share a distribution: that costs noise and
        // nothing else.
        let bits = |c: i32| u64::from((c >> LEVELS) as u32 & 0xf_ffff);
        let tag = u64::from(mix(level << 8 | kind));
        Spot {
            key: (bits(x) | bits(y) << 20 | bits(z) << 40) ^ (tag << 32 | tag),
            cube: Cube::at([x, y, z]),
            level,
        }
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

    /// The cell with this key, or [`NO_CELL`].
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

    /// Appends the slots, four words each: key, cell. Returns ten words: where they are, the binary logarithm of their number, the eye,
    /// the centre, the edge of the smallest cube and its inverse.
    pub(super) fn pack(&self, words: &mut Vec<u32>) -> [u32; 10] {
        let slots = align(words);
        for &(key, cell) in &self.slots {
            words.extend([key as u32, (key >> 32) as u32, cell, 0]);
        }
        let [ex, ey, ez] = self.eye_ws.to_array().map(f32::to_bits);
        let [cx, cy, cz] = self.center_ws.to_array().map(f32::to_bits);
        let sizes = [self.min_size, self.inverse_min_size].map(f32::to_bits);
        let bits = self.slots.len().trailing_zeros();
        [slots, bits, ex, ey, ez, cx, cy, cz, sizes[0], sizes[1]]
    }

    /// Whether it can be what another of the same scene has become, with so many `cells`.
    pub(super) fn is_sound_like(&self, other: &Self, cells: usize) -> bool {
        let used = self.slots.iter().filter(|slot| slot.1 != NO_CELL);
        self.eye_ws.is_finite()
            && (self.center_ws, self.min_size, self.inverse_min_size)
                == (other.center_ws, other.min_size, other.inverse_min_size)
            && self.slots.len().is_power_of_two()
            && self.slots.len() > 1
            && used.clone().all(|slot| (slot.1 as usize) < cells)
            && used.count() == self.used
            && self.used * 2 <= self.slots.len()
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
pub(super) struct Spot {
    /// Key of its cell.
    pub(super) key: u64,
    /// Where in the cell.
    pub(super) cube: Cube,
    /// Level of the cell: its edge is 2^level times that of the smallest cube.
    pub(super) level: u32,
}

/// 2^exponent, by its bits.
#[inline]
fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((127 + exponent) as u32) << 23)
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

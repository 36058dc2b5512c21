//! Eight rays from one point at once: eye rays of neighbouring pixels, which meet mostly the same boxes and triangles.
//!
//! A node or a pack of triangles is brought into the rays' common terms once and then tested against each ray that
//! reaches it, so that the walk's own work is shared too: about half the instructions of eight single walks.

use super::collapse::MAX_DEPTH;
use super::kernel::{Instructions, LocalRay, PackHits};
use super::node::{LEAF, WIDTH};
use super::pack::INDEX;
use super::query::counts;
use super::tree::Tree;
use super::{Hit, PrimitiveId};
use crate::SceneParts;
use glam::Vec3;
use std::mem::MaybeUninit;

/// Rays of a packet. Their masks are bytes, one per child, in one 64-bit word.
pub const PACKET: usize = 8;

/// Rays that start at one point.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// World-space origin.
    pub origin_ws: Vec3,
    /// World-space unit directions, by axis.
    pub directions_ws: [[f32; PACKET]; 3],
}

impl Packet {
    /// The direction of ray `i`.
    #[inline]
    pub fn direction_ws(&self, i: usize) -> Vec3 {
        Vec3::from(one(&self.directions_ws, i))
    }
}

/// Ray `i` of rays by axis. Not `rows.map(|row| row[i])`: that copies all rows.
#[inline(always)]
fn one(rows: &[[f32; PACKET]; 3], i: usize) -> [f32; 3] {
    [rows[0][i], rows[1][i], rows[2][i]]
}

/// A packet in the terms of the kernels, if its rays are alike: going the same way along each axis.
struct Rays {
    /// What they have in common: origin, axes and signs of the first ray.
    first: LocalRay,
    inverse: [[f32; PACKET]; 3],
    inverse_far: [[f32; PACKET]; 3],
    shear: [[f32; PACKET]; 3],
    t_max: [f32; PACKET],
}

impl Rays {
    #[inline(always)]
    fn new(packet: &Packet) -> Option<Self> {
        /// Least size of the component along the common last axis, relative to the others: the triangle test divides by
        /// it. Single rays take their largest; here one ray speaks for all.
        const LEAST_SHARE: f32 = 0.5;
        let first = LocalRay::new(packet.origin_ws, packet.direction_ws(0));
        let [x, y, z] = first.axes.map(|axis| &packet.directions_ws[axis]);
        let mut alike = true;
        for i in 0..PACKET {
            alike &= z[i].abs() >= LEAST_SHARE * x[i].abs().max(y[i].abs());
            for axis in 0..3 {
                alike &= packet.directions_ws[axis][i].is_sign_negative() == (first.near[axis] != 0);
            }
        }
        if !alike {
            return None;
        }
        let mut rays = Self {
            inverse: [[0.0; PACKET]; 3],
            inverse_far: [[0.0; PACKET]; 3],
            shear: [[0.0; PACKET]; 3],
            t_max: [f32::INFINITY; PACKET],
            first,
        };
        // Loops and not `map`, whose calls are not always inlined and then miss the vector instructions.
        for axis in 0..3 {
            for i in 0..PACKET {
                rays.inverse[axis][i] = LocalRay::inverse(packet.directions_ws[axis][i]);
                rays.inverse_far[axis][i] = LocalRay::enlarged(rays.inverse[axis][i]);
            }
        }
        for i in 0..PACKET {
            let shear_z = 1.0 / z[i];
            rays.shear[0][i] = x[i] * shear_z;
            rays.shear[1][i] = y[i] * shear_z;
            rays.shear[2][i] = shear_z;
        }
        Some(rays)
    }
}

/// A child on the stack, and which rays are to visit it.
#[derive(Clone, Copy)]
struct Entry {
    /// Where the first of them enters.
    near: f32,
    child: u32,
    rays: u32,
}

/// Each node on a path leaves at most all children but one behind.
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + WIDTH;

/// The nearest hits in the tree of instance 0, into `best`; false, and nothing done, if the rays are not alike.
///
/// # Safety
/// That of [`Instructions`].
#[allow(unsafe_code, reason = "as the walk of a single ray")]
#[inline(always)]
pub(super) unsafe fn nearest<I: Instructions>(
    tree: &Tree,
    parts: &SceneParts,
    packet: &Packet,
    best: &mut [Hit; PACKET],
) -> bool {
    let Some(mut rays) = Rays::new(packet) else {
        return false;
    };
    let mut stack = [const { MaybeUninit::<Entry>::uninit() }; STACK];
    let stack: *mut Entry = stack.as_mut_ptr().cast();
    let mut height = 0usize;
    let mut current = Entry {
        near: 0.0,
        child: tree.root,
        rays: (1 << PACKET) - 1,
    };
    // SAFETY: as in `traverse::walk`; rays are numbered below `PACKET`.
    unsafe {
        loop {
            if current.child & LEAF != 0 {
                leaf::<I>(tree, parts, &mut rays, &current, best);
            } else {
                let node = tree.nodes.get_unchecked(current.child as usize);
                let planes = I::planes(node, &rays.first);
                let mut near = [f32::INFINITY; WIDTH];
                // One byte of rays per child.
                let mut visits = 0u64;
                let mut met = 0;
                let mut left = current.rays;
                while left != 0 {
                    let ray = left.trailing_zeros() as usize & (PACKET - 1);
                    left &= left - 1;
                    let (inverse, inverse_far) = (one(&rays.inverse, ray), one(&rays.inverse_far, ray));
                    let mask = I::boxes_at(&planes, inverse, inverse_far, rays.t_max[ray], &mut near);
                    visits |= spread(mask) << ray;
                    met |= mask;
                }
                // About the nearest on top.
                let bottom = height;
                while met != 0 {
                    let lane = met.trailing_zeros() as usize & (WIDTH - 1);
                    met &= met - 1;
                    let entry = Entry {
                        near: near[lane],
                        child: node.child[lane],
                        rays: (visits >> (8 * lane)) as u32 & 0xff,
                    };
                    let mut at = height;
                    while at > bottom && (*stack.add(at - 1)).near < entry.near {
                        *stack.add(at) = *stack.add(at - 1);
                        at -= 1;
                    }
                    *stack.add(at) = entry;
                    height += 1;
                }
            }
            loop {
                if height == 0 {
                    return true;
                }
                height -= 1;
                current = *stack.add(height);
                current.rays &= I::reach(current.near, &rays.t_max);
                if current.rays != 0 {
                    break;
                }
            }
        }
    }
}

/// Tests the triangles of a leaf against the rays that reach it.
///
/// # Safety
/// That of [`nearest`].
#[allow(unsafe_code, reason = "calls the kernels")]
#[inline(always)]
unsafe fn leaf<I: Instructions>(
    tree: &Tree,
    parts: &SceneParts,
    rays: &mut Rays,
    entry: &Entry,
    best: &mut [Hit; PACKET],
) {
    const INSTANCE: u32 = 0;
    // SAFETY: leaves of a mesh's tree are indices of packs; the rest as the caller promises.
    unsafe {
        let pack = tree.packs.get_unchecked((entry.child & !LEAF) as usize);
        let corners = I::corners(pack, &rays.first);
        let mut hits = PackHits::default();
        let mut left = entry.rays;
        while left != 0 {
            let ray = left.trailing_zeros() as usize & (PACKET - 1);
            left &= left - 1;
            let mut mask = I::triangles_at(&corners, one(&rays.shear, ray), rays.t_max[ray], &mut hits);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
                mask &= mask - 1;
                let (tag, t) = (pack.tag[lane], hits.t[lane]);
                if t < rays.t_max[ray] && counts(parts, INSTANCE, [u32::MAX; 2], &hits, tag, lane) {
                    rays.t_max[ray] = t;
                    best[ray] = Hit {
                        t,
                        u: hits.u[lane],
                        v: hits.v[lane],
                        id: PrimitiveId {
                            instance: INSTANCE,
                            triangle: tag & INDEX,
                        },
                    };
                }
            }
        }
    }
}

/// Bit `i` of the low byte to bit 0 of byte `i`.
#[inline(always)]
fn spread(mask: u32) -> u64 {
    // Seven bits by one product that puts a copy of them at every seventh bit; the eighth on its own.
    let low = u64::from(mask & 0x7f).wrapping_mul(0x0408_1020_4081) & 0x0001_0101_0101_0101;
    low | u64::from(mask >> 7) << 56
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreading_keeps_every_bit() {
        for mask in 0..256 {
            for i in 0..8 {
                assert_eq!(spread(mask) >> (8 * i) & 0xff, u64::from(mask >> i & 1));
            }
        }
    }
}

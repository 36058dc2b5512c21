//! Eight triangles side by side, as one vector instruction takes them.

use super::node::WIDTH;
use crate::{Material, Mesh};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// In a triangle's tag: its back cannot be hit.
pub(super) const ONE_SIDED: u32 = 1 << 31;
/// In a triangle's tag: whether it is there depends on its texture.
pub(super) const MASKED: u32 = 1 << 30;
/// The bits of a tag that hold the triangle's index.
pub(super) const INDEX: u32 = MASKED - 1;

/// Up to eight triangles: five cache lines. Unused lanes hold points, which are never hit.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Pack {
    /// By corner, axis, lane. Corners and not edges, so that triangles that share corners compute with equal numbers.
    pub(super) corners: [[[f32; WIDTH]; 3]; 3],
    /// Index in the mesh, and flags.
    pub(super) tag: [u32; WIDTH],
}

impl Pack {
    /// Holds nothing.
    pub(super) const EMPTY: Self = Self {
        corners: [[[0.0; WIDTH]; 3]; 3],
        tag: [INDEX; WIDTH],
    };

    /// The given triangles (at most eight) of `mesh`.
    pub(super) fn new(mesh: &Mesh, materials: &[Material], triangles: impl Iterator<Item = u32>) -> Self {
        let mut pack = Self::EMPTY;
        for (lane, triangle) in triangles.enumerate() {
            for (corner, position) in mesh.corners(triangle as usize).into_iter().enumerate() {
                pack.set(lane, corner, position);
            }
            let material = &materials[mesh.materials[triangle as usize] as usize];
            let one_sided = if material.double_sided { 0 } else { ONE_SIDED };
            let masked = if material.alpha_cutoff.is_some() { MASKED } else { 0 };
            pack.tag[lane] = triangle | one_sided | masked;
        }
        pack
    }

    fn set(&mut self, lane: usize, corner: usize, position: Vec3) {
        for axis in 0..3 {
            self.corners[corner][axis][lane] = position[axis];
        }
    }
}

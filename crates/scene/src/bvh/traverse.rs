//! The walk through the tree, nearest child first.

use super::collapse::MAX_DEPTH;
use super::kernel::Instructions;
use super::node::{LEAF, Node, WIDTH};
use std::mem::MaybeUninit;

/// Each node on a path leaves at most all children but one behind.
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + WIDTH;

/// Walks from `root`; `leaf` is called with the index of each leaf that the ray may meet in \[0, `t_max`\], about nearest
/// first, and returns the new `t_max`, negative to stop.
///
/// # Safety
/// That of [`Instructions`]; and `root` must come from [`super::collapse::collapse`] into `nodes`.
#[allow(
    unsafe_code,
    reason = "bounds checks and clearing the stack cost a tenth of the time"
)]
#[inline(always)]
pub(super) unsafe fn walk<I: Instructions>(
    nodes: &[Node],
    root: u32,
    ray: &I::Ray,
    mut t_max: f32,
    mut leaf: impl FnMut(u32, f32) -> f32,
) {
    // Entry distance in the upper half, child in the lower: distances are at least 0, so integers sort like them.
    let mut stack: [MaybeUninit<u64>; STACK] = [const { MaybeUninit::uninit() }; STACK];
    let mut height = 0usize;
    let mut near = [0.0f32; WIDTH];
    let mut current = root;
    loop {
        if current & LEAF != 0 {
            t_max = leaf(current & !LEAF, t_max);
        } else {
            // SAFETY: child references of inner nodes are indices into `nodes` by construction.
            let node = unsafe { nodes.get_unchecked(current as usize) };
            // SAFETY: as the caller promises.
            let mut mask = unsafe { I::boxes(ray, node, t_max, &mut near) };
            if mask != 0 {
                let first = height;
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    let entry = u64::from(near[lane].to_bits()) << 32 | u64::from(node.child[lane]);
                    // Insertion, farthest at the bottom.
                    let mut at = height;
                    // SAFETY: `collapse` limits the depth, so `height` stays below STACK; below `height` all is set.
                    unsafe {
                        while at > first && stack.get_unchecked(at - 1).assume_init() < entry {
                            *stack.get_unchecked_mut(at) = *stack.get_unchecked(at - 1);
                            at -= 1;
                        }
                        *stack.get_unchecked_mut(at) = MaybeUninit::new(entry);
                    }
                    height += 1;
                }
            }
        }
        loop {
            if height == 0 {
                return;
            }
            height -= 1;
            // SAFETY: everything below `height` was written.
            let entry = unsafe { stack.get_unchecked(height).assume_init() };
            if f32::from_bits((entry >> 32) as u32) <= t_max {
                current = entry as u32;
                break;
            }
        }
    }
}

//! The walk through the tree, nearest child first.

use super::collapse::MAX_DEPTH;
use super::kernel::Instructions;
use super::node::{LEAF, Node, WIDTH};
use std::mem::MaybeUninit;

/// Each node on a path leaves at most all children but one behind.
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + WIDTH;

/// What to do at leaves.
#[allow(
    unsafe_code,
    reason = "vector instructions are unsafe to use where the processor lacks them"
)]
pub(super) trait Visitor<I: Instructions> {
    /// Called with a leaf's index and the present `t_max`; returns the new one, negative to stop.
    ///
    /// # Safety
    /// That of [`Instructions`].
    unsafe fn leaf(&mut self, leaf: u32, t_max: f32) -> f32;
}

/// Walks from `root` to each leaf that the ray may meet in \[0, `t_max`\]. `ORDERED`: about nearest first, which pays
/// where hits lower `t_max`.
///
/// # Safety
/// That of [`Instructions`]; and `root` must come from [`super::collapse::collapse`] into `nodes`.
#[allow(
    unsafe_code,
    reason = "bounds checks and clearing the stack cost a tenth of the time"
)]
#[inline(always)]
pub(super) unsafe fn walk<I: Instructions, const ORDERED: bool>(
    nodes: &[Node],
    root: u32,
    ray: &I::Ray,
    mut t_max: f32,
    visitor: &mut impl Visitor<I>,
) {
    let mut stack = [const { MaybeUninit::<Entry>::uninit() }; STACK];
    let stack: *mut Entry = stack.as_mut_ptr().cast();
    let mut height = 0usize;
    let mut near = [0.0f32; WIDTH];
    let mut current = root;
    // SAFETY: child references of inner nodes are indices into `nodes` by construction, lanes are less than 8, the
    // instructions are there as the caller promises, and `collapse` limits the depth of the tree to that of the stack,
    // of which only what was written is read.
    unsafe {
        loop {
            if current & LEAF != 0 {
                t_max = visitor.leaf(current & !LEAF, t_max);
            } else {
                let node = nodes.get_unchecked(current as usize);
                let mut mask = I::boxes(ray, node, t_max, &mut near);
                if mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    current = *node.child.get_unchecked(lane);
                    if mask == 0 {
                        continue;
                    }
                    let mut last = Entry::new(*near.get_unchecked(lane), current);
                    let bottom = height;
                    while mask != 0 {
                        let lane = mask.trailing_zeros() as usize;
                        mask &= mask - 1;
                        let next = Entry::new(*near.get_unchecked(lane), *node.child.get_unchecked(lane));
                        // `last` stays the nearest; those on the stack are sorted, the farthest lowest.
                        let (nearer, farther) = if ORDERED && last < next {
                            (last, next)
                        } else {
                            (next, last)
                        };
                        let mut at = height;
                        if ORDERED {
                            while at > bottom && *stack.add(at - 1) < farther {
                                *stack.add(at) = *stack.add(at - 1);
                                at -= 1;
                            }
                        }
                        *stack.add(at) = farther;
                        height += 1;
                        last = nearer;
                    }
                    current = last.child();
                    continue;
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let entry = *stack.add(height);
                if entry.near() <= t_max {
                    current = entry.child();
                    break;
                }
            }
        }
    }
}

/// Entry distance in the upper half, child in the lower: distances are at least 0, so integers sort like them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u64);

impl Entry {
    #[inline(always)]
    fn new(near: f32, child: u32) -> Self {
        Self(u64::from(near.to_bits()) << 32 | u64::from(child))
    }

    #[inline(always)]
    fn child(self) -> u32 {
        self.0 as u32
    }

    #[inline(always)]
    fn near(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

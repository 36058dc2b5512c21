//! The eight-wide node: child boxes quantised to one byte per plane, as in Ylitie, Karras, Laine, "Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.1.
//!
//! Differs: the step is a float, not a power of two; children are named one by one instead of by a base and a mask;
//! the lower planes of each axis are stored twice, around the upper ones, so that reading 16 bytes from offset 0 or 8
//! gives (near, far) planes for a ray going up or down that axis, and never crosses a cache line. Two lines in all.

use super::bounds::Bounds;
use bytemuck::{Pod, Zeroable};

/// Set in a child reference that names a leaf.
pub(super) const LEAF: u32 = 1 << 31;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Steps that the children's boxes span; the rest of the 255 is the margin on both sides.
const STEPS: f64 = 252.0;

/// Part of a step by which every box is widened, so that rounding in the box test never loses a hit.
const SLACK_STEPS: f64 = 1.0 / 64.0;

/// Eight quantised boxes and what they contain.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(128))]
pub(super) struct Node {
    /// The boxes' planes across each axis.
    pub(super) slabs: [Slabs; 3],
    /// [`LEAF`] and a leaf's index, or the index of a node.
    pub(super) child: [u32; WIDTH],
}

/// The planes of eight boxes across one axis.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Slabs {
    /// Eight lower planes, eight upper planes, the eight lower planes again, in steps from `origin`.
    pub(super) planes: [u8; 24],
    /// Where plane 0 lies.
    pub(super) origin: f32,
    /// Distance between planes; positive.
    pub(super) step: f32,
}

impl Node {
    /// A node over `children` (at most eight). Unused slots refer to `empty`, and no ray can be inside their box
    /// except by rounding.
    pub(super) fn new(children: &[(Bounds, u32)], empty: u32) -> Self {
        debug_assert!(children.len() <= WIDTH);
        let all = children.iter().fold(Bounds::EMPTY, |all, (b, _)| all.union(*b));
        let mut node = Self {
            slabs: [Slabs {
                planes: [0; 24],
                origin: 0.0,
                step: 1.0,
            }; 3],
            child: [empty; WIDTH],
        };
        for axis in 0..3 {
            let (lower, upper) = if children.is_empty() {
                (0.0, 0.0)
            } else {
                (all.min[axis], all.max[axis])
            };
            let largest = lower.abs().max(upper.abs());
            // Flat boxes get a step of a few units in the last place, so that `origin` differs from `lower`.
            let step = ((f64::from(upper) - f64::from(lower)) / STEPS)
                .max(f64::from(largest) * 2f64.powi(-21))
                .max(1e-30) as f32;
            let origin = (f64::from(lower) - f64::from(step)) as f32;
            let slabs = &mut node.slabs[axis];
            slabs.step = step;
            slabs.origin = origin;
            let quantise = |x: f32| (f64::from(x) - f64::from(origin)) / f64::from(step);
            for lane in 0..WIDTH {
                let (low, high) = match children.get(lane) {
                    Some((bounds, _)) => (
                        (quantise(bounds.min[axis]) - SLACK_STEPS).floor() as u8,
                        (quantise(bounds.max[axis]) + SLACK_STEPS).ceil() as u8,
                    ),
                    None => (255, 0),
                };
                slabs.planes[lane] = low;
                slabs.planes[lane + 8] = high;
                slabs.planes[lane + 16] = low;
            }
        }
        for (slot, (_, child)) in node.child.iter_mut().zip(children) {
            *slot = *child;
        }
        node
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    fn vec3(range: f32) -> impl Strategy<Value = Vec3> {
        (-range..range, -range..range, -range..range).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn quantised_boxes_contain_the_boxes(
            corners in prop::collection::vec((vec3(1.0), vec3(1.0)), 1..=8),
            scale in prop::sample::select(vec![1e-4f32, 1.0, 1e5]),
            offset in vec3(100.0),
            flat in 0usize..4,
        ) {
            let children: Vec<_> = corners.iter().enumerate().map(|(i, &(a, b))| {
                let (mut a, mut b) = ((a + offset) * scale, (b + offset) * scale);
                if flat < 3 { a[flat] = 7.25 * scale; b[flat] = 7.25 * scale; }
                (Bounds { min: a.min(b), max: a.max(b) }, i as u32)
            }).collect();
            let node = Node::new(&children, LEAF);
            prop_assert_eq!(size_of::<Node>(), 128);
            for (lane, (bounds, id)) in children.iter().enumerate() {
                prop_assert_eq!(node.child[lane], *id);
                for axis in 0..3 {
                    let slabs = &node.slabs[axis];
                    let plane = |q: u8| f64::from(slabs.origin) + f64::from(q) * f64::from(slabs.step);
                    prop_assert!(plane(slabs.planes[lane]) < f64::from(bounds.min[axis]));
                    prop_assert!(plane(slabs.planes[lane + 8]) > f64::from(bounds.max[axis]));
                    prop_assert_eq!(slabs.planes[lane], slabs.planes[lane + 16]);
                }
            }
        }
    }
}

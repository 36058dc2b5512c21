//! The binary tree that the wide one is made of.

use super::bounds::Bounds;
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Share of the nodes that reinsertion tries to place better. Higher values build slower and trace faster.
const REINSERTION_SHARE: f32 = 0.3;
/// Most nodes that it tries, so that very large scenes are built in seconds.
const MOST_REINSERTIONS: f32 = 600_000.0;

/// PLOC (Meister and Bittner 2018), then parallel reinsertion (Meister and Bittner 2018). Every leaf holds one box, and
/// `primitive_indices[first_index]` is its index in `boxes`.
pub(super) fn build<T: Boundable>(boxes: &[T]) -> Bvh2 {
    let indices = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        boxes,
        indices,
        SortPrecision::U64,
        3,
    );
    let share = REINSERTION_SHARE.min(MOST_REINSERTIONS / tree.nodes.len().max(1) as f32);
    ReinsertionOptimizer::default().run(&mut tree, share, None);
    tree.parents = Vec::new();
    tree
}

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.min.into(), self.max.into())
    }
}

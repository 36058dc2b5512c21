//! Building the tree: binned splits by the surface-area-orientation heuristic, top down; bounds bottom up.
//!
//! Conty Estevez and Kulla 2018, section 4.4. Differs: the area term is the squared diagonal (importance uses bounding spheres, and
//! lights in a row have no box area), and the orientation term grows linearly from a single direction (pi) to all
//! directions (4 pi) with the mean resultant length of the axes, which adds up where cones do not. The exact cones are
//! computed once, for the nodes.

use super::bounds::{Bounds, Emission, LeafLight};
use super::{LEAF, MAX_LEAF_LIGHTS, Node};
use glam::Vec3;
use scene::Light;

/// Number of buckets per axis; 12 as in the paper.
const BUCKETS: usize = 12;
/// Groups larger than this are built in parallel.
const PARALLEL_ABOVE: usize = 4096;
/// Below this depth groups are halved by count, so that depth stays bounded whatever the lights are.
const MAX_HEURISTIC_DEPTH: u32 = 56;

/// Sorts `leaves` into tree order and returns the nodes, root first, siblings side by side, depth first. `first_split`: how
/// many of them the root's first child is to hold, if it is not to be chosen by the heuristic.
pub(super) fn build(leaves: &mut [LeafLight], lights: &[Light], first_split: Option<usize>) -> Vec<Node> {
    let mut nodes = Vec::new();
    if leaves.is_empty() {
        return nodes;
    }
    let (bounds, root) = match first_split {
        Some(middle) => build_children(leaves, middle, 0, lights, 0, &mut nodes, 2),
        None => build_group(leaves, 0, lights, 0, &mut nodes, 2),
    };
    // The root sits alone in front; the gap keeps every pair of siblings on an even index.
    let root = node(&bounds, root, leaves, 0);
    let gap = Node {
        child: LEAF,
        count: 0,
        ..root
    };
    nodes.splice(0..0, [root, gap]);
    nodes
}

/// Builds the descendants of one group into `nodes`; `base` is the index that `nodes[0]` will have in the end.
/// Returns the group's bounds and the index of its first child, [`LEAF`] if it has none.
fn build_group(
    leaves: &mut [LeafLight],
    first: u32,
    lights: &[Light],
    depth: u32,
    nodes: &mut Vec<Node>,
    base: u32,
) -> (Bounds, u32) {
    if leaves.len() <= MAX_LEAF_LIGHTS {
        let mut all = leaves.iter().map(|leaf| Bounds::of(&lights[leaf.index() as usize]));
        let start = all.next().expect("no group is empty");
        return (all.fold(start, |sum, bounds| sum.union(&bounds)), LEAF);
    }
    let middle = partition(leaves, depth);
    build_children(leaves, middle, first, lights, depth, nodes, base)
}

/// The same for a group whose children are its first `middle` lights and the others.
fn build_children(
    leaves: &mut [LeafLight],
    middle: usize,
    first: u32,
    lights: &[Light],
    depth: u32,
    nodes: &mut Vec<Node>,
    base: u32,
) -> (Bounds, u32) {
    let (left, right) = leaves.split_at_mut(middle);
    let right_first = first + middle as u32;
    let children = nodes.len();
    let child_base = base + children as u32;
    let (left_result, right_result) = if left.len() + right.len() > PARALLEL_ABOVE {
        let ((left_result, mut left_nodes), (right_result, mut right_nodes)) = rayon::join(
            || {
                let mut own = Vec::new();
                (build_group(left, first, lights, depth + 1, &mut own, 0), own)
            },
            || {
                let mut own = Vec::new();
                (build_group(right, right_first, lights, depth + 1, &mut own, 0), own)
            },
        );
        let left_base = child_base + 2;
        let right_base = left_base + left_nodes.len() as u32;
        let left_result = (left_result.0, rebase(&mut left_nodes, left_result.1, left_base));
        let right_result = (right_result.0, rebase(&mut right_nodes, right_result.1, right_base));
        nodes.extend([
            node(&left_result.0, left_result.1, left, first),
            node(&right_result.0, right_result.1, right, right_first),
        ]);
        nodes.append(&mut left_nodes);
        nodes.append(&mut right_nodes);
        (left_result, right_result)
    } else {
        nodes.extend([Node::default(), Node::default()]);
        let left_result = build_group(left, first, lights, depth + 1, nodes, base);
        let right_result = build_group(right, right_first, lights, depth + 1, nodes, base);
        nodes[children] = node(&left_result.0, left_result.1, left, first);
        nodes[children + 1] = node(&right_result.0, right_result.1, right, right_first);
        (left_result, right_result)
    };
    (left_result.0.union(&right_result.0), child_base)
}

/// Moves a subtree that was built with indices from 0 to `base`; returns its root's child index there.
fn rebase(nodes: &mut [Node], child: u32, base: u32) -> u32 {
    let moved = |child: u32| if child == LEAF { LEAF } else { child + base };
    for node in nodes {
        node.child = moved(node.child);
    }
    moved(child)
}

/// The node for a group with these bounds.
fn node(bounds: &Bounds, child: u32, leaves: &[LeafLight], first: u32) -> Node {
    let center = bounds.center();
    // Outwards by more than rounding can do: a few units in the last place of the coordinates, and of the size.
    let half = 0.5001 * (bounds.max - bounds.min) + 1e-6 * center.abs().max_element();
    let cone = bounds.cone;
    // A milliradian more than exact (many-light-sampling hazard: cones that are not conservative).
    let cos_e = (cone.theta_e + 1e-3).min(std::f32::consts::PI).cos();
    let everywhere = cone.theta_o >= std::f32::consts::PI;
    Node {
        center,
        half,
        axis: cone.axis,
        cos_o: if everywhere { -1.0 } else { cone.theta_o.cos() },
        sin_o: if everywhere { 0.0 } else { cone.theta_o.sin() },
        cos_e,
        weight: leaves.iter().map(|leaf| leaf.weight).sum(),
        first,
        count: leaves.len() as u32,
        child,
    }
}

/// What a bucket, or a run of buckets, holds.
#[derive(Clone, Copy)]
struct Bucket {
    min: Vec3,
    max: Vec3,
    /// Sum of weight x axis; two-sided lights and points add nothing, they face all ways.
    axes: Vec3,
    weight: f32,
    count: u32,
}

impl Bucket {
    const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
        axes: Vec3::ZERO,
        weight: 0.0,
        count: 0,
    };

    fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            axes: self.axes + other.axes,
            weight: self.weight + other.weight,
            count: self.count + other.count,
        }
    }

    /// Flux x area x orientation.
    fn cost(&self) -> f32 {
        let resultant = (self.axes.length() / self.weight.max(f32::MIN_POSITIVE)).min(1.0);
        self.weight * (self.max - self.min).length_squared() * (4.0 - 3.0 * resultant)
    }
}

/// Sorts `leaves` into two non-empty parts and returns the size of the first.
fn partition(leaves: &mut [LeafLight], depth: u32) -> usize {
    let middle = leaves.len() / 2;
    if depth >= MAX_HEURISTIC_DEPTH {
        return middle;
    }
    let (min, max) = leaves
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), leaf| {
            (min.min(leaf.center), max.max(leaf.center))
        });
    let extent = max - min;
    let longest = extent.max_element();
    // Written so that an extent that is not finite also ends here.
    if !(longest > 0.0 && longest.is_finite()) {
        return middle;
    }
    let scale = Vec3::select(
        extent.cmpgt(Vec3::ZERO),
        Vec3::splat(BUCKETS as f32) / extent,
        Vec3::ZERO,
    );
    let bucket_of = |leaf: &LeafLight| {
        ((leaf.center - min) * scale)
            .as_uvec3()
            .min(glam::UVec3::splat(BUCKETS as u32 - 1))
    };
    let mut buckets = [[Bucket::EMPTY; BUCKETS]; 3];
    for leaf in leaves.iter() {
        let one = Bucket {
            min: leaf.center - Vec3::splat(leaf.radius),
            max: leaf.center + Vec3::splat(leaf.radius),
            axes: match leaf.emission() {
                Emission::OneSided => leaf.axis * leaf.weight,
                Emission::TwoSided => Vec3::ZERO,
                // Zero for points; spots have an axis.
                Emission::Point => leaf.axis * leaf.weight,
            },
            weight: leaf.weight,
            count: 1,
        };
        let at = bucket_of(leaf);
        for axis in 0..3 {
            let bucket = &mut buckets[axis][at[axis] as usize];
            *bucket = bucket.union(&one);
        }
    }
    let mut best = (f32::INFINITY, 0, 0);
    for axis in 0..3 {
        if extent[axis] <= 0.0 {
            continue;
        }
        let mut after = [0.0; BUCKETS];
        let mut sum = Bucket::EMPTY;
        for i in (1..BUCKETS).rev() {
            sum = sum.union(&buckets[axis][i]);
            after[i] = if sum.count > 0 { sum.cost() } else { f32::INFINITY };
        }
        // Long thin groups are cut across their length first (the paper's regularisation).
        let regular = longest / extent[axis];
        let mut sum = Bucket::EMPTY;
        for split in 1..BUCKETS {
            sum = sum.union(&buckets[axis][split - 1]);
            if sum.count == 0 {
                continue;
            }
            let cost = regular * (sum.cost() + after[split]);
            if cost < best.0 {
                best = (cost, axis, split as u32);
            }
        }
    }
    let (cost, axis, split) = best;
    if !cost.is_finite() {
        return middle;
    }
    let mut left = 0;
    for i in 0..leaves.len() {
        if bucket_of(&leaves[i])[axis] < split {
            leaves.swap(i, left);
            left += 1;
        }
    }
    debug_assert!(left > 0 && left < leaves.len());
    left
}

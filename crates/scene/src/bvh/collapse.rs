//! From the binary to the eight-wide tree, at the least expected cost: Ylitie, Karras, Laine 2017, section 4.
//!
//! Differs: a leaf costs the same whatever it holds, because its triangles are tested together.

use super::bounds::Bounds;
use super::node::{LEAF, Node, WIDTH};
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

/// Cost of testing a pack of triangles, in tests of a node. Higher values give fuller packs.
const LEAF_COST: f32 = 1.2;

/// Depth from which subtrees are cut without regard to cost. Only adversarial geometry gets there.
const DEEP: usize = 80;

/// Largest number of nodes on a path, what the traversal's stack is made for: below [`DEEP`] come at most
/// log8 (2^31 primitives).
pub(super) const MAX_DEPTH: usize = DEEP + 11;

/// How the subtree of a binary node is best cut into a forest.
#[derive(Clone, Copy, Default)]
struct Forest {
    /// Expected cost when it is cut into at most `i + 1` wide children.
    cost: [f32; WIDTH - 1],
    /// Primitives below.
    count: u32,
}

/// What a wide node is made of.
enum Source {
    /// A binary node, cut at the least cost.
    Binary(u32),
    /// Binary leaves, cut evenly.
    Leaves(Vec<u32>),
}

/// Makes wide nodes of `tree`, appended to `nodes`; returns the root's index. `leaf` stores up to `leaf_size`
/// primitives and returns the index of what it stored. Unused slots of nodes point at the leaf `empty`.
pub(super) fn collapse(
    tree: &Bvh2,
    leaf_size: u32,
    empty: u32,
    nodes: &mut Vec<Node>,
    mut leaf: impl FnMut(&[u32]) -> u32,
) -> u32 {
    let forests = forests(tree, leaf_size);
    let root = nodes.len() as u32;
    nodes.push(Node::new(&[], empty | LEAF));
    let mut todo = vec![(Source::Binary(0), root, 1usize)];
    while let Some((source, wide, depth)) = todo.pop() {
        let sources = match source {
            Source::Binary(binary) if depth < DEEP => cut(tree, &forests, leaf_size, binary),
            Source::Binary(binary) => split_evenly(&leaves(tree, binary)),
            Source::Leaves(all) => split_evenly(&all),
        };
        let mut slots = [(Bounds::EMPTY, 0); WIDTH];
        let count = sources.len();
        for (slot, source) in slots.iter_mut().zip(sources) {
            let (bounds, done) = match &source {
                Source::Binary(child) => {
                    let is_leaf = is_leaf(tree, &forests, *child, leaf_size);
                    (bounds(tree, *child), is_leaf.then(|| leaves(tree, *child)))
                }
                Source::Leaves(all) => {
                    let around = all
                        .iter()
                        .fold(Bounds::EMPTY, |around, &leaf| around.union(bounds(tree, leaf)));
                    (around, (all.len() <= leaf_size as usize).then(|| all.clone()))
                }
            };
            let child = if let Some(all) = done {
                let primitives: Vec<u32> = all.iter().map(|&leaf| primitive(tree, leaf)).collect();
                leaf(&primitives) | LEAF
            } else {
                nodes.push(Node::new(&[], empty | LEAF));
                let index = nodes.len() as u32 - 1;
                todo.push((source, index, depth + 1));
                index
            };
            *slot = (bounds, child);
        }
        nodes[wide as usize] = Node::new(&slots[..count], empty | LEAF);
    }
    root
}

/// The children of the wide node that replaces a binary one.
fn cut(tree: &Bvh2, forests: &[Forest], leaf_size: u32, binary: u32) -> Vec<Source> {
    let mut cut = Vec::with_capacity(WIDTH);
    if is_leaf(tree, forests, binary, leaf_size) {
        cut.push(Source::Binary(binary));
    } else {
        let [left, right] = children(&tree.nodes[binary as usize]);
        let (_, share) = distribute(&forests[left as usize], &forests[right as usize], WIDTH);
        descend(tree, forests, left, share, &mut cut);
        descend(tree, forests, right, WIDTH - share, &mut cut);
    }
    cut
}

/// At most eight parts of about the same size.
fn split_evenly(leaves: &[u32]) -> Vec<Source> {
    leaves
        .chunks(leaves.len().div_ceil(WIDTH))
        .map(|part| Source::Leaves(part.to_vec()))
        .collect()
}

fn bounds(tree: &Bvh2, index: u32) -> Bounds {
    let aabb = tree.nodes[index as usize].aabb();
    Bounds {
        min: aabb.min.into(),
        max: aabb.max.into(),
    }
}

/// The primitive of a binary leaf.
fn primitive(tree: &Bvh2, leaf: u32) -> u32 {
    tree.primitive_indices[tree.nodes[leaf as usize].first_index as usize]
}

fn children(node: &Bvh2Node) -> [u32; 2] {
    [node.first_index, node.first_index + 1]
}

/// Bottom up: the costs of all cuts of all subtrees.
fn forests(tree: &Bvh2, leaf_size: u32) -> Vec<Forest> {
    // Parents before children; reinsertion leaves the nodes in no order.
    let mut order = Vec::with_capacity(tree.nodes.len());
    order.push(0u32);
    let mut next = 0;
    while next < order.len() {
        let node = &tree.nodes[order[next] as usize];
        if !node.is_leaf() {
            order.extend(children(node));
        }
        next += 1;
    }
    let mut forests = vec![Forest::default(); tree.nodes.len()];
    for &index in order.iter().rev() {
        let node = &tree.nodes[index as usize];
        let area = node.aabb().half_area();
        let leaf_cost = area * LEAF_COST;
        forests[index as usize] = if node.is_leaf() {
            Forest {
                cost: [leaf_cost; WIDTH - 1],
                count: 1,
            }
        } else {
            let [left, right] = children(node).map(|child| forests[child as usize]);
            let count = left.count + right.count;
            let mut cost = [0.0; WIDTH - 1];
            cost[0] = area + distribute(&left, &right, WIDTH).0;
            if count <= leaf_size {
                cost[0] = cost[0].min(leaf_cost);
            }
            for i in 1..WIDTH - 1 {
                cost[i] = cost[i - 1].min(distribute(&left, &right, i + 1).0);
            }
            Forest { cost, count }
        };
    }
    forests
}

/// The least cost of sharing `slots` among two subtrees, and how many the first one gets.
fn distribute(left: &Forest, right: &Forest, slots: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for share in 1..slots {
        let cost = left.cost[share - 1] + right.cost[slots - share - 1];
        if cost < best.0 {
            best = (cost, share);
        }
    }
    best
}

/// Whether the subtree becomes one leaf, given that it takes one slot.
fn is_leaf(tree: &Bvh2, forests: &[Forest], index: u32, leaf_size: u32) -> bool {
    let forest = &forests[index as usize];
    let node = &tree.nodes[index as usize];
    node.is_leaf() || forest.count <= leaf_size && forest.cost[0] >= node.aabb().half_area() * LEAF_COST
}

/// Cuts the subtree into at most `slots` children.
fn descend(tree: &Bvh2, forests: &[Forest], index: u32, mut slots: usize, cut: &mut Vec<Source>) {
    let forest = &forests[index as usize];
    while slots > 1 && forest.cost[slots - 1] >= forest.cost[slots - 2] {
        slots -= 1;
    }
    let node = &tree.nodes[index as usize];
    if slots == 1 || node.is_leaf() {
        cut.push(Source::Binary(index));
        return;
    }
    let [left, right] = children(node);
    let (_, share) = distribute(&forests[left as usize], &forests[right as usize], slots);
    descend(tree, forests, left, share, cut);
    descend(tree, forests, right, slots - share, cut);
}

/// The binary leaves of a subtree. With a list of what is to do, for a tree may be as deep as it has leaves.
fn leaves(tree: &Bvh2, root: u32) -> Vec<u32> {
    let mut leaves = Vec::new();
    let mut todo = vec![root];
    while let Some(index) = todo.pop() {
        let node = &tree.nodes[index as usize];
        if node.is_leaf() {
            leaves.push(index);
        } else {
            todo.extend(children(node));
        }
    }
    leaves
}

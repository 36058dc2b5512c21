//! From the binary to the eight-wide tree, at the least expected cost: Ylitie, Karras, Laine 2017, section 4.
//!
//! Differs: a leaf costs the same whatever it holds, because its triangles are tested together.

use super::bounds::Bounds;
use super::node::{LEAF, Node, WIDTH};
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

/// Cost of testing a pack of triangles, in tests of a node. Higher values give fuller packs.
const LEAF_COST: f32 = 0.8;

/// Largest number of nodes on a path; what the traversal's stack is made for.
pub(super) const MAX_DEPTH: usize = 96;

/// How the subtree of a binary node is best cut into a forest.
#[derive(Clone, Copy, Default)]
struct Forest {
    /// Expected cost when it is cut into at most `i + 1` wide children.
    cost: [f32; WIDTH - 1],
    /// Primitives below.
    count: u32,
}

/// Makes wide nodes of `tree`, appended to `nodes`; returns the root's index. `leaf` stores up to `leaf_size`
/// primitives and returns the index of what it stored. Unused slots of nodes point at the leaf `empty`.
///
/// `None` if the tree is deeper than [`MAX_DEPTH`].
pub(super) fn collapse(
    tree: &Bvh2,
    leaf_size: u32,
    empty: u32,
    nodes: &mut Vec<Node>,
    mut leaf: impl FnMut(&[u32]) -> u32,
) -> Option<u32> {
    let forests = forests(tree, leaf_size);
    let root = nodes.len() as u32;
    nodes.push(Node::new(&[], empty | LEAF));
    let mut todo = vec![(0u32, root, 1usize)];
    let mut primitives = Vec::new();
    let mut cut = Vec::new();
    while let Some((binary, wide, depth)) = todo.pop() {
        if depth > MAX_DEPTH {
            return None;
        }
        cut.clear();
        if tree.nodes[binary as usize].is_leaf() || is_leaf(tree, &forests, binary, leaf_size) && depth == 1 {
            cut.push(binary);
        } else {
            let [left, right] = children(&tree.nodes[binary as usize]);
            let (_, share) = distribute(&forests[left as usize], &forests[right as usize], WIDTH);
            descend(tree, &forests, leaf_size, left, share, &mut cut);
            descend(tree, &forests, leaf_size, right, WIDTH - share, &mut cut);
        }
        let mut slots = [(Bounds::EMPTY, 0); WIDTH];
        for (slot, &child) in slots.iter_mut().zip(&cut) {
            let node = &tree.nodes[child as usize];
            let aabb = node.aabb();
            slot.0 = Bounds {
                min: aabb.min.into(),
                max: aabb.max.into(),
            };
            slot.1 = if node.is_leaf() || is_leaf(tree, &forests, child, leaf_size) {
                primitives.clear();
                gather(tree, child, &mut primitives);
                leaf(&primitives) | LEAF
            } else {
                nodes.push(Node::new(&[], empty | LEAF));
                let index = nodes.len() as u32 - 1;
                todo.push((child, index, depth + 1));
                index
            };
        }
        nodes[wide as usize] = Node::new(&slots[..cut.len()], empty | LEAF);
    }
    Some(root)
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
    forest.count <= leaf_size && forest.cost[0] >= tree.nodes[index as usize].aabb().half_area() * LEAF_COST
}

/// Cuts the subtree into at most `slots` children.
fn descend(tree: &Bvh2, forests: &[Forest], leaf_size: u32, index: u32, mut slots: usize, cut: &mut Vec<u32>) {
    let forest = &forests[index as usize];
    while slots > 1 && forest.cost[slots - 1] >= forest.cost[slots - 2] {
        slots -= 1;
    }
    let node = &tree.nodes[index as usize];
    if slots == 1 || node.is_leaf() {
        cut.push(index);
        return;
    }
    let [left, right] = children(node);
    let (_, share) = distribute(&forests[left as usize], &forests[right as usize], slots);
    descend(tree, forests, leaf_size, left, share, cut);
    descend(tree, forests, leaf_size, right, slots - share, cut);
}

/// The primitives of a small subtree.
fn gather(tree: &Bvh2, index: u32, primitives: &mut Vec<u32>) {
    let node = &tree.nodes[index as usize];
    if node.is_leaf() {
        let first = node.first_index as usize;
        primitives.extend_from_slice(&tree.primitive_indices[first..first + node.prim_count as usize]);
    } else {
        for child in children(node) {
            gather(tree, child, primitives);
        }
    }
}

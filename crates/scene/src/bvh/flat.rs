//! The trees as plain words, for back ends that walk them elsewhere.

use super::node::LEAF;
use super::{Bvh, Node};

/// The acceleration structure without pointers or types: what [`Bvh`] holds, word by word.
#[derive(Clone, Debug)]
pub struct FlatBvh<'b> {
    /// 32 words a node: for each axis the eight lower planes, the eight upper ones and the lower ones again, a byte each, origin and step
    /// of the planes; then the eight children, leaves with the highest bit set.
    pub nodes: &'b [u32],
    /// 80 words a pack of eight triangles: corners by corner, axis, lane; then the tags: index in the mesh, bit 31 for a triangle without
    /// a back, bit 30 for one with holes.
    pub packs: &'b [u32],
    /// Root of the tree of instance 0, if it places its mesh by the identity.
    pub fixed: Option<u32>,
    /// Root of the tree over `placed`.
    pub top: Option<u32>,
    /// By leaf of the top tree: instance, and root of its mesh's tree; `None` for the leaf that stands for no instance.
    pub placed: Vec<Option<[u32; 2]>>,
    /// Entries that a stack must have to walk any mesh's tree.
    pub stack: usize,
    /// The same for the top tree.
    pub top_stack: usize,
}

impl Bvh {
    /// The structure as words.
    pub fn flat(&self) -> FlatBvh<'_> {
        let roots = self.placed.iter().map(|placed| placed.root).filter(|&root| root != 0);
        let mut roots: Vec<u32> = self.fixed.into_iter().chain(roots).collect();
        roots.sort_unstable();
        roots.dedup();
        FlatBvh {
            nodes: bytemuck::cast_slice(&self.nodes),
            packs: bytemuck::cast_slice(&self.packs),
            fixed: self.fixed,
            top: self.top,
            placed: self
                .placed
                .iter()
                .map(|placed| (placed.root != 0).then_some([placed.instance, placed.root]))
                .collect(),
            stack: roots
                .iter()
                .map(|&root| stack_below(&self.nodes, root))
                .max()
                .unwrap_or(0),
            top_stack: self.top.map_or(0, |root| stack_below(&self.nodes, root)),
        }
    }
}

/// Most children that wait at once while the tree is walked in whatever order.
fn stack_below(nodes: &[Node], root: u32) -> usize {
    let mut most = 0;
    let mut open = vec![(root, 0)];
    while let Some((node, waiting)) = open.pop() {
        most = most.max(waiting);
        if node & LEAF != 0 {
            continue;
        }
        // Unused slots are never met.
        let node = &nodes[node as usize];
        let used = (0..node.child.len()).filter(|&lane| node.slabs[0].planes[lane] <= node.slabs[0].planes[lane + 8]);
        let children: Vec<u32> = used.map(|lane| node.child[lane]).collect();
        let waiting = waiting + children.len();
        most = most.max(waiting);
        open.extend(children.into_iter().map(|child| (child, waiting - 1)));
    }
    most
}

//! The trees as plain words, for back ends that walk them elsewhere.

use super::node::LEAF;
use super::tree::Tree;
use super::{Bvh, Node};
use crate::SceneParts;

/// The acceleration structure without pointers or types: what [`Bvh`] holds, word by word, the trees of all meshes one after another.
#[derive(Clone, Debug)]
pub struct FlatBvh {
    nodes: Vec<Node>,
    packs: Vec<super::Pack>,
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

impl FlatBvh {
    /// 32 words a node: for each axis the eight lower planes, the eight upper ones and the lower ones again, a byte each, origin and step
    /// of the planes; then the eight children, leaves with the highest bit set.
    pub fn nodes(&self) -> &[u32] {
        bytemuck::cast_slice(&self.nodes)
    }

    /// 80 words a pack of eight triangles: corners by corner, axis, lane; then the tags: index in the mesh, bit 31 for a triangle without
    /// a back, bit 30 for one with holes.
    pub fn packs(&self) -> &[u32] {
        bytemuck::cast_slice(&self.packs)
    }

    /// Appends a tree; returns its root.
    fn append(&mut self, tree: &Tree) -> u32 {
        let first_pack = self.packs.len() as u32;
        self.packs.extend_from_slice(&tree.packs);
        let root = self.append_nodes(&tree.nodes, first_pack) + tree.root;
        self.stack = self.stack.max(stack_below(&self.nodes, root));
        root
    }

    /// Appends nodes whose leaves are numbered from `first_leaf` on; returns the index of the first.
    fn append_nodes(&mut self, nodes: &[Node], first_leaf: u32) -> u32 {
        let first = self.nodes.len() as u32;
        self.nodes.extend(nodes.iter().map(|node| {
            let child = node.child.map(|child| match child & LEAF {
                0 => child + first,
                _ => child + first_leaf,
            });
            Node { child, ..*node }
        }));
        first
    }
}

impl Bvh {
    /// The structure as words. All trees are built that were not needed so far.
    pub fn flat(&self, parts: &SceneParts) -> FlatBvh {
        self.build_all(parts);
        let mut flat = FlatBvh {
            nodes: Vec::new(),
            packs: Vec::new(),
            fixed: None,
            top: None,
            placed: Vec::new(),
            stack: 0,
            top_stack: 0,
        };
        let mut roots = vec![None; parts.meshes.len()];
        flat.fixed = self.fixed.as_ref().map(|fixed| {
            let root = flat.append(&fixed.tree);
            roots[fixed.mesh] = Some(root);
            root
        });
        for &instance in &self.placed {
            let mesh = parts.instances[instance as usize].mesh;
            let root = *roots[mesh as usize].get_or_insert_with(|| flat.append(self.tree(parts, mesh)));
            flat.placed.push(Some([instance, root]));
        }
        if let Some(top) = &self.top {
            flat.placed.push(None);
            let root = flat.append_nodes(&top.nodes, 0) + top.root;
            flat.top_stack = stack_below(&flat.nodes, root);
            flat.top = Some(root);
        }
        flat
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

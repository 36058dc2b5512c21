//! The tree of one mesh, in the mesh's own space.

use super::bounds::Bounds;
use super::node::{self, Node};
use super::pack::Pack;
use super::{bvh2, collapse};
use crate::memory::Weigh;
use crate::{Material, Mesh};
use glam::Vec3;

/// Nodes and triangles of a mesh.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// The first one is empty.
    pub(super) packs: Vec<Pack>,
    pub(super) root: u32,
}

impl Tree {
    /// Builds it. Triangles without area are left out; where no others are, nothing can be hit.
    pub(super) fn build(mesh: &Mesh, materials: &[Material]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            packs: vec![Pack::EMPTY],
            root: 0,
        };
        let has_area = |triangle: &u32| {
            let [a, b, c] = mesh.corners(*triangle as usize).map(Vec3::as_dvec3);
            (b - a).cross(c - a).length_squared() > 0.0
        };
        let triangles: Vec<u32> = (0..mesh.len() as u32).filter(has_area).collect();
        if triangles.is_empty() {
            tree.nodes.push(Node::new(&[], node::LEAF));
            return tree;
        }
        let boxes: Vec<Bounds> = triangles
            .iter()
            .map(|&triangle| Bounds::of_triangle(mesh.corners(triangle as usize)))
            .collect();
        let binary = bvh2::build(&boxes);
        drop(boxes);
        let packs = &mut tree.packs;
        tree.root = collapse::collapse(&binary, node::WIDTH as u32, 0, &mut tree.nodes, |boxes| {
            let triangles = boxes.iter().map(|&index| triangles[index as usize]);
            packs.push(Pack::new(mesh, materials, triangles));
            packs.len() as u32 - 1
        });
        tree.nodes.shrink_to_fit();
        tree.packs.shrink_to_fit();
        tree
    }
}

impl Weigh for Tree {
    fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.packs)
    }
}

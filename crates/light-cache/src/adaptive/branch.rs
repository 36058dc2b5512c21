//! What an entry of a cut stands for: a node of the light tree, one light, or all lights at infinity.

use crate::tree::{LEAF, MAX_LEAF_LIGHTS, Tree};

/// A part of the light tree, in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(super) struct Branch(u32);

const LIGHT: u32 = 1 << 31;

impl Branch {
    /// All lights at infinity: they stand beside the tree and are not told apart here.
    pub(super) const DISTANT: Self = Self(u32::MAX);

    /// The whole tree.
    pub(super) const ROOT: Self = Self(0);

    /// As it is stored: the highest bit says that the others are one light's place; all ones are the lights at infinity.
    pub(super) fn bits(self) -> u32 {
        self.0
    }

    /// Whether it is a branch of `tree`.
    pub(super) fn is_in(self, tree: &Tree) -> bool {
        match (self.light(), self.node()) {
            (Some(place), _) => (place as usize) < tree.leaves.len(),
            (_, Some(node)) => tree.nodes.get(node as usize).is_some_and(|node| node.count > 0),
            _ => !tree.distant.is_empty(),
        }
    }

    /// The branch that tree node `node` is.
    pub(super) fn of_node(tree: &Tree, node: u32) -> Self {
        let n = &tree.nodes[node as usize];
        if n.count == 1 {
            Self(LIGHT | n.first)
        } else {
            Self(node)
        }
    }

    /// The light (its place in tree order) that this branch consists of, if it is one.
    #[inline]
    pub(super) fn light(self) -> Option<u32> {
        (self.0 & LIGHT != 0 && self != Self::DISTANT).then_some(self.0 & !LIGHT)
    }

    /// The tree node, if the branch is a cluster.
    #[inline]
    pub(super) fn node(self) -> Option<u32> {
        (self.0 & LIGHT == 0).then_some(self.0)
    }

    /// First light, in tree order.
    pub(super) fn first(self, tree: &Tree) -> u32 {
        match (self.light(), self.node()) {
            (Some(place), _) => place,
            (_, Some(node)) => tree.nodes[node as usize].first,
            _ => tree.leaves.len() as u32,
        }
    }

    /// How many lights it holds.
    pub(super) fn count(self, tree: &Tree) -> u32 {
        match (self.light(), self.node()) {
            (Some(_), _) => 1,
            (_, Some(node)) => tree.nodes[node as usize].count,
            _ => tree.distant.len() as u32,
        }
    }

    /// The parts it falls into, in tree order: none for a light and for the lights at infinity.
    pub(super) fn children(self, tree: &Tree) -> ([Self; MAX_LEAF_LIGHTS], usize) {
        let mut children = [Self::DISTANT; MAX_LEAF_LIGHTS];
        let Some(node) = self.node() else { return (children, 0) };
        let node = &tree.nodes[node as usize];
        if node.child == LEAF {
            for (child, place) in children.iter_mut().zip(node.first..node.first + node.count) {
                *child = Self(LIGHT | place);
            }
            (children, node.count as usize)
        } else {
            children[0] = Self::of_node(tree, node.child);
            children[1] = Self::of_node(tree, node.child + 1);
            (children, 2)
        }
    }

    /// The branch that this one is a child of, if any.
    pub(super) fn parent(self, tree: &Tree) -> Option<Self> {
        if self == Self::DISTANT {
            return None;
        }
        let place = self.first(tree);
        let (mut branch, mut parent) = (Self::ROOT, None);
        while branch != self {
            let (children, count) = branch.children(tree);
            parent = Some(branch);
            branch = *children[..count]
                .iter()
                .rev()
                .find(|child| child.first(tree) <= place)?;
        }
        parent
    }
}

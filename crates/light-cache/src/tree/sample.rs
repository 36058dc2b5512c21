//! Walking the tree: drawing a light, and the probability of one. Both cut the same interval with the same arithmetic.

use super::interval::{probability, split, split_among};
use super::{LEAF, MAX_LEAF_LIGHTS, Node, Receiver, Tree};

/// Nodes that the estimate of the tree's irradiance at a point is refined to where lights at infinity compete with it.
const REFINED_NODES: usize = 8;

/// The tree as seen from one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Descent<'t> {
    tree: &'t Tree,
    receiver: Receiver,
    /// Importance of all lights with a place.
    near: f32,
    /// Importance of all lights at infinity.
    far: f32,
}

impl<'t> Descent<'t> {
    /// Looks at the tree from `receiver`.
    #[inline]
    pub(crate) fn new(tree: &'t Tree, receiver: Receiver) -> Self {
        let mut descent = Self {
            tree,
            receiver,
            near: 0.0,
            far: 0.0,
        };
        if let Some(root) = tree.nodes.first() {
            descent.near = descent.one_level_below(root);
        }
        if !tree.distant.is_empty() {
            descent.far = (0..tree.distant.len()).map(|i| descent.distant(i)).sum();
            if descent.far > 0.0 && descent.near > 0.0 {
                descent.near = descent.refined();
            }
        }
        descent
    }

    /// The same for draws inside one cluster only ([`Descent::draw_in`]): nothing is worked out beforehand.
    #[inline]
    pub(crate) fn inside(tree: &'t Tree, receiver: Receiver) -> Self {
        Self {
            tree,
            receiver,
            near: 0.0,
            far: 0.0,
        }
    }

    /// Whether any light can contribute here; if not, nothing may be drawn.
    #[inline]
    pub(crate) fn alive(&self) -> bool {
        self.near > 0.0 || self.far > 0.0
    }

    /// Draws a light (its place in tree order) by the position `x` in an interval of `width`; returns with it the
    /// width that is the light's own.
    #[inline]
    pub(crate) fn draw(&self, x: u64, width: u64) -> (u32, u64) {
        let near = self.near_part(width);
        if x >= near {
            return self.draw_in(None, x - near, width - near);
        }
        let Some((first, left)) = self.first_of_two(near) else {
            return self.draw_in(Some(0), x, near);
        };
        if x < left {
            self.draw_in(Some(first), x, left)
        } else {
            self.draw_in(Some(first + 1), x - left, near - left)
        }
    }

    /// If the root's children are of different standing: the first of them, and its part of an interval of `width`.
    #[inline]
    fn first_of_two(&self, width: u64) -> Option<(u32, u64)> {
        let least = self.tree.least_second;
        if least <= 0.0 {
            return None;
        }
        let root = &self.tree.nodes[0];
        let [first, second] = self.children(root).map(|child| self.receiver.group(child));
        let second = if second > 0.0 {
            second.max(first * (least / (1.0 - least)))
        } else {
            0.0
        };
        let counts = self.children(root).map(|child| child.count);
        Some((root.child, split_among(width, first, second, counts)))
    }

    /// The part of an interval of `width` that goes to the lights with a place.
    #[inline]
    fn near_part(&self, width: u64) -> u64 {
        let counts = [self.tree.leaves.len() as u32, self.tree.distant.len() as u32];
        split_among(width, self.near, self.far, counts)
    }

    /// The part of an interval of `width` that goes to the first of two nodes.
    #[inline]
    fn first_part(&self, width: u64, first: &Node, second: &Node) -> u64 {
        let counts = [first.count, second.count];
        split_among(width, self.receiver.group(first), self.receiver.group(second), counts)
    }

    /// The width that the light at `place` owns of an interval of `width`.
    #[inline]
    pub(crate) fn width_of(&self, place: u32, width: u64) -> u64 {
        let near = self.near_part(width);
        if (place as usize) >= self.tree.leaves.len() {
            return self.width_in(None, place, width - near);
        }
        match self.first_of_two(near) {
            None => self.width_in(Some(0), place, near),
            Some((first, left)) if place < self.tree.nodes[first as usize + 1].first => {
                self.width_in(Some(first), place, left)
            }
            Some((first, left)) => self.width_in(Some(first + 1), place, near - left),
        }
    }

    /// Like [`Descent::draw`] among the lights of one node; without a node, among the lights at infinity.
    #[inline]
    pub(crate) fn draw_in(&self, node: Option<u32>, mut x: u64, mut width: u64) -> (u32, u64) {
        let Some(node) = node else {
            return self.draw_distant(x, width);
        };
        let mut node = &self.tree.nodes[node as usize];
        while node.child != LEAF {
            let [first, second] = self.children(node);
            let left = self.first_part(width, first, second);
            (node, x, width) = if x < left {
                (first, x, left)
            } else {
                (second, x - left, width - left)
            };
        }
        let weights = self.leaf(node);
        let left = first_pair(width, &weights);
        let (pair, x, width) = if x < left {
            (0, x, left)
        } else {
            (2, x - left, width - left)
        };
        let left = split(width, weights[pair], weights[pair + 1]);
        let (slot, width) = if x < left {
            (pair, left)
        } else {
            (pair + 1, width - left)
        };
        (node.first + slot as u32, width)
    }

    /// Like [`Descent::width_of`] among the lights of one node; without a node, among the lights at infinity.
    #[inline]
    pub(crate) fn width_in(&self, node: Option<u32>, place: u32, mut width: u64) -> u64 {
        let Some(node) = node else {
            return self.width_of_distant(place as usize - self.tree.leaves.len(), width);
        };
        let mut node = &self.tree.nodes[node as usize];
        while node.child != LEAF {
            let [first, second] = self.children(node);
            let left = self.first_part(width, first, second);
            (node, width) = if place < second.first {
                (first, left)
            } else {
                (second, width - left)
            };
            if width == 0 {
                return 0;
            }
        }
        self.width_of_slot(&self.leaf(node), (place - node.first) as usize, width)
    }

    /// Adds to `sum`, which is in scene order, the probability of every light: its part of an interval of `width`, and the width `floor` that each has.
    pub(crate) fn add_probabilities(&self, floor: u64, width: u64, sum: &mut [f64]) {
        let near = self.near_part(width);
        for place in 0..self.tree.distant.len() {
            let own = floor + self.width_of_distant(place, width - near);
            sum[self.tree.distant[place].index as usize] += f64::from(probability(own));
        }
        let Some(root) = self.tree.nodes.first() else { return };
        let mut open = match self.first_of_two(near) {
            None => vec![(root, near)],
            Some((_, left)) => {
                let [first, second] = self.children(root);
                vec![(second, near - left), (first, left)]
            }
        };
        while let Some((node, width)) = open.pop() {
            if node.child == LEAF {
                let weights = self.leaf(node);
                for slot in 0..node.count as usize {
                    let own = floor + self.width_of_slot(&weights, slot, width);
                    let leaf = &self.tree.leaves[node.first as usize + slot];
                    sum[leaf.index() as usize] += f64::from(probability(own));
                }
            } else {
                let [first, second] = self.children(node);
                let left = self.first_part(width, first, second);
                open.extend([(second, width - left), (first, left)]);
            }
        }
    }

    #[inline]
    fn children(&self, node: &Node) -> [&'t Node; 2] {
        let pair = &self.tree.nodes[node.child as usize..][..2];
        [&pair[0], &pair[1]]
    }

    /// Importances of a leaf's lights. If all are zero, those that exist are alike: the descent came in on bounds that
    /// promised more, and what is drawn contributes nothing.
    #[inline]
    fn leaf(&self, node: &Node) -> [f32; MAX_LEAF_LIGHTS] {
        let lights = &self.tree.leaves[node.first as usize..][..node.count as usize];
        let mut weights = [0.0; MAX_LEAF_LIGHTS];
        for (weight, light) in weights.iter_mut().zip(lights) {
            *weight = self.receiver.light(light);
        }
        if weights.iter().all(|&weight| weight <= 0.0) {
            weights[..lights.len()].fill(1.0);
        }
        weights
    }

    #[inline]
    fn width_of_slot(&self, weights: &[f32; MAX_LEAF_LIGHTS], slot: usize, width: u64) -> u64 {
        let left = first_pair(width, weights);
        let (pair, width) = if slot < 2 { (0, left) } else { (2, width - left) };
        let left = split(width, weights[pair], weights[pair + 1]);
        if slot == pair { left } else { width - left }
    }

    /// Importance of what lies below `node`: of its children, or of its lights.
    #[inline]
    fn one_level_below(&self, node: &Node) -> f32 {
        if node.child == LEAF {
            let lights = &self.tree.leaves[node.first as usize..][..node.count as usize];
            lights.iter().map(|light| self.receiver.light(light)).sum()
        } else {
            let [first, second] = self.children(node);
            self.receiver.group(first) + self.receiver.group(second)
        }
    }

    /// Importance of the whole tree from several of its nodes: seen from inside, the root alone says too little.
    fn refined(&self) -> f32 {
        let mut nodes = [(0.0, &self.tree.nodes[0]); REFINED_NODES];
        nodes[0].0 = self.near;
        for used in 1..REFINED_NODES {
            let inner = nodes[..used]
                .iter()
                .enumerate()
                .filter(|(_, (_, node))| node.child != LEAF);
            let Some((largest, _)) = inner.max_by(|(_, a), (_, b)| a.0.total_cmp(&b.0)) else {
                break;
            };
            let [first, second] = self.children(nodes[largest].1);
            nodes[largest] = (self.one_level_below(first), first);
            nodes[used] = (self.one_level_below(second), second);
        }
        let sum = nodes.iter().map(|(importance, _)| importance).sum::<f32>();
        if sum > 0.0 { sum } else { self.near }
    }

    /// Importance of a light at infinity.
    #[inline]
    fn distant(&self, index: usize) -> f32 {
        let light = &self.tree.distant[index];
        light.weight * (-self.receiver.normal.dot(light.direction)).max(0.0)
    }

    /// The lights at infinity, one after the other: scenes have few.
    fn draw_distant(&self, x: u64, width: u64) -> (u32, u64) {
        let mut ends = DistantEnds::new(self, width);
        let mut start = 0;
        let mut drawn = (0, 0);
        for index in 0..self.tree.distant.len() {
            let end = ends.next(self.distant(index));
            if end > start {
                drawn = (index, end - start);
                if x < end {
                    break;
                }
            }
            start = end;
        }
        ((self.tree.leaves.len() + drawn.0) as u32, drawn.1)
    }

    fn width_of_distant(&self, index: usize, width: u64) -> u64 {
        let mut ends = DistantEnds::new(self, width);
        let start = (0..index).map(|i| ends.next(self.distant(i))).last().unwrap_or(0);
        ends.next(self.distant(index)) - start
    }
}

/// The part of an interval of `width` that goes to the first two lights of a leaf.
#[inline]
fn first_pair(width: u64, weights: &[f32; MAX_LEAF_LIGHTS]) -> u64 {
    let positive = |a: f32, b: f32| u32::from(a > 0.0) + u32::from(b > 0.0);
    let [a, b, c, d] = *weights;
    split_among(width, a + b, c + d, [positive(a, b), positive(c, d)])
}

/// Where each light at infinity ends in an interval: running sums in `f64`, one unit set aside for each that is not zero.
struct DistantEnds {
    sum: f64,
    total: f64,
    spare: u64,
    used: u64,
    left: u64,
    width: u64,
}

impl DistantEnds {
    fn new(descent: &Descent<'_>, width: u64) -> Self {
        let weights = || {
            (0..descent.tree.distant.len())
                .map(|i| descent.distant(i))
                .filter(|&w| w > 0.0)
        };
        let count = weights().count() as u64;
        Self {
            sum: 0.0,
            total: weights().map(f64::from).sum(),
            spare: width.saturating_sub(count),
            used: 0,
            left: count,
            width,
        }
    }

    /// End of the next light, whose importance is `weight`.
    fn next(&mut self, weight: f32) -> u64 {
        if weight > 0.0 {
            self.sum += f64::from(weight);
            self.used += 1;
            self.left -= 1;
        }
        if self.left == 0 {
            return self.width;
        }
        ((self.spare as f64 * (self.sum / self.total)) as u64).min(self.spare) + self.used.min(self.width - self.spare)
    }
}

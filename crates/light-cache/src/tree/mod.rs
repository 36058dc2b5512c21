//! A tree over the lights, with bounds that tell how much a group may matter at a point.
//!
//! Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", without the splitting: one random
//! number walks from the root to one light. Lights at infinity stand beside the root.
//!
//! Nodes lie depth first with siblings side by side, and a node's lights are a contiguous range in *tree order*, so a
//! subtree is a range of nodes and a range of lights, and stratified random numbers choose stratified lights.

mod bounds;
mod brightest;
mod build;
mod floor;
mod importance;
mod interval;
mod sample;
mod sampler;

pub(crate) use bounds::{Emission, LeafLight, strength};
pub(crate) use brightest::CellReceiver;
pub(crate) use floor::Floor;
pub(crate) use importance::Receiver;
pub(crate) use interval::{PER_U32, UNIT, position, probability};
pub(crate) use sample::Descent;
pub use sampler::TreeSampler;

use crate::state::is_amount;
use glam::Vec3;
use scene::{Light, LightKind};

/// [`Node::child`] of a leaf.
pub(crate) const LEAF: u32 = u32::MAX;
/// Lights per leaf: they are looked at one by one, which is as cheap as two more levels and more exact.
pub(crate) const MAX_LEAF_LIGHTS: usize = 4;

/// A group of lights: one cache line.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// Middle of the box around the lights, world space.
    pub(crate) center: Vec3,
    /// Half the size of the box, metres.
    pub(crate) half: Vec3,
    /// Axis of the cone of normals.
    pub(crate) axis: Vec3,
    /// Cosine of the cone's half angle; -1: all directions.
    pub(crate) cos_o: f32,
    /// Its sine.
    pub(crate) sin_o: f32,
    /// Cosine of the angle around each normal beyond which nothing is emitted.
    pub(crate) cos_e: f32,
    /// Sum of the lights' strengths, in units of the strongest, each times what was learned about it.
    pub(crate) weight: f32,
    /// First light, in tree order.
    pub(crate) first: u32,
    /// Number of lights.
    pub(crate) count: u32,
    /// Index of the first of two children, or [`LEAF`].
    pub(crate) child: u32,
}

impl Default for Node {
    fn default() -> Self {
        Self {
            center: Vec3::ZERO,
            half: Vec3::ZERO,
            axis: Vec3::Z,
            cos_o: -1.0,
            sin_o: 0.0,
            cos_e: 0.0,
            weight: 0.0,
            first: 0,
            count: 0,
            child: LEAF,
        }
    }
}

/// A light at infinity.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct DistantLight {
    /// Unit direction the light goes.
    pub(crate) direction: Vec3,
    /// Irradiance in units of the strongest light, times what was learned.
    pub(crate) weight: f32,
    /// Index in the scene.
    pub(crate) index: u32,
}

/// The tree, and the lights in its order.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Tree {
    /// Root first; empty if there are no lights with a place.
    pub(crate) nodes: Vec<Node>,
    /// Lights with a place, in tree order.
    pub(crate) leaves: Vec<LeafLight>,
    /// Lights without: they follow the others in tree order.
    pub(crate) distant: Vec<DistantLight>,
    /// Tree order by scene index.
    pub(crate) rank: Vec<u32>,
    /// Least share that the root's second child has of all lights with a place, wherever it has any; see [`Tree::regrouped`].
    pub(crate) least_second: f32,
}

impl Tree {
    /// The tree over `lights`.
    pub(crate) fn new(lights: &[Light]) -> Self {
        let strongest = lights.iter().map(bounds::strength).fold(0.0, f64::max);
        let mut leaves = Vec::with_capacity(lights.len());
        let mut distant = Vec::new();
        for (index, light) in (0u32..).zip(lights) {
            if light.kind == LightKind::Directional {
                distant.push(DistantLight {
                    direction: light.normal_ws,
                    weight: bounds::relative_weight(bounds::strength(light), strongest),
                    index,
                });
            } else {
                leaves.push(LeafLight::new(light, index, strongest));
            }
        }
        Self::over(leaves, distant, lights, None, 0.0)
    }

    /// The same lights in another tree: those at the places that are `preferred` lie below the root's first child, the others below
    /// its second, which has `least_second` of all samples at least, wherever its lights shine at all: bounds
    /// around lights that lie all over the scene tell little of those nearby. `strengths`: what the lights weigh, in the tree order of `self`.
    pub(crate) fn regrouped(&self, lights: &[Light], strengths: &[f32], preferred: &[bool], least_second: f32) -> Self {
        let of = |wanted: bool| {
            let weighed = self.leaves.iter().zip(strengths).zip(preferred);
            let chosen = weighed.filter(move |&(_, &is)| is == wanted);
            chosen.map(|((leaf, &weight), _)| leaf.with_weight(weight))
        };
        let leaves: Vec<LeafLight> = of(true).chain(of(false)).collect();
        let first = of(true).count();
        let both = first > 0 && first < leaves.len();
        Self::over(
            leaves,
            self.distant.clone(),
            lights,
            both.then_some(first),
            if both { least_second } else { 0.0 },
        )
    }

    fn over(
        mut leaves: Vec<LeafLight>,
        distant: Vec<DistantLight>,
        lights: &[Light],
        first_split: Option<usize>,
        least_second: f32,
    ) -> Self {
        let nodes = build::build(&mut leaves, lights, first_split);
        let mut rank = vec![0; lights.len()];
        let order = leaves
            .iter()
            .map(LeafLight::index)
            .chain(distant.iter().map(|d| d.index));
        for (place, index) in (0u32..).zip(order) {
            rank[index as usize] = place;
        }
        Self {
            nodes,
            leaves,
            distant,
            rank,
            least_second,
        }
    }

    /// Luminance of the irradiance that importance 1 stands for.
    pub(crate) fn unit(lights: &[Light]) -> f32 {
        lights
            .iter()
            .map(bounds::strength)
            .fold(f64::from(f32::MIN_POSITIVE), f64::max) as f32
    }

    /// Number of lights.
    pub(crate) fn len(&self) -> usize {
        self.rank.len()
    }

    /// Scene index of the light at `place` in tree order.
    #[inline]
    pub(crate) fn light_at(&self, place: u32) -> u32 {
        match self.leaves.get(place as usize) {
            Some(leaf) => leaf.index(),
            None => self.distant[place as usize - self.leaves.len()].index,
        }
    }

    /// Whether it is a tree over the lights of `other`, which may lie in another order and have other weights.
    pub(crate) fn is_sound_like(&self, other: &Self) -> bool {
        self.leaves.len() == other.leaves.len()
            && self.distant.len() == other.distant.len()
            && self.rank.len() == other.rank.len()
            && (0.0..1.0).contains(&self.least_second)
            && (0..).zip(&self.leaves).all(|(place, leaf)| {
                let index = leaf.index() as usize;
                let same = other
                    .rank
                    .get(index)
                    .and_then(|&place| other.leaves.get(place as usize));
                self.rank.get(index) == Some(&place)
                    && is_amount(leaf.weight)
                    && same.is_some_and(|same| same.with_weight(leaf.weight) == *leaf)
            })
            && (self.leaves.len()..)
                .zip(self.distant.iter().zip(&other.distant))
                .all(|(place, (light, same))| {
                    self.rank.get(light.index as usize) == Some(&(place as u32))
                        && is_amount(light.weight)
                        && *light
                            == DistantLight {
                                weight: light.weight,
                                ..*same
                            }
                })
            && self.has_sound_nodes()
    }

    /// Whether every node's lights are those of its children, which come after it, and those of the root are all.
    fn has_sound_nodes(&self) -> bool {
        let all = self.nodes.first().map_or(0, |root| root.count as usize);
        let ends_right = |node: &Node| (u64::from(node.first) + u64::from(node.count)) as usize <= self.leaves.len();
        all == self.leaves.len()
            && (0..).zip(&self.nodes).all(|(index, node): (u32, _)| {
                let [first, second] = [node.child, node.child.wrapping_add(1)].map(|i| self.nodes.get(i as usize));
                let numbers = [
                    node.center,
                    node.half,
                    node.axis,
                    Vec3::new(node.cos_o, node.sin_o, node.cos_e),
                ];
                ends_right(node)
                    && is_amount(node.weight)
                    && numbers.iter().all(|numbers| numbers.is_finite())
                    && match (first, second) {
                        _ if node.child == LEAF => node.count as usize <= MAX_LEAF_LIGHTS,
                        (Some(first), Some(second)) => {
                            node.child > index
                                && [first, second].iter().all(|child| child.count > 0 && ends_right(child))
                                && first.first == node.first
                                && second.first == first.first + first.count
                                && node.count == first.count + second.count
                        }
                        _ => false,
                    }
            })
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.leaves[..])
            + size_of_val(&self.distant[..])
            + size_of_val(&self.rank[..])
    }
}

//! The strongest lights of a region, found without looking at all.

use super::bounds::{Emission, LeafLight};
use super::{LEAF, Node, Tree};
use glam::Vec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A ball in which light is wanted, on surfaces that face anywhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellReceiver {
    /// Middle, world space.
    pub(crate) center: Vec3,
    /// Radius, metres.
    pub(crate) radius: f32,
}

impl CellReceiver {
    /// Irradiance at a distance, on a surface that faces the source; inside the clamp sources are as near as half the extent.
    fn falloff(&self, to: Vec3, extent: f32) -> f32 {
        let reach = 0.5 * (self.radius + extent);
        1.0 / to.length_squared().max(reach * reach).max(f32::MIN_POSITIVE)
    }

    /// Cosine of the least angle at which the cell is seen from the emitter.
    fn cos_emitter(&self, to: Vec3, extent: f32, axis: Vec3, cos_o: f32, sin_o: f32) -> f32 {
        let distance = to.length();
        let blur = self.radius + extent;
        if distance <= blur || cos_o <= -1.0 {
            return 1.0;
        }
        let sin_u = blur / distance;
        let cos_u = (1.0 - sin_u * sin_u).max(0.0).sqrt();
        let less = |cos: f32, cos_by: f32, sin_by: f32| {
            if cos >= cos_by {
                1.0
            } else {
                cos * cos_by + (1.0 - cos * cos).max(0.0).sqrt() * sin_by
            }
        };
        less(less(-axis.dot(to) / distance, cos_o, sin_o), cos_u, sin_u)
    }

    fn group(&self, node: &Node) -> f32 {
        let to = node.center - self.center;
        let radius = node.half.length();
        let cos = self.cos_emitter(to, radius, node.axis, node.cos_o, node.sin_o);
        if cos <= node.cos_e {
            0.0
        } else {
            node.weight * cos.max(0.0) * self.falloff(to, radius)
        }
    }

    fn light(&self, light: &LeafLight) -> f32 {
        let to = light.center - self.center;
        let cos = match light.emission() {
            Emission::OneSided => self.cos_emitter(to, light.radius, light.axis, 1.0, 0.0).max(0.0),
            Emission::TwoSided => 1.0,
            Emission::Point => light.attenuation(to.length() - self.radius, 1.0),
        };
        light.weight * cos * self.falloff(to, light.radius)
    }
}

/// A node that waits to be opened.
struct Open {
    importance: f32,
    node: u32,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        // Ties by index: the result must not depend on anything else.
        self.importance
            .total_cmp(&other.importance)
            .then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

impl Tree {
    /// About the `count` strongest lights (scene index, irradiance in units of the strongest light) in a cell, best
    /// first search by the nodes' importance; and the importance of all that was not looked at.
    pub(crate) fn brightest(&self, cell: &CellReceiver, count: usize) -> (Vec<(u32, f32)>, f32) {
        let mut found: Vec<(u32, f32)> = self.distant.iter().map(|light| (light.index, light.weight)).collect();
        let mut open = BinaryHeap::new();
        if let Some(root) = self.nodes.first() {
            open.push(Open {
                importance: cell.group(root),
                node: 0,
            });
        }
        while found.len() < count
            && let Some(Open { node, .. }) = open.pop()
        {
            let node = &self.nodes[node as usize];
            if node.child == LEAF {
                let lights = &self.leaves[node.first as usize..][..node.count as usize];
                let lit = lights.iter().map(|light| (light.index(), cell.light(light)));
                found.extend(lit.filter(|&(_, importance)| importance > 0.0));
            } else {
                open.extend([node.child, node.child + 1].map(|child| Open {
                    importance: cell.group(&self.nodes[child as usize]),
                    node: child,
                }));
            }
        }
        (found, open.iter().map(|open| open.importance).sum())
    }
}

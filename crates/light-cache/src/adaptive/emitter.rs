//! What an entry of a cut sends to a point: a smooth estimate without branches, alike for a light and for a cluster,
//! so that a whole cut is evaluated at once.

use super::branch::Branch;
use crate::tree::{Emission, LeafLight, Node, Receiver, Tree};
use glam::Vec3;

/// Cosine of a cone's half angle above which all of a cluster's lights face the same way.
const PARALLEL: f32 = 0.999_999;
/// Squares of distances are at least this, so that their inverses stay in range.
const TINY_SQ: f32 = 1e-18;
/// Subtracted from the height of a point behind a one-sided emitter.
const ONE_SIDED: f32 = 1e30;

/// A light or a cluster of lights as a ball of light, in numbers that need no case distinction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emitter {
    /// Middle, world space.
    pub(super) center: Vec3,
    /// Normal or spot axis; zero if light goes out alike in all directions.
    pub(super) axis: Vec3,
    /// Radius of the ball around it.
    pub(super) radius: f32,
    /// 1 / (4 radius), finite.
    pub(super) quarter_inverse_radius: f32,
    /// How far its lights lie above or below the middle, along the axis.
    pub(super) depth: f32,
    /// 1 / (4 depth), finite.
    pub(super) quarter_inverse_depth: f32,
    /// 0 if it sends light to both sides, [`ONE_SIDED`] if only to one.
    pub(super) one_sided: f32,
    /// 1 if there is no cosine at the emitter, else 0.
    pub(super) isotropic: f32,
    /// Strength in units of the tree's strongest light, times what has been learned.
    pub(super) weight: f32,
    /// What arrives at every point alike (lights at infinity).
    pub(super) everywhere: f32,
    /// See [`LeafLight::cone_scale`].
    pub(super) cone_scale: f32,
    /// See [`LeafLight::cone_offset`].
    pub(super) cone_offset: f32,
    /// See [`LeafLight::inverse_range_sq`].
    pub(super) inverse_range_sq: f32,
}

impl Emitter {
    /// Nothing.
    pub(super) const DARK: Self = Self {
        center: Vec3::ZERO,
        axis: Vec3::ZERO,
        radius: 0.0,
        quarter_inverse_radius: 0.0,
        depth: 0.0,
        quarter_inverse_depth: 0.0,
        one_sided: 0.0,
        isotropic: 0.0,
        weight: 0.0,
        everywhere: 0.0,
        cone_scale: 0.0,
        cone_offset: 1.0,
        inverse_range_sq: 0.0,
    };

    /// The emitter that `branch` is, as strong as the tree believes it to be now.
    pub(super) fn of(tree: &Tree, branch: Branch) -> Self {
        match (branch.light(), branch.node()) {
            (Some(place), _) => Self::light(&tree.leaves[place as usize]),
            (_, Some(node)) => Self::cluster(&tree.nodes[node as usize]),
            _ => Self {
                everywhere: tree.distant.iter().map(|light| light.weight).sum(),
                ..Self::DARK
            },
        }
    }

    fn light(light: &LeafLight) -> Self {
        let point = light.emission() == Emission::Point;
        Self {
            center: light.center,
            axis: light.axis,
            radius: light.radius,
            quarter_inverse_radius: 0.25 / light.radius.max(TINY_SQ),
            // Spots too: their cosine keeps its sign.
            one_sided: if light.emission() == Emission::TwoSided {
                0.0
            } else {
                ONE_SIDED
            },
            isotropic: if point { 1.0 } else { 0.0 },
            weight: light.weight,
            cone_scale: light.cone_scale,
            cone_offset: light.cone_offset,
            inverse_range_sq: light.inverse_range_sq,
            ..Self::DARK
        }
    }

    fn cluster(node: &Node) -> Self {
        let radius = node.half.length();
        let one_way = node.cos_o >= PARALLEL;
        let depth = if one_way { node.axis.abs().dot(node.half) } else { 0.0 };
        Self {
            center: node.center,
            axis: if one_way { node.axis } else { Vec3::ZERO },
            radius,
            quarter_inverse_radius: 0.25 / radius.max(TINY_SQ),
            depth,
            quarter_inverse_depth: 0.25 / depth.max(TINY_SQ),
            one_sided: if one_way { ONE_SIDED } else { 0.0 },
            isotropic: if one_way { 0.0 } else { 1.0 },
            weight: node.weight,
            ..Self::DARK
        }
    }

    /// Strength, of whichever kind.
    pub(super) fn strength(&self) -> f32 {
        self.weight.max(self.everywhere)
    }

    /// The same with another strength.
    pub(super) fn with_strength(self, strength: f32) -> Self {
        let of = |own: f32| if own > 0.0 { strength } else { 0.0 };
        Self {
            weight: of(self.weight),
            everywhere: of(self.everywhere),
            ..self
        }
    }

    /// Whether the angular attenuation or the range of a punctual light matters.
    pub(super) fn is_attenuated(&self) -> bool {
        self.cone_scale > 0.0 || self.inverse_range_sq > 0.0
    }

    /// Estimate of the irradiance at a point, visibility as learned; heights above the horizons of the receiver and of the
    /// emitter are softened by the emitter's size. Zero only where nothing arrives, but for clusters of spots.
    #[inline(always)]
    pub(super) fn importance<const ATTENUATED: bool>(&self, at: &Receiver) -> f32 {
        let to = self.center - at.position;
        let radius = self.radius;
        let radius_sq = radius * radius;
        let d_sq = to.length_squared().max(0.5 * radius_sq).max(TINY_SQ);
        let inverse_sq = 1.0 / d_sq;
        let d = d_sq.sqrt();
        // The mean of what is above the horizon, as in the tree.
        let middle = at.normal.dot(to);
        let above = (middle + radius).max(0.0);
        let part = above * above * self.quarter_inverse_radius;
        let height = if middle >= radius { middle } else { part };
        // Height over the emitter's plane, either side of it if it has two; for a cluster the mean over its depth.
        let front = -self.axis.dot(to);
        let front = front.max(-front - self.one_sided);
        let above = (front + self.depth).max(0.0);
        let part = above * above * self.quarter_inverse_depth;
        let mean_front = if front >= self.depth { front } else { part };
        let plane =
            (1.0 - self.isotropic) * mean_front + 0.5 * radius * (radius_sq * inverse_sq).min(1.0) + self.isotropic * d;
        let lit = front > -1e-4 * radius - self.depth || self.isotropic > 0.0;
        let plane = if lit { plane } else { 0.0 };
        let mut strength = self.weight;
        if ATTENUATED {
            let cos_axis = front * inverse_sq * d;
            // Margins against rounding, as in `LeafLight::attenuation`.
            let cone = cos_axis * self.cone_scale + self.cone_offset;
            let relative_sq = d_sq * self.inverse_range_sq;
            let window = 1.0 - relative_sq * relative_sq;
            let reached = cone > -1e-4 * self.cone_scale && window > -1e-4;
            let cone = cone.clamp(0.03, 1.0);
            strength *= if reached {
                cone * cone * window.clamp(1e-4, 1.0)
            } else {
                0.0
            };
        }
        strength * (height * inverse_sq) * (plane * inverse_sq) + self.everywhere
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{mixed_lights, points};

    #[test]
    fn a_light_that_may_arrive_weighs_something_and_about_what_the_tree_thinks() {
        let lights: Vec<_> = mixed_lights(400, 3).into_iter().skip(2).collect();
        let tree = Tree::new(&lights);
        let (mut alike, mut all) = (0, 0);
        for point in points(200, 5) {
            let receiver = Receiver::from(&point);
            for place in 0..tree.leaves.len() as u32 {
                let leaf = &tree.leaves[place as usize];
                let own = Emitter::light(leaf).importance::<true>(&receiver);
                let of_tree = receiver.light(leaf);
                // At the edge of a cone or of a range the tree keeps a little more.
                let edge = leaf.cone_scale > 0.0 || leaf.inverse_range_sq > 0.0;
                assert!(
                    own.is_finite() && (own > 0.0) == (of_tree > 0.0) || edge,
                    "{own} {of_tree}"
                );
                if own > 0.0 {
                    all += 1;
                    alike += u32::from((own / of_tree).max(of_tree / own) < 1.3);
                }
            }
        }
        assert!(f64::from(alike) > 0.95 * f64::from(all), "{alike} {all}");
    }
}

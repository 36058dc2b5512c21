//! How much a light, or a group of lights, may matter at a point: irradiance in units of the strongest light.
//!
//! Both estimates are zero only where nothing can arrive: behind the surface, behind a one-sided emitter, outside a
//! spot's cone or a light's range. Rounding is met with small margins on the safe side.

use super::Node;
use super::bounds::{Emission, LeafLight};
use crate::ShadingPoint;
use glam::Vec3;

/// Share of its full strength that a group keeps where it barely reaches, against rounding at that border.
const MARGIN: f32 = 1e-4;
/// Squares of lengths are at least this, so that their products and inverses stay in range.
const TINY_SQ: f32 = 1e-18;
/// Cosine of the half angle below which the normals of a group count as one.
const PARALLEL: f32 = 0.999_999;

/// Where the light is wanted, as importance reads it.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Receiver {
    /// World position.
    pub(crate) position: Vec3,
    /// Unit normal.
    pub(crate) normal: Vec3,
}

impl Receiver {
    /// Whether it can be that of a point of a surface.
    pub(crate) fn is_sound(&self) -> bool {
        self.position.is_finite() && self.normal.is_normalized()
    }
}

/// Largest cosine between a normal in the node's cone and the direction from a place in its ball to the receiver, in sines and
/// cosines (Conty Estevez and Kulla 2018, section 5, equation 3); 0 if nothing is emitted that way.
fn cos_from_cone(node: &Node, to: Vec3, distance_sq: f32, radius_sq: f32) -> f32 {
    if distance_sq <= radius_sq {
        return 1.0;
    }
    let inverse_distance = 1.0 / distance_sq.sqrt();
    let sin_u = radius_sq.sqrt() * inverse_distance;
    let cos_u = (1.0 - sin_u * sin_u).max(0.0).sqrt();
    let cos_t = -node.axis.dot(to) * inverse_distance;
    let sin_t = (1.0 - cos_t * cos_t).max(0.0).sqrt();
    let (cos_x, sin_x) = if cos_t >= node.cos_o {
        (1.0, 0.0)
    } else {
        (
            cos_t * node.cos_o + sin_t * node.sin_o,
            sin_t * node.cos_o - cos_t * node.sin_o,
        )
    };
    let cos_x = if cos_x >= cos_u {
        1.0
    } else {
        cos_x * cos_u + sin_x * sin_u
    };
    if cos_x <= node.cos_e { 0.0 } else { cos_x.max(MARGIN) }
}

/// Mean of what is positive in \[middle - reach, middle + reach\]; zero only if nothing is.
#[inline]
fn mean_above(middle: f32, reach: f32) -> f32 {
    if middle >= reach {
        middle
    } else {
        let above = (middle + reach).max(0.0);
        above * above / (4.0 * reach).max(f32::MIN_POSITIVE)
    }
}

impl From<&ShadingPoint> for Receiver {
    #[inline]
    fn from(point: &ShadingPoint) -> Self {
        Self {
            position: point.position_ws,
            normal: point.normal_ws,
        }
    }
}

impl Receiver {
    /// Importance of a group: weight x cosine at the receiver x cosine at the emitters / distance^2.
    ///
    /// Differs from Conty Estevez and Kulla 2018, section 5: each cosine is a mean height over the group's box in place of an upper
    /// bound over its bounding sphere, divided by the distance of the box's nearest point, at most 1. Bounds overrate
    /// groups at a distance, and there are many of those: on a building of 2,000 lights the error of one sample falls to
    /// 0.4 of what it is with bounds. It is zero only where the bounds are zero. The distance is at least the
    /// half diagonal, so that importance does not depend on the unit of length.
    #[inline]
    pub(crate) fn group(&self, node: &Node) -> f32 {
        let to = node.center - self.position;
        let height = mean_above(self.normal.dot(to), self.normal.abs().dot(node.half));
        let radius_sq = node.half.length_squared();
        let nearest_sq = (to.abs() - node.half).max(Vec3::ZERO).length_squared();
        let nearest_sq = nearest_sq.max(1e-6 * radius_sq).max(TINY_SQ);
        let nearest = nearest_sq.sqrt();
        let distance_sq = to.length_squared().max(radius_sq).max(TINY_SQ);
        let facing = if node.cos_o <= -1.0 {
            nearest
        } else if node.cos_o >= PARALLEL {
            mean_above(-node.axis.dot(to), node.axis.abs().dot(node.half))
        } else {
            nearest * cos_from_cone(node, to, distance_sq, radius_sq)
        };
        node.weight * (height.min(nearest) / nearest_sq) * (facing.min(nearest) / distance_sq)
    }

    /// Importance of one light: its irradiance from the centre, softened where it is seen at close range, so that no
    /// part of it is overlooked: heights above the horizon are averaged over its extent.
    #[inline]
    pub(crate) fn light(&self, light: &LeafLight) -> f32 {
        let to = light.center - self.position;
        let distance_sq = to.length_squared();
        let radius = light.radius;
        let height = self.normal.dot(to);
        let emission = light.emission();
        if emission == Emission::Point {
            let d_sq = distance_sq.max(f32::MIN_POSITIVE.sqrt());
            let inverse_distance = 1.0 / d_sq.sqrt();
            if height <= 0.0 {
                return 0.0;
            }
            let attenuation = light.attenuation(d_sq * inverse_distance, -light.axis.dot(to) * inverse_distance);
            return light.weight * attenuation * (height * inverse_distance * inverse_distance * inverse_distance);
        }
        let height = mean_above(height, radius);
        if height <= 0.0 {
            return 0.0;
        }
        let radius_sq = radius * radius;
        let plane = -light.axis.dot(to);
        let plane = if emission == Emission::TwoSided {
            plane.abs()
        } else {
            plane
        };
        if plane <= -1e-4 * radius {
            return 0.0;
        }
        let d_sq = distance_sq.max(0.5 * radius_sq).max(f32::MIN_POSITIVE.sqrt());
        let plane = plane.max(0.0) + 0.5 * radius * radius_sq / (d_sq + radius_sq);
        let inverse_sq = 1.0 / d_sq;
        light.weight * (height * inverse_sq) * (plane * inverse_sq)
    }
}

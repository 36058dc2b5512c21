//! Light records. Every emissive triangle is one light, every punctual light is one light.

pub(crate) mod collect;
mod punctual;
mod triangle;

use crate::PrimitiveId;
use glam::{Vec2, Vec3};

/// Which fields of [`Light`] have a meaning, and how it is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    /// An emissive triangle. `intensity` is radiance.
    Triangle,
    /// `intensity` is radiant intensity.
    Point,
    /// A point with a cone. `intensity` is radiant intensity on the axis.
    Spot,
    /// From infinitely far away along `normal_ws`. `intensity` is irradiance on a surface that faces it.
    Directional,
}

/// One light, world space.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// What it is.
    pub kind: LightKind,
    /// Triangle: emits from both sides.
    pub double_sided: bool,
    /// Triangle: its emission varies with a texture or an alpha mask; `intensity` is then the mean over the triangle.
    pub textured: bool,
    /// Triangle: first corner. Point, spot: position.
    pub position_ws: Vec3,
    /// Triangle: second corner minus first.
    pub edge1_ws: Vec3,
    /// Triangle: third corner minus first.
    pub edge2_ws: Vec3,
    /// Triangle: unit geometric normal, the emitting side (opposite to `edge1_ws` x `edge2_ws` in a mirrored instance). Spot: axis, the way light goes. Directional: the way light
    /// goes. Point: zero.
    pub normal_ws: Vec3,
    /// RGB, see [`LightKind`]. Finite, at least 0, not all 0.
    pub intensity: Vec3,
    /// Triangle: area in square metres. Others: 0.
    pub area: f32,
    /// Point, spot: distance beyond which the light ends (`range`); infinity for none.
    pub range: f32,
    /// Spot: cosine of the inner cone angle (full intensity inside).
    pub cos_inner: f32,
    /// Spot: cosine of the outer cone angle (dark outside).
    pub cos_outer: f32,
    /// Emitted power, luminance-weighted: W (or lm). Triangle: pi x area x radiance (x 2 if double-sided); point: 4 pi x
    /// intensity; spot: integrated over the cone; directional: irradiance x pi x (scene radius)^2.
    pub power: f32,
    /// Triangle: which one. Others: [`PrimitiveId::NONE`].
    pub primitive: PrimitiveId,
}

/// Where in the file a light or triangle comes from; strings are shared by index to stay small.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct LightSource {
    /// Name of the node.
    pub node: String,
    /// Name of the mesh, or of the punctual light.
    pub mesh: String,
    /// Name of the material; empty for punctual lights.
    pub material: String,
    /// Triangle within its primitive of the file.
    pub triangle: u32,
}

/// A point on a light, as seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// Unit direction towards the light.
    pub wi_ws: Vec3,
    /// Distance, metres; infinity for directional lights.
    pub distance: f32,
    /// Area lights: emitted radiance towards the shading point. Delta lights: irradiance on a surface facing it
    /// (intensity / distance^2 with cone and range). RGB.
    pub radiance: Vec3,
    /// Density of the direction with respect to solid angle; 1 for delta lights.
    pub pdf_solid_angle: f32,
}

impl Light {
    /// Whether it is a point in direction space, so that BSDF sampling can never find it.
    #[inline]
    pub fn is_delta(&self) -> bool {
        self.kind != LightKind::Triangle
    }

    /// A point that stands for the whole light: centroid, or position. Zero for directional lights.
    #[inline]
    pub fn center_ws(&self) -> Vec3 {
        match self.kind {
            LightKind::Triangle => self.position_ws + (self.edge1_ws + self.edge2_ws) * (1.0 / 3.0),
            LightKind::Point | LightKind::Spot => self.position_ws,
            LightKind::Directional => Vec3::ZERO,
        }
    }

    /// Draws a point on the light for the shading point `from_ws`; `None` if no light can arrive (behind a one-sided
    /// emitter, outside cone or range, degenerate). Triangles are drawn by solid angle where that pays, by area
    /// elsewhere; [`Light::pdf_solid_angle`] decides alike. Texture is not applied here (see
    /// [`crate::Scene::sample_light`]).
    #[inline(always)]
    pub fn sample(&self, from_ws: Vec3, u: Vec2) -> Option<LightPoint> {
        match self.kind {
            LightKind::Triangle => self.sample_triangle(from_ws, u),
            LightKind::Point | LightKind::Spot | LightKind::Directional => self.illuminate(from_ws),
        }
    }

    /// Density with respect to solid angle with which [`Light::sample`] draws the direction `wi_ws` from `from_ws`, where
    /// the ray meets the light at `distance`. 0 for delta lights, and seen from a side that does not emit.
    #[inline]
    pub fn pdf_solid_angle(&self, from_ws: Vec3, wi_ws: Vec3, distance: f32) -> f32 {
        match self.kind {
            LightKind::Triangle => self.pdf_triangle(from_ws, wi_ws, distance),
            LightKind::Point | LightKind::Spot | LightKind::Directional => 0.0,
        }
    }

    /// Estimate of what the light sends to a surface point with the given unit normal, visibility ignored: the luminance
    /// of the irradiance, at least 0, finite.
    ///
    /// 0 only if the light certainly cannot contribute there, so it may serve as a sampling weight without bias: behind
    /// a one-sided emitter, outside cone or range, or wholly below the horizon. Exact for delta lights. A triangle
    /// counts as if its power sat at its centroid, with the mean over its area of the part of the cosine above the horizon; near by it
    /// stays bounded (d^2 >= area / 4, and no more than the pi L that a full hemisphere of it would send). Scaling all lengths
    /// by s leaves a triangle's value as it is, and divides that of a point light by s^2, as irradiance does.
    #[inline]
    pub fn unshadowed_irradiance(&self, at_ws: Vec3, normal_ws: Vec3) -> f32 {
        match self.kind {
            LightKind::Triangle => self.triangle_irradiance(at_ws, normal_ws),
            LightKind::Point | LightKind::Spot | LightKind::Directional => self.punctual_irradiance(at_ws, normal_ws),
        }
    }
}

#[cfg(test)]
mod tests;

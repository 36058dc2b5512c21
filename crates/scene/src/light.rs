//! Light records. Every emissive triangle is one light, every punctual light is one light.

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
    /// Triangle: its emission varies with a texture; `intensity` is then the mean over the triangle.
    pub textured: bool,
    /// Triangle: first corner. Point, spot: position.
    pub position_ws: Vec3,
    /// Triangle: second corner minus first.
    pub edge1_ws: Vec3,
    /// Triangle: third corner minus first.
    pub edge2_ws: Vec3,
    /// Triangle: unit geometric normal, the emitting side. Spot: axis, the way light goes. Directional: the way light
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
    pub fn is_delta(&self) -> bool {
        self.kind != LightKind::Triangle
    }

    /// A point that stands for the whole light: centroid, or position. Zero for directional lights.
    pub fn center_ws(&self) -> Vec3 {
        match self.kind {
            LightKind::Triangle => self.position_ws + (self.edge1_ws + self.edge2_ws) / 3.0,
            LightKind::Point | LightKind::Spot => self.position_ws,
            LightKind::Directional => Vec3::ZERO,
        }
    }

    /// Draws a point on the light for the shading point `from_ws`; `None` if no light can arrive (behind a one-sided
    /// emitter, outside cone or range, degenerate). Triangles are drawn by solid angle where that is well conditioned,
    /// by area elsewhere; [`Light::pdf_solid_angle`] decides alike. Texture is not applied here (see
    /// [`crate::Scene::sample_light`]).
    pub fn sample(&self, from_ws: Vec3, u: Vec2) -> Option<LightPoint> {
        let _ = (from_ws, u);
        unimplemented!("owner: scene loader")
    }

    /// Density with respect to solid angle with which [`Light::sample`] draws the direction `wi_ws` from `from_ws`, where the ray meets
    /// the light at `distance`. 0 for delta lights.
    pub fn pdf_solid_angle(&self, from_ws: Vec3, wi_ws: Vec3, distance: f32) -> f32 {
        let _ = (from_ws, wi_ws, distance);
        unimplemented!("owner: scene loader")
    }

    /// Upper-level estimate of what the light sends to a point with the given normal, visibility ignored: the luminance of the
    /// irradiance from the light's centre, clamped near the light so that it stays bounded (d^2 >= area / 4).
    /// 0 only if the light certainly cannot contribute there when `conservative`.
    pub fn unshadowed_irradiance(&self, at_ws: Vec3, normal_ws: Vec3) -> f32 {
        let _ = (at_ws, normal_ws);
        unimplemented!("owner: scene loader")
    }
}

//! What a ray found, resolved: the surface point that shading works on.

use crate::{PrimitiveId, material::Bsdf};
use glam::{Vec2, Vec3};

/// Marks a triangle that is no light.
pub const NO_LIGHT: u32 = u32::MAX;

/// A surface point, seen along `-wo_ws`.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// World position, computed from the triangle's corners (more exact than origin + t direction).
    pub position_ws: Vec3,
    /// Unit geometric normal on the viewer's side.
    pub geometric_normal_ws: Vec3,
    /// The triangle: rays that leave pass it to be skipped.
    pub id: PrimitiveId,
    /// Index of the material.
    pub material: u32,
    /// Texture coordinates (set 0); zero when the mesh has none.
    pub uv: Vec2,
    /// Index of the light this triangle is, or [`NO_LIGHT`].
    pub light: u32,
    /// Radiance emitted towards the viewer: zero for no light, or seen from a side that does not emit.
    pub emitted: Vec3,
    /// The material here. Its normal is the shading normal on the viewer's side.
    pub bsdf: Bsdf,
}

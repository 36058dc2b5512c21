//! Ray queries: the nearest hit, and whether anything stands between two points.

use glam::Vec3;

/// A ray. `direction` is of unit length; hits count in (0, `t_max`).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// World-space origin.
    pub origin_ws: Vec3,
    /// World-space unit direction.
    pub direction_ws: Vec3,
    /// Largest distance that counts, metres; may be infinite.
    pub t_max: f32,
}

/// A triangle of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct PrimitiveId {
    /// Index into [`crate::SceneParts::instances`].
    pub instance: u32,
    /// Triangle of the instance's mesh.
    pub triangle: u32,
}

impl PrimitiveId {
    /// No triangle: nothing is skipped.
    pub const NONE: Self = Self {
        instance: u32::MAX,
        triangle: u32::MAX,
    };
}

/// A ray's meeting with a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
    /// Which triangle.
    pub id: PrimitiveId,
}

/// The acceleration structure over all instances of a scene.
#[derive(Debug, Default)]
pub struct Bvh {}

impl Bvh {
    /// Builds it for the geometry of `parts` (already validated). `build_s` and sizes go into the scene's statistics.
    pub fn build(parts: &crate::SceneParts) -> Self {
        let _ = parts;
        unimplemented!("owner: bvh")
    }

    /// The nearest hit, or `None`. `from` is skipped (the triangle the ray starts on).
    pub fn nearest(&self, parts: &crate::SceneParts, ray: &Ray, from: PrimitiveId) -> Option<Hit> {
        let _ = (parts, ray, from);
        unimplemented!("owner: bvh")
    }

    /// Whether anything but `from` and `to` is hit.
    pub fn occluded(&self, parts: &crate::SceneParts, ray: &Ray, from: PrimitiveId, to: PrimitiveId) -> bool {
        let _ = (parts, ray, from, to);
        unimplemented!("owner: bvh")
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        unimplemented!("owner: bvh")
    }
}

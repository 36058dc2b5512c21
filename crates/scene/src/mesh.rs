//! Triangle meshes in the local space of their instances.

use glam::{Vec2, Vec3, Vec4};

/// A triangle mesh. Streams that a scene does not need are empty: no textures, no texture coordinates.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name in the file; for the merged static mesh, empty.
    pub name: String,
    /// Vertex positions, local space, metres.
    pub positions: Vec<Vec3>,
    /// Three vertex indices per triangle, counter-clockwise seen from the front.
    pub indices: Vec<[u32; 3]>,
    /// Unit shading normals per vertex, or empty when every triangle is flat. A zero normal means "flat here".
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex (set 0), or empty.
    pub uvs: Vec<Vec2>,
    /// Second set of texture coordinates, or empty.
    pub uvs1: Vec<Vec2>,
    /// Unit tangents, `w` = handedness, or empty when nothing is normal-mapped.
    pub tangents: Vec<Vec4>,
    /// Linear RGBA that multiplies the base colour, or empty.
    pub colors: Vec<Vec4>,
    /// Index into [`crate::SceneParts::materials`], one per triangle.
    pub materials: Vec<u32>,
    /// Index into [`crate::SceneParts::origins`], one per triangle: where the triangle stands in the file. May be empty
    /// in an instanced mesh, whose origin is that of its instance.
    pub origins: Vec<u32>,
}

impl Mesh {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether the mesh has no triangle.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// The corners of triangle `i`, local space.
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.indices[i].map(|v| self.positions[v as usize])
    }
}

//! Putting meshes together, moved into world space on the way.

use crate::{Instance, Mesh};
use glam::{Affine3A, DAffine3, DMat3, Vec2, Vec3, Vec4};

/// How a mesh is moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    world: DAffine3,
    /// Inverse transpose; `None` if the transform is singular, where normals have no meaning.
    normals: Option<DMat3>,
    mirrored: bool,
}

impl Motion {
    /// By the transform `world`.
    pub(super) fn new(world: DAffine3) -> Self {
        let matrix = world.matrix3;
        let determinant = matrix.determinant();
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length());
        // Relative to the volume that axes of these lengths could span at most.
        let singular = !(determinant.abs() > 1e-9 * x * y * z && determinant.recip().is_finite());
        Self {
            world,
            normals: (!singular).then(|| matrix.inverse().transpose()),
            mirrored: determinant < 0.0,
        }
    }

    /// An instance of mesh `mesh`, moved so; `None` if the transform is singular, so that there is no way back for rays.
    pub(super) fn instance(&self, mesh: u32, origin: u32) -> Option<Instance> {
        let world = self.world;
        let affine = Affine3A::from_mat3_translation(world.matrix3.as_mat3(), world.translation.as_vec3());
        self.normals.and_then(|_| Instance::new(mesh, origin, affine))
    }

    fn point(&self, p: Vec3) -> Vec3 {
        self.world.transform_point3(p.as_dvec3()).as_vec3()
    }

    fn normal(&self, n: Vec3) -> Vec3 {
        let moved = self.normals.map(|matrix| (matrix * n.as_dvec3()).normalize_or_zero());
        moved.unwrap_or_default().as_vec3()
    }

    fn tangent(&self, t: Vec4) -> Vec4 {
        let direction = (self.world.matrix3 * t.truncate().as_dvec3()).as_vec3();
        // Mirroring turns the bitangent, a cross product, the other way.
        let handedness = if self.mirrored { -t.w } else { t.w };
        direction.try_normalize().unwrap_or(Vec3::X).extend(handedness)
    }
}

/// Appends the triangles and vertices of `part` to `mesh`, moved if asked to; `materials` and `origins` are left to the
/// caller. A stream that only one of the two has is filled up with what means "nothing here".
pub(super) fn append(mesh: &mut Mesh, part: &Mesh, motion: Option<&Motion>) {
    let base = mesh.positions.len() as u32;
    let flip = motion.is_some_and(|m| m.mirrored);
    mesh.indices.extend(part.indices.iter().map(|t| {
        let [a, b, c] = t.map(|vertex| vertex + base);
        if flip { [a, c, b] } else { [a, b, c] }
    }));
    let (before, after) = (mesh.positions.len(), mesh.positions.len() + part.positions.len());
    match motion {
        Some(motion) => mesh.positions.extend(part.positions.iter().map(|&p| motion.point(p))),
        None => mesh.positions.extend_from_slice(&part.positions),
    }
    let fill = Fill { before, after };
    let normal = |n: Vec3| motion.map_or(n, |motion| motion.normal(n));
    let tangent = |t: Vec4| motion.map_or(t, |motion| motion.tangent(t));
    fill.extend(&mut mesh.normals, &part.normals, Vec3::ZERO, normal);
    fill.extend(&mut mesh.uvs, &part.uvs, Vec2::ZERO, |uv| uv);
    fill.extend(&mut mesh.uvs1, &part.uvs1, Vec2::ZERO, |uv| uv);
    fill.extend(
        &mut mesh.tangents,
        &part.tangents,
        Vec4::new(1.0, 0.0, 0.0, 1.0),
        tangent,
    );
    fill.extend(&mut mesh.colors, &part.colors, Vec4::ONE, |color| color);
}

/// Vertex counts of a mesh before and after a part is appended.
struct Fill {
    before: usize,
    after: usize,
}

impl Fill {
    fn extend<T: Copy>(&self, stream: &mut Vec<T>, part: &[T], nothing: T, moved: impl Fn(T) -> T) {
        if part.is_empty() && stream.is_empty() {
            return;
        }
        stream.resize(self.before, nothing);
        stream.extend(part.iter().map(|&value| moved(value)));
        stream.resize(self.after, nothing);
    }
}

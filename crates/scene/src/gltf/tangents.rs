//! Tangents for normal maps, where the file brings none.
//!
//! Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited", section 4.1, as glTF asks for: tangents of triangles,
//! projected to the vertex's plane, are averaged with the corner's angle as weight, and vertices are split where the
//! texture is mirrored. Differs: tangents are averaged over the triangles that share a vertex of the file, not over those
//! whose vertices are equal, so a seam in normals or coordinates stays a seam.

use crate::Mesh;
use glam::{Vec2, Vec3, Vec4};

/// Fills `mesh.tangents` from its positions, normals and the given set of texture coordinates.
pub(super) fn generate(mesh: &mut Mesh, set: u8) {
    split_mirrored(mesh, set);
    let uvs = if set == 0 { &mesh.uvs } else { &mesh.uvs1 };
    let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
    let mut handedness = vec![1.0_f32; mesh.positions.len()];
    for triangle in &mesh.indices {
        let [a, b, c] = triangle.map(|v| v as usize);
        let p = [mesh.positions[a], mesh.positions[b], mesh.positions[c]];
        let Some((tangent, sign)) = frame(p, triangle_uvs(uvs, triangle)) else {
            continue;
        };
        let flat = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        for (corner, vertex) in [a, b, c].into_iter().enumerate() {
            let normal = normal_at(mesh, vertex, flat);
            let [to_next, to_last] = [p[(corner + 1) % 3], p[(corner + 2) % 3]].map(|q| q - p[corner]);
            let weight = to_next.angle_between(to_last);
            let projected = (tangent - normal * normal.dot(tangent)).normalize_or_zero();
            if weight.is_finite() {
                sums[vertex] += projected * weight;
            }
            handedness[vertex] = sign;
        }
    }
    mesh.tangents = (0..sums.len())
        .map(|vertex| {
            let normal = normal_at(mesh, vertex, Vec3::Z);
            let fallback = || normal.any_orthonormal_vector();
            let tangent = sums[vertex].try_normalize().unwrap_or_else(fallback);
            tangent.extend(handedness[vertex])
        })
        .collect::<Vec<Vec4>>();
}

fn normal_at(mesh: &Mesh, vertex: usize, otherwise: Vec3) -> Vec3 {
    let normal = mesh.normals.get(vertex).copied().unwrap_or_default();
    if normal == Vec3::ZERO { otherwise } else { normal }
}

fn triangle_uvs(uvs: &[Vec2], triangle: &[u32; 3]) -> [Vec2; 3] {
    triangle.map(|v| uvs.get(v as usize).copied().unwrap_or_default())
}

/// Direction of growing u, and +1 or -1 as v (downwards in glTF) makes the frame right- or left-handed; `None` where the
/// texture is degenerate.
fn frame(p: [Vec3; 3], uv: [Vec2; 3]) -> Option<(Vec3, f32)> {
    let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
    let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
    let area = d1.perp_dot(d2);
    let tangent = ((e1 * d2.y - e2 * d1.y) * area.signum()).try_normalize()?;
    (area != 0.0).then_some((tangent, -area.signum()))
}

/// Gives triangles with mirrored texture vertices of their own where they share them with others.
fn split_mirrored(mesh: &mut Mesh, set: u8) {
    let uvs = if set == 0 { &mesh.uvs } else { &mesh.uvs1 };
    let mirrored: Vec<bool> = (mesh.indices.iter())
        .map(|triangle| {
            let [a, b, c] = triangle_uvs(uvs, triangle);
            (b - a).perp_dot(c - a) > 0.0
        })
        .collect();
    let mut upright = vec![false; mesh.positions.len()];
    for (triangle, _) in mesh.indices.iter().zip(&mirrored).filter(|(_, mirrored)| !**mirrored) {
        for &vertex in triangle {
            upright[vertex as usize] = true;
        }
    }
    let mut copies = vec![None; upright.len()];
    let mut indices = std::mem::take(&mut mesh.indices);
    for (triangle, _) in indices.iter_mut().zip(&mirrored).filter(|(_, mirrored)| **mirrored) {
        for corner in triangle.iter_mut().filter(|corner| upright[**corner as usize]) {
            let vertex = *corner as usize;
            *corner = *copies[vertex].get_or_insert_with(|| copy_vertex(mesh, vertex));
        }
    }
    mesh.indices = indices;
}

fn copy_vertex(mesh: &mut Mesh, vertex: usize) -> u32 {
    fn copy<T: Copy>(stream: &mut Vec<T>, vertex: usize) {
        if let Some(&value) = stream.get(vertex) {
            stream.push(value);
        }
    }
    let new = mesh.positions.len() as u32;
    copy(&mut mesh.positions, vertex);
    copy(&mut mesh.normals, vertex);
    copy(&mut mesh.uvs, vertex);
    copy(&mut mesh.uvs1, vertex);
    copy(&mut mesh.colors, vertex);
    new
}

//! What varies over a triangle: texture coordinates, vertex colours, and the texels they lead to.

use crate::texture::TextureRef;
use crate::{Material, Mesh, Texture};
use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};
use std::ops::{Add, Mul};

/// The value at barycentric weights `u` and `v` of the second and third corner.
#[inline]
pub(crate) fn interpolate<T: Add<Output = T> + Mul<f32, Output = T>>([a, b, c]: [T; 3], u: f32, v: f32) -> T {
    a * (1.0 - u - v) + b * u + c * v
}

/// Barycentric weights of the corners, see [`interpolate`].
pub(crate) const CORNERS: [(f32, f32); 3] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];

/// Interpolated vertex streams at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inputs {
    /// Both sets, where the mesh has them.
    pub(crate) uvs: [Option<Vec2>; 2],
    /// Linear; white where the mesh has none.
    pub(crate) color: Vec4,
}

impl Inputs {
    pub(crate) fn at(mesh: &Mesh, triangle: usize, u: f32, v: f32) -> Self {
        let vertices = mesh.indices[triangle].map(|i| i as usize);
        let uv = |stream: &[Vec2]| (!stream.is_empty()).then(|| interpolate(vertices.map(|i| stream[i]), u, v));
        Self {
            uvs: [uv(&mesh.uvs), uv(&mesh.uvs1)],
            color: match mesh.colors.as_slice() {
                [] => Vec4::ONE,
                colors => interpolate(vertices.map(|i| colors[i]), u, v),
            },
        }
    }

    /// Linear RGBA; `None` where the mesh lacks the coordinates.
    pub(crate) fn texel(&self, textures: &[Texture], reference: &TextureRef) -> Option<Vec4> {
        let uv = self.uvs[usize::from(reference.uv_set)]?;
        Some(textures[reference.texture as usize].sample(reference.columns * uv + reference.offset))
    }

    /// The texel, or white where there is none to find.
    fn factor(&self, textures: &[Texture], reference: Option<&TextureRef>) -> Vec4 {
        reference
            .and_then(|reference| self.texel(textures, reference))
            .unwrap_or(Vec4::ONE)
    }

    /// Linear base colour and alpha: factor x texture x vertex colour (glTF 2.0 section 3.9.2).
    pub(crate) fn base_color(&self, textures: &[Texture], material: &Material) -> Vec4 {
        let texel = self.factor(textures, material.base_color_texture.as_ref());
        material.base_color.extend(material.alpha) * texel * self.color
    }

    /// Metallic and roughness: factors x blue and green of the texture.
    pub(crate) fn metallic_roughness(&self, textures: &[Texture], material: &Material) -> Vec2 {
        let texel = self.factor(textures, material.metallic_roughness_texture.as_ref());
        Vec2::new(material.metallic, material.roughness) * texel.zy()
    }

    /// Emitted radiance; zero in the holes of an alpha mask, which no ray meets.
    pub(crate) fn emission(&self, textures: &[Texture], material: &Material) -> Vec3 {
        let hole = material
            .alpha_cutoff
            .is_some_and(|cutoff| self.base_color(textures, material).w < cutoff);
        match hole {
            true => Vec3::ZERO,
            false => material.emission * self.factor(textures, material.emissive_texture.as_ref()).truncate(),
        }
    }
}

/// Whether emission varies over a triangle of this material: by texture, or by the holes of a mask.
pub(crate) fn emission_varies(material: &Material, mesh: &Mesh) -> bool {
    let masked = material.alpha_cutoff.is_some() && (material.base_color_texture.is_some() || !mesh.colors.is_empty());
    material.emissive_texture.is_some() || masked
}

/// Mean emitted radiance over a triangle, each point counted alike: exact for a constant, else the mean over the centroids of an equal subdivision
/// at least as fine as the texels, at most 64 x 64 pieces.
pub(crate) fn mean_emission(textures: &[Texture], material: &Material, mesh: &Mesh, triangle: usize) -> Vec3 {
    if !emission_varies(material, mesh) {
        return Inputs::at(mesh, triangle, 1.0 / 3.0, 1.0 / 3.0).emission(textures, material);
    }
    let rows = rows(textures, material, mesh, triangle);
    let step = 1.0 / rows as f32;
    let mut sum = glam::DVec3::ZERO;
    for row in 0..rows {
        for column in 0..rows - row {
            let corner = Vec2::new(column as f32, row as f32);
            let mut add = |at: Vec2| {
                sum += Inputs::at(mesh, triangle, at.x, at.y)
                    .emission(textures, material)
                    .as_dvec3()
            };
            add((corner + 1.0 / 3.0) * step);
            // The downward piece that completes the parallelogram, where it lies inside.
            if row + column + 1 < rows {
                add((corner + 2.0 / 3.0) * step);
            }
        }
    }
    (sum / f64::from(rows * rows)).as_vec3()
}

/// Rows of pieces by which the longest edge is cut to the size of a texel.
fn rows(textures: &[Texture], material: &Material, mesh: &Mesh, triangle: usize) -> u32 {
    const MOST: f32 = 64.0;
    let masks = [material.emissive_texture.as_ref(), material.base_color_texture.as_ref()];
    let longest = masks.into_iter().flatten().filter_map(|reference| {
        let texture = &textures[reference.texture as usize];
        let size = Vec2::new(texture.width as f32, texture.height as f32);
        let corners = CORNERS.map(|(u, v)| Inputs::at(mesh, triangle, u, v).uvs[usize::from(reference.uv_set)]);
        let [Some(a), Some(b), Some(c)] = corners.map(|uv| Some(reference.columns * uv? * size)) else {
            return None;
        };
        Some((b - a).length().max((c - a).length()).max((c - b).length()))
    });
    longest.fold(4.0, f32::max).ceil().min(MOST) as u32
}

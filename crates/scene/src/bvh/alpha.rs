//! Alpha masks: holes in triangles.

use crate::SceneParts;
use glam::Vec2;

/// Whether the triangle is there at the given weights of its second and third corner: glTF 2.0 section 3.9.4, the
/// alpha of factor, texture and vertex colour against the cutoff.
#[cold]
#[inline(never)]
pub(super) fn visible(parts: &SceneParts, instance: u32, triangle: u32, u: f32, v: f32) -> bool {
    let mesh = &parts.meshes[parts.instances[instance as usize].mesh as usize];
    let corners = mesh.indices[triangle as usize].map(|i| i as usize);
    let material = &parts.materials[mesh.materials[triangle as usize] as usize];
    let weights = [1.0 - u - v, u, v];
    let mut alpha = material.alpha;
    if let Some(reference) = &material.base_color_texture {
        let set = if reference.uv_set == 0 { &mesh.uvs } else { &mesh.uvs1 };
        if !set.is_empty() {
            let uv: Vec2 = (0..3).map(|i| set[corners[i]] * weights[i]).sum();
            let uv = reference.columns * uv + reference.offset;
            alpha *= parts.textures[reference.texture as usize].sample(uv).w;
        }
    }
    if !mesh.colors.is_empty() {
        alpha *= (0..3).map(|i| mesh.colors[corners[i]].w * weights[i]).sum::<f32>();
    }
    material.alpha_cutoff.is_none_or(|cutoff| alpha >= cutoff)
}

//! Materials, textures, lights and cameras as JSON.

use crate::texture::{TextureRef, Wrap};
use crate::{Camera, Light, LightKind, Material, Texture};
use serde_json::{Map, Value, json};
use std::io::Cursor;

/// Splits a colour into a factor in \[0, 1\] per channel and a strength of at least 1.
fn factor_and_strength(color: glam::Vec3) -> ([f32; 3], f32) {
    let strength = color.max_element().max(1.0);
    ((color / strength).to_array(), strength)
}

/// A reference to a texture; textures are written in the order of the scene.
fn texture_ref(at: &TextureRef) -> Map<String, Value> {
    let mut out = Map::new();
    out.insert("index".into(), json!(at.texture));
    if at.uv_set != 0 {
        out.insert("texCoord".into(), json!(at.uv_set));
    }
    if at.columns != glam::Mat2::IDENTITY || at.offset != glam::Vec2::ZERO {
        // columns = rotation * scale, where rotation has the columns (cos, -sin) and (sin, cos).
        let (x, y) = (at.columns.x_axis, at.columns.y_axis);
        let rotation = (-x.y).atan2(x.x);
        let scale_x = x.length();
        let scale_y = if scale_x > 0.0 {
            at.columns.determinant() / scale_x
        } else {
            y.length()
        };
        let transform = json!({
            "offset": at.offset.to_array(), "rotation": rotation, "scale": [scale_x, scale_y], "texCoord": at.uv_set,
        });
        out.insert("extensions".into(), json!({ "KHR_texture_transform": transform }));
    }
    out
}

/// A material, in the terms of the metallic-roughness model and its extensions.
pub(super) fn material(m: &Material) -> Value {
    let [r, g, b] = m.base_color.to_array();
    let mut pbr = json!({
        "baseColorFactor": [r, g, b, m.alpha], "metallicFactor": m.metallic, "roughnessFactor": m.roughness,
    });
    if let Some(at) = &m.base_color_texture {
        pbr["baseColorTexture"] = texture_ref(at).into();
    }
    if let Some(at) = &m.metallic_roughness_texture {
        pbr["metallicRoughnessTexture"] = texture_ref(at).into();
    }
    let mut extensions = Map::new();
    specular(m, &mut extensions);
    let mut out = json!({ "name": m.name, "pbrMetallicRoughness": pbr, "doubleSided": m.double_sided });
    if m.emits() {
        let (factor, strength) = factor_and_strength(m.emission);
        out["emissiveFactor"] = json!(factor);
        if strength != 1.0 {
            extensions.insert(
                "KHR_materials_emissive_strength".into(),
                json!({ "emissiveStrength": strength }),
            );
        }
    }
    if let Some(at) = &m.emissive_texture {
        out["emissiveTexture"] = texture_ref(at).into();
    }
    if let Some(at) = &m.normal_texture {
        let mut texture = texture_ref(at);
        texture.insert("scale".into(), json!(m.normal_scale));
        out["normalTexture"] = texture.into();
    }
    if let Some(cutoff) = m.alpha_cutoff {
        out["alphaMode"] = json!("MASK");
        out["alphaCutoff"] = json!(cutoff);
    }
    if !extensions.is_empty() {
        out["extensions"] = extensions.into();
    }
    out
}

/// Reflectance of the dielectric: index of refraction by its strongest channel, the rest by the specular colour.
fn specular(m: &Material, extensions: &mut Map<String, Value>) {
    if m.dielectric_f90 == 0.0 {
        extensions.insert("KHR_materials_specular".into(), json!({ "specularFactor": 0.0 }));
        return;
    }
    let f0 = m.dielectric_f0 / m.dielectric_f90;
    let strongest = f0.max_element().clamp(0.0, 0.999);
    let mut specular = Map::new();
    if m.dielectric_f90 != 1.0 {
        specular.insert("specularFactor".into(), json!(m.dielectric_f90));
    }
    if strongest > 0.0 && f0.min_element() < strongest {
        specular.insert("specularColorFactor".into(), json!((f0 / strongest).to_array()));
    }
    if (strongest - 0.04).abs() > 1e-6 {
        let root = strongest.sqrt();
        extensions.insert(
            "KHR_materials_ior".into(),
            json!({ "ior": (1.0 + root) / (1.0 - root) }),
        );
    }
    if !specular.is_empty() {
        extensions.insert("KHR_materials_specular".into(), specular.into());
    }
}

/// A punctual light; its place is that of its node.
pub(super) fn light(light: &Light, name: &str) -> Value {
    let strength = light.intensity.max_element();
    let color = (light.intensity / strength).to_array();
    let kind = match light.kind {
        LightKind::Directional => "directional",
        LightKind::Spot => "spot",
        LightKind::Point | LightKind::Triangle => "point",
    };
    let mut out = json!({ "type": kind, "color": color, "intensity": strength });
    if !name.is_empty() {
        out["name"] = json!(name);
    }
    if light.range.is_finite() {
        out["range"] = json!(light.range);
    }
    if light.kind == LightKind::Spot {
        let (inner, outer) = (
            light.cos_inner.clamp(-1.0, 1.0).acos(),
            light.cos_outer.clamp(-1.0, 1.0).acos(),
        );
        out["spot"] = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
    }
    out
}

/// A perspective camera; its place is that of its node.
pub(super) fn camera(camera: &Camera) -> Value {
    json!({ "type": "perspective", "name": camera.name, "perspective": { "yfov": camera.fov_y, "znear": 0.01 } })
}

/// Wrapping and filtering.
pub(super) fn sampler(texture: &Texture) -> Value {
    let wrap = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    });
    let (magnify, minify) = if texture.nearest { (9728, 9728) } else { (9729, 9729) };
    json!({ "magFilter": magnify, "minFilter": minify, "wrapS": wrap[0], "wrapT": wrap[1] })
}

/// The texels as a PNG.
pub(super) fn png(texture: &Texture) -> std::io::Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut out,
        bytemuck::cast_slice::<[u8; 4], u8>(&texture.texels),
        texture.width,
        texture.height,
        image::ExtendedColorType::Rgba8,
        image::ImageFormat::Png,
    )
    .map_err(std::io::Error::other)?;
    Ok(out.into_inner())
}

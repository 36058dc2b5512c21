//! What the file has and this renderer does not: counted for the report, or refused.

use super::json::{Root, TextureRef};
use super::source::Source;
use crate::{Report, SceneError};
use std::collections::BTreeSet;

/// Extensions that are done in full, or, with what is missing reported, well enough to show a file that requires them.
const SUPPORTED: [&str; 9] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Refuses a file that requires what is not supported.
///
/// # Errors
/// [`SceneError::Invalid`] naming the extensions.
pub(super) fn refuse_required(source: &Source) -> Result<(), SceneError> {
    let required = &source.json.extensions_required;
    let missing: Vec<&str> = required
        .iter()
        .map(String::as_str)
        .filter(|name| !SUPPORTED.contains(name))
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(source.invalid(
        "extensionsRequired",
        format!("requires {}, not supported here", missing.join(", ")),
        "export without it (uncompressed geometry, PNG or JPEG images)",
    ))
}

/// Counts what is ignored: extensions at the objects that carry them, animations, skins. What only matters where it is
/// used (modes, morph targets, blending) is counted by whoever reads it.
pub(super) fn count_ignored(json: &Root, report: &mut Report) {
    let mut seen = BTreeSet::new();
    let mut count = |names: &[String]| {
        for name in names {
            seen.insert(name.clone());
            report.ignore(name);
        }
    };
    count(&json.extensions.others);
    json.scenes.iter().for_each(|o| count(&o.extensions.others));
    json.nodes.iter().for_each(|o| count(&o.extensions.others));
    json.meshes.iter().for_each(|o| count(&o.extensions.others));
    json.meshes
        .iter()
        .flat_map(|o| &o.primitives)
        .for_each(|o| count(&o.extensions.others));
    json.accessors.iter().for_each(|o| count(&o.extensions.others));
    json.buffer_views.iter().for_each(|o| count(&o.extensions.others));
    json.buffers.iter().for_each(|o| count(&o.extensions.others));
    json.textures.iter().for_each(|o| count(&o.extensions.others));
    json.images.iter().for_each(|o| count(&o.extensions.others));
    json.samplers.iter().for_each(|o| count(&o.extensions.others));
    json.cameras.iter().for_each(|o| count(&o.extensions.others));
    for material in &json.materials {
        count(&material.extensions.others);
        let pbr = &material.pbr_metallic_roughness;
        [
            &pbr.base_color_texture,
            &pbr.metallic_roughness_texture,
            &material.normal_texture,
            &material.emissive_texture,
        ]
        .into_iter()
        .flatten()
        .for_each(|o: &TextureRef| count(&o.extensions.others));
    }
    // Those that stand where we do not look, or are of no use to any object of the file.
    for name in &json.extensions_used {
        if !seen.contains(name) && !SUPPORTED.contains(&name.as_str()) {
            report.ignore(name);
        }
    }
    json.animations.iter().for_each(|_| report.ignore("animations"));
    json.skins.iter().for_each(|_| report.ignore("skins"));
}

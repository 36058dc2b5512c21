//! What the file has and this renderer does not: counted for the report, or refused.

use super::json::Root;
use super::source::Source;
use crate::{Report, SceneError};
use std::collections::BTreeSet;

/// Calls `$count` for the name of every extension of `$objects` that [`Root`] has no record of.
macro_rules! count_extensions {
    ($count:ident, $objects:expr) => {
        ($objects.into_iter())
            .filter_map(|object| object.extensions.as_ref())
            .flat_map(|extensions| extensions.others.keys())
            .for_each(&mut $count)
    };
}

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

/// Supported ones that [`super::json`] finds without a record of the `gltf` crate.
const WITHOUT_RECORD: [&str; 2] = ["EXT_mesh_gpu_instancing", "KHR_texture_transform"];

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
    let mut count = |name: &String| {
        seen.insert(name.clone());
        if !WITHOUT_RECORD.contains(&name.as_str()) {
            report.ignore(name);
        }
    };
    count_extensions!(count, [json]);
    count_extensions!(count, &json.scenes);
    count_extensions!(count, &json.nodes);
    count_extensions!(count, &json.meshes);
    count_extensions!(count, json.meshes.iter().flat_map(|mesh| &mesh.primitives));
    count_extensions!(count, &json.accessors);
    count_extensions!(count, &json.buffer_views);
    count_extensions!(count, &json.buffers);
    count_extensions!(count, &json.textures);
    count_extensions!(count, &json.images);
    count_extensions!(count, &json.samplers);
    count_extensions!(count, &json.cameras);
    count_extensions!(count, &json.materials);
    for material in &json.materials {
        let pbr = &material.pbr_metallic_roughness;
        count_extensions!(count, &pbr.base_color_texture);
        count_extensions!(count, &pbr.metallic_roughness_texture);
        count_extensions!(count, &material.normal_texture);
        count_extensions!(count, &material.emissive_texture);
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

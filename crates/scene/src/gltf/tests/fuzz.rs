//! Files damaged at random: any outcome but a crash.

use super::*;
use proptest::prelude::*;

/// A file that has a little of everything.
fn everything() -> Vec<u8> {
    let mut builder = triangle();
    let uvs = builder.floats(&[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    let normals = builder.floats(&[[0.0, 0.0, 1.0]; 3]);
    let indices = builder.indices(&[0, 1, 2, 2, 1, 0]);
    let image = builder.view(&png(2, &[[128, 128, 255, 255]; 4]));
    let offsets = builder.floats(&[[0.0; 3], [1.0; 3]]);
    let attributes = json!({ "POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs });
    let instancing = json!({ "attributes": { "TRANSLATION": offsets } });
    builder.glb(json!({
        "meshes": mesh(json!({ "attributes": attributes, "indices": indices, "material": 0, "mode": 5 })),
        "materials": [{
            "normalTexture": { "index": 0 },
            "emissiveFactor": [1, 1, 1],
            "alphaMode": "MASK",
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 9 } },
        }],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071 }],
        "images": [{ "bufferView": image }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }],
        "nodes": [
            { "mesh": 0, "children": [1, 2], "rotation": [0, 0, 0, 1] },
            { "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": instancing } },
        ],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot" }] } },
    }))
}

#[test]
fn the_whole_file_loads() {
    let parts = read_bytes("a.glb", &everything()).unwrap();
    assert_eq!(
        (parts.meshes[0].len(), parts.punctual.len(), parts.textures.len()),
        (6, 1, 1)
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Digits are replaced by digits and other bytes by anything, so that much of the JSON stays readable and wrong numbers
    /// get far.
    #[test]
    fn damaged_files_do_not_crash(damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut file = everything();
        let digits: Vec<usize> = (0..file.len()).filter(|&at| file[at].is_ascii_digit()).collect();
        for (at, value) in damage {
            if value % 4 == 0 {
                let at = at.index(file.len());
                file[at] = value;
            } else {
                file[digits[at.index(digits.len())]] = b'0' + value % 10;
            }
        }
        if let Ok(parts) = read_bytes("a.glb", &file) {
            for texture in &parts.textures {
                prop_assert_eq!(texture.texels.iter().count(), texture.texels.len());
            }
            let vertices = parts.meshes.iter().flat_map(|m| &m.positions);
            prop_assert!(vertices.into_iter().all(|p| p.is_finite()));
            for mesh in &parts.meshes {
                let corners = mesh.indices.as_flattened().iter();
                prop_assert!(corners.into_iter().all(|&v| (v as usize) < mesh.positions.len()));
                prop_assert!(mesh.materials.iter().all(|&m| (m as usize) < parts.materials.len()));
            }
        }
    }
}

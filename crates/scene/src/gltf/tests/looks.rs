//! Materials, textures, lights, cameras, and what the report says of them.

use super::*;
use crate::texture::Wrap;
use crate::{LightKind, luminance};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

fn material(json: Value) -> SceneParts {
    triangle().load(json!({
        "meshes": mesh(json!({ "attributes": { "POSITION": 0 }, "material": 0 })),
        "materials": [json],
    }))
}

#[test]
fn the_default_material_and_its_place() {
    let parts = triangle().load(json!({ "meshes": plain(), "materials": [{ "name": "unused" }] }));
    assert_eq!(parts.meshes[0].materials, [1]);
    let material = &parts.materials[1];
    assert_eq!(
        (material.base_color, material.metallic, material.roughness),
        (Vec3::ONE, 1.0, 1.0)
    );
    assert!(!material.double_sided && !material.emits() && material.alpha_cutoff.is_none());
    assert!(material.dielectric_f0.abs_diff_eq(Vec3::splat(0.04), 1e-6) && material.dielectric_f90 == 1.0);
}

#[test]
fn emission_times_strength_and_its_repair() {
    let emission = |factor: Value, strength: Value| {
        let extensions = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": strength } });
        let parts = material(json!({ "name": "lamp", "emissiveFactor": factor, "extensions": extensions }));
        (parts.materials[0].emission, warns(&parts, "'lamp': emission"))
    };
    assert_eq!(
        emission(json!([1, 0.5, 0]), json!(20)),
        (Vec3::new(20.0, 10.0, 0.0), false)
    );
    assert_eq!(
        emission(json!([-1, 0.5, 0]), json!(2)),
        (Vec3::new(0.0, 1.0, 0.0), true)
    );
    assert_eq!(emission(json!([1, 1, 0]), json!(1e39)), (Vec3::ZERO, true));
    assert_eq!(emission(json!([1, 1, 1]), json!(-1)), (Vec3::ZERO, true));
}

#[test]
fn reflectance_from_ior_and_specular() {
    let dielectric = |extensions: Value| {
        let parts = material(json!({ "extensions": extensions }));
        (parts.materials[0].dielectric_f0, parts.materials[0].dielectric_f90)
    };
    let near = |a: Vec3, b: [f32; 3]| assert!(a.abs_diff_eq(b.into(), 1e-5), "{a} instead of {b:?}");
    near(
        dielectric(json!({ "KHR_materials_ior": { "ior": 2 } })).0,
        [1.0 / 9.0; 3],
    );
    near(dielectric(json!({ "KHR_materials_ior": { "ior": 0 } })).0, [1.0; 3]);
    let specular = json!({ "specularFactor": 0.5, "specularColorFactor": [1, 0.5, 100] });
    let (f0, f90) = dielectric(json!({ "KHR_materials_specular": specular }));
    near(f0, [0.02, 0.01, 0.5]);
    assert_eq!(f90, 0.5);
    let archived =
        json!({ "diffuseFactor": [0.1, 0.2, 0.3, 1], "specularFactor": [0.5, 0.6, 0.7], "glossinessFactor": 0.25 });
    let parts = material(json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": archived } }));
    let m = &parts.materials[0];
    assert_eq!(
        (m.base_color, m.metallic, m.roughness),
        (Vec3::new(0.1, 0.2, 0.3), 0.0, 0.75)
    );
    near(m.dielectric_f0, [0.5, 0.6, 0.7]);
}

#[test]
fn alpha_modes() {
    assert_eq!(
        material(json!({ "alphaMode": "MASK" })).materials[0].alpha_cutoff,
        Some(0.5)
    );
    assert_eq!(
        material(json!({ "alphaMode": "MASK", "alphaCutoff": 0.2 })).materials[0].alpha_cutoff,
        Some(0.2)
    );
    let blend = material(json!({ "alphaMode": "BLEND" }));
    assert_eq!(blend.materials[0].alpha_cutoff, Some(0.5));
    assert!(blend.report.ignored.keys().any(|key| key.contains("BLEND")));
}

#[test]
fn factors_out_of_range_are_clamped_with_a_warning() {
    let parts = material(json!({ "name": "odd", "pbrMetallicRoughness": {
        "baseColorFactor": [2, -1, 0.5, 1], "roughnessFactor": 7 } }));
    assert_eq!(parts.materials[0].base_color, Vec3::new(1.0, 0.0, 0.5));
    assert_eq!(parts.materials[0].roughness, 1.0);
    assert!(warns(&parts, "'odd': baseColorFactor"));
}

#[test]
fn what_is_ignored_is_counted() {
    let glass = json!({ "extensions": { "KHR_materials_transmission": {}, "KHR_materials_unlit": {} } });
    let mut builder = triangle();
    builder.accessors[0]["min"] = json!([0, 0, 0]);
    let parts = builder.load(json!({
        "extensionsUsed": ["KHR_materials_transmission", "KHR_xmp_json_ld", "KHR_lights_punctual"],
        "meshes": mesh(json!({ "attributes": { "POSITION": 0 }, "material": 0, "targets": [{}] })),
        "materials": [glass, glass],
        "animations": [{}, {}],
        "skins": [{}],
        "scenes": [{ "nodes": [0] }, {}],
    }));
    let count = |what: &str| {
        parts
            .report
            .ignored
            .iter()
            .find(|(key, _)| key.starts_with(what))
            .map(|(_, &n)| n)
    };
    assert_eq!(count("KHR_materials_transmission"), Some(2));
    assert_eq!(count("KHR_materials_unlit"), Some(1), "only the used one matters");
    assert_eq!(count("KHR_xmp_json_ld"), Some(1));
    assert_eq!(count("KHR_lights_punctual"), None);
    assert_eq!(
        (count("animations"), count("skins"), count("morph"), count("scenes")),
        (Some(2), Some(1), Some(1), Some(1))
    );
}

/// A file with a 2 x 1 image, and the material that `textures` describes.
fn textured(material: Value, attributes: &[&str]) -> SceneParts {
    let mut builder = triangle();
    let mut all = json!({ "POSITION": 0, "NORMAL": builder.floats(&[[0.0, 0.0, 1.0]; 3]) });
    for name in attributes {
        all[*name] = builder.floats(&[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]).into();
    }
    let image = builder.view(&png(2, &[[255, 0, 0, 255], [0, 0, 128, 255]]));
    builder.load(json!({
        "meshes": mesh(json!({ "attributes": all, "material": 0 })),
        "materials": [material],
        "textures": [{ "source": 0 }, { "source": 0, "sampler": 0 }, { "source": 1 }],
        "samplers": [{ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 }],
        "images": [{ "bufferView": image, "name": "two" }, { "uri": "not there, and not needed.png" }],
    }))
}

#[test]
fn textures_are_decoded_once_per_use() {
    let parts = textured(
        json!({
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 0 },
                "metallicRoughnessTexture": { "index": 0 },
            },
            "emissiveTexture": { "index": 1 },
            "emissiveFactor": [1, 1, 1],
            "occlusionTexture": { "index": 2 },
        }),
        &["TEXCOORD_0"],
    );
    let material = &parts.materials[0];
    let texture = |r: Option<crate::texture::TextureRef>| &parts.textures[r.unwrap().texture as usize];
    assert_eq!(parts.textures.len(), 3);
    let [base, data, glow] = [
        texture(material.base_color_texture),
        texture(material.metallic_roughness_texture),
        texture(material.emissive_texture),
    ];
    assert!(base.srgb && !data.srgb && glow.srgb);
    assert_eq!((glow.wrap, glow.nearest), ([Wrap::Clamp, Wrap::Mirror], true));
    assert_eq!((base.wrap, base.nearest), ([Wrap::Repeat; 2], false));
    assert_eq!((base.width, base.height, base.texels[1]), (2, 1, [0, 0, 128, 255]));
    assert_eq!(parts.meshes[0].uvs.len(), 3);
    assert!(parts.meshes[0].tangents.is_empty() && parts.meshes[0].uvs1.is_empty());
    assert!(parts.report.skipped.iter().any(|text| text.starts_with("1 images")));
    // An emissive texture on a material that does not emit is no work.
    let dark = textured(json!({ "emissiveTexture": { "index": 1 } }), &["TEXCOORD_0"]);
    assert!(dark.textures.is_empty() && dark.meshes[0].uvs.is_empty());
}

#[test]
fn texture_transforms_and_second_coordinates() {
    let transform = json!({ "offset": [0.5, 0.25], "rotation": PI / 2.0, "scale": [2, 3], "texCoord": 1 });
    let info = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
    let parts = textured(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": info } }),
        &["TEXCOORD_1"],
    );
    let texture = parts.materials[0].base_color_texture.unwrap();
    assert_eq!(texture.uv_set, 1);
    assert_eq!((parts.meshes[0].uvs.len(), parts.meshes[0].uvs1.len()), (0, 3));
    // Scale, then a quarter turn counter-clockwise on the image, where v runs down: u goes to -v, v to u.
    let moved = texture.columns * Vec2::new(0.1, 0.2) + texture.offset;
    assert!(moved.abs_diff_eq(Vec2::new(0.5 + 0.6, 0.25 - 0.2), 1e-6), "{moved}");
}

#[test]
fn tangents_are_generated_where_normal_maps_need_them() {
    let parts = textured(
        json!({ "normalTexture": { "index": 0, "scale": 0.5 } }),
        &["TEXCOORD_0"],
    );
    assert_eq!(parts.materials[0].normal_scale, 0.5);
    // The image stands upright on the triangle: u along x, and the bitangent, up on the image, along y.
    for tangent in &parts.meshes[0].tangents {
        assert!(
            tangent.abs_diff_eq(glam::Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6),
            "{tangent}"
        );
    }
    assert_eq!(parts.meshes[0].tangents.len(), 3);
    let bare = textured(json!({ "normalTexture": { "index": 0 } }), &[]);
    assert!(
        bare.meshes[0]
            .tangents
            .iter()
            .all(|t| (t.truncate().length() - 1.0).abs() < 1e-6)
    );
    assert!(warns(&bare, "no TEXCOORD_0"));
}

#[test]
fn mirrored_textures_get_vertices_of_their_own() {
    let mut builder = Builder::default();
    // Two triangles that share an edge, their texture mirrored along it.
    builder.floats(&[[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
    let uvs = builder.floats(&[[0.0, 1.0], [0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]);
    let normals = builder.floats(&[[0.0, 0.0, 1.0]; 4]);
    let indices = builder.indices(&[0, 2, 1, 0, 1, 3]);
    let image = builder.view(&png(1, &[[128, 128, 255, 255]]));
    let attributes = json!({ "POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs });
    let parts = builder.load(json!({
        "meshes": mesh(json!({ "attributes": attributes, "indices": indices, "material": 0 })),
        "materials": [{ "normalTexture": { "index": 0 } }],
        "textures": [{ "source": 0 }],
        "images": [{ "bufferView": image }],
    }));
    let mesh = &parts.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.uvs.len(), mesh.normals.len()), (6, 6, 6));
    for (triangle, x, w) in [(0, 1.0, 1.0), (1, -1.0, -1.0)] {
        for vertex in mesh.indices[triangle] {
            let expected = glam::Vec4::new(x, 0.0, 0.0, w);
            assert!(
                mesh.tangents[vertex as usize].abs_diff_eq(expected, 1e-6),
                "{:?}",
                mesh.tangents
            );
        }
    }
}

fn lit(light: Value, node: Value) -> SceneParts {
    let mut node = node;
    node["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    triangle().load(json!({
        "nodes": [node],
        "extensions": { "KHR_lights_punctual": { "lights": [light] } },
    }))
}

#[test]
fn punctual_lights() {
    let node = json!({ "name": "bulb", "translation": [1, 2, 3], "rotation": [0, 1, 0, 0], "scale": [5, 5, 5] });
    let parts = lit(
        json!({ "type": "point", "color": [1, 0.5, 0], "intensity": 8, "range": 4, "name": "p" }),
        node.clone(),
    );
    let (light, origin) = &parts.punctual[0];
    assert_eq!((light.kind, light.range), (LightKind::Point, 4.0));
    assert_eq!(
        (light.position_ws, light.intensity),
        (Vec3::new(1.0, 2.0, 3.0), Vec3::new(8.0, 4.0, 0.0))
    );
    assert!((light.power - 4.0 * PI * luminance(light.intensity)).abs() < 1e-3);
    assert_eq!((origin.node.as_str(), origin.mesh.as_str()), ("bulb", "p"));

    let parts = lit(json!({ "type": "directional" }), node.clone());
    let light = &parts.punctual[0].0;
    assert_eq!((light.kind, light.intensity), (LightKind::Directional, Vec3::ONE));
    assert!(
        light.normal_ws.abs_diff_eq(Vec3::Z, 1e-6),
        "half a turn about y takes -z to z: {}",
        light.normal_ws
    );

    let spot = json!({ "innerConeAngle": 0.3, "outerConeAngle": 0.6 });
    let parts = lit(json!({ "type": "spot", "spot": spot }), node);
    let light = &parts.punctual[0].0;
    assert!((light.cos_inner - 0.3_f32.cos()).abs() < 1e-6 && (light.cos_outer - 0.6_f32.cos()).abs() < 1e-6);
    // The power against a sum over the cone of the falloff that the extension gives.
    let steps = 20_000;
    let integral: f64 = (0..steps)
        .map(|i| {
            let cos = 1.0 - (i as f64 + 0.5) / f64::from(steps);
            let (inner, outer) = (f64::from(light.cos_inner), f64::from(light.cos_outer));
            ((cos - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2) / f64::from(steps)
        })
        .sum();
    assert!((f64::from(light.power) / (2.0 * std::f64::consts::PI * integral) - 1.0).abs() < 1e-3);
}

#[test]
fn lights_that_are_odd() {
    for (light, warning) in [
        (json!({ "type": "point", "intensity": 0 }), "intensity 0, left out"),
        (json!({ "type": "point", "intensity": -3 }), "negative or not finite"),
        (json!({ "type": "point", "intensity": 1e39 }), "negative or not finite"),
    ] {
        let parts = lit(light, json!({}));
        assert!(parts.punctual.is_empty() && warns(&parts, warning));
    }
    let parts = lit(
        json!({ "type": "spot", "spot": { "innerConeAngle": 2, "outerConeAngle": 1 } }),
        json!({}),
    );
    let light = &parts.punctual[0].0;
    assert!(light.cos_inner > light.cos_outer && warns(&parts, "cone angles"));
    let parts = lit(json!({ "type": "ambient" }), json!({}));
    assert!(parts.punctual.is_empty() && parts.report.ignored.keys().any(|key| key.contains("unknown type")));
    let flat = lit(json!({ "type": "directional" }), json!({ "scale": [0, 0, 0] }));
    assert!(flat.punctual.is_empty() && warns(&flat, "no direction"));
}

#[test]
fn cameras_keep_rotation_and_translation() {
    let parts = triangle().load(json!({
        "meshes": plain(),
        "nodes": [
            { "name": "eye", "camera": 0, "translation": [0, 1, 9], "scale": [-2, 3, 4], "children": [1] },
            { "name": "eye", "camera": 1 },
        ],
        "cameras": [
            { "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } },
            { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 2, "zfar": 1, "znear": 0 } },
        ],
    }));
    assert_eq!(parts.cameras.len(), 2);
    let camera = &parts.cameras[0];
    assert_eq!((camera.name.as_str(), camera.fov_y), ("eye", 0.7));
    let pose = camera.world_from_camera;
    assert!((pose.matrix3.determinant() - 1.0).abs() < 1e-5);
    assert!(
        pose.transform_point3(Vec3::NEG_Z)
            .abs_diff_eq(Vec3::new(0.0, 1.0, 8.0), 1e-5)
    );
    assert_ne!(parts.cameras[1].name, "eye");
    assert!(parts.report.ignored.keys().any(|key| key.contains("orthographic")));
}

#[test]
fn a_made_up_camera_sees_the_scene() {
    let parts = triangle().load(json!({ "meshes": plain() }));
    let camera = &parts.cameras[0];
    let to_camera = camera.world_from_camera.inverse();
    for corner in parts.meshes[0].corners(0) {
        let p = to_camera.transform_point3(corner);
        assert!(
            p.z < 0.0 && p.x.hypot(p.y) / -p.z < (0.5 * camera.fov_y).tan() * 1.01,
            "{p}"
        );
    }
}

#[test]
fn a_made_up_camera_enters_rooms_but_not_boxes() {
    // A long box of unit cross-section; inward or outward winding.
    let corner = |i: usize| [(i & 1) as f32 * 4.0, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32];
    let faces: [u16; 36] = [
        0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5,
    ];
    let eye = |inward: bool| {
        let mut builder = Builder::default();
        builder.floats(&std::array::from_fn::<_, 8, _>(corner));
        let mut indices = faces;
        if inward {
            indices.as_chunks_mut::<3>().0.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let indices = builder.indices(&indices);
        let primitive = json!({ "attributes": { "POSITION": 0 }, "indices": indices });
        let parts = builder.load(json!({ "meshes": mesh(primitive) }));
        Vec3::from(parts.cameras[0].world_from_camera.translation)
    };
    let inside = |p: Vec3| p.cmpgt(Vec3::ZERO).all() && p.cmplt(Vec3::new(4.0, 1.0, 1.0)).all();
    assert!(inside(eye(true)) && !inside(eye(false)), "{} {}", eye(true), eye(false));
}

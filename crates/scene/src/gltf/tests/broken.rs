//! Broken files: one clear error, or a warning and the right scene.

use super::*;

/// Asserts that reading fails with a message that holds all of `parts`.
fn refused(result: Result<SceneParts, SceneError>, parts: &[&str]) {
    let message = result.expect_err("should be refused").to_string();
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
}

#[test]
fn missing_file() {
    refused(
        read("nowhere/at/all.glb".as_ref()),
        &["nowhere/at/all.glb", "cannot read scene"],
    );
    refused(read(std::env::temp_dir().as_path()), &["not a regular file"]);
}

#[test]
fn missing_buffer_and_image() {
    let mut json = triangle().json(json!({ "meshes": plain() }));
    json["buffers"][0]["uri"] = "lost.bin".into();
    refused(
        read_json(&json),
        &["lost.bin", "buffer 0", "test.gltf", "check the path"],
    );
    json["buffers"][0].as_object_mut().unwrap().remove("uri");
    refused(read_json(&json), &["buffer 0", "no URI"]);
    refused(
        textured(json!({ "uri": "lost%20wood.png" })),
        &["lost wood.png", "image 0"],
    );
}

#[test]
fn paths_that_are_not_relative_are_refused() {
    for uri in [
        "http://example.com/a.bin",
        "file:///etc/passwd",
        "/etc/passwd",
        "a\0b",
        "",
    ] {
        let mut json = triangle().json(json!({ "meshes": plain() }));
        json["buffers"][0]["uri"] = uri.into();
        refused(read_json(&json), &["buffer 0", "not a path relative to the file"]);
    }
}

#[test]
fn truncated_or_damaged_containers() {
    let whole = triangle().glb(json!({ "meshes": plain() }));
    assert!(read_bytes("whole.glb", &whole).is_ok());
    for length in 0..whole.len() {
        assert!(
            read_bytes("cut.glb", &whole[..length]).is_err(),
            "cut at {length} bytes"
        );
    }
    refused(
        read_bytes("cut.glb", &whole[..whole.len() - 1]),
        &["GLB container", "claims"],
    );
    let mut old = whole;
    old[4] = 1;
    refused(read_bytes("old.glb", &old), &["version 1", "glTF 2.0"]);
}

#[test]
fn short_buffers_and_views() {
    let mut json = triangle().json(json!({ "meshes": plain() }));
    json["buffers"][0]["byteLength"] = 37.into();
    refused(read_json(&json), &["buffer 0", "claims 37 bytes, but there are 36"]);
    let mut json = triangle().json(json!({ "meshes": plain() }));
    json["bufferViews"][0]["byteLength"] = 40.into();
    refused(read_json(&json), &["bufferView 0", "claims 40 bytes"]);
    json["bufferViews"][0]["byteOffset"] = u64::MAX.into();
    refused(read_json(&json), &["bufferView 0"]);
}

#[test]
fn a_billion_claimed_elements() {
    for count in [4, 1_000_000_000, u64::from(u32::MAX) + 1, u64::MAX] {
        let mut builder = triangle();
        builder.accessors[0]["count"] = count.into();
        refused(builder.read(json!({ "meshes": plain() })), &["accessor 0", "claims"]);
        builder.accessors[0].as_object_mut().unwrap().remove("bufferView");
        if count > 4 {
            refused(builder.read(json!({ "meshes": plain() })), &["accessor 0", "claims"]);
        }
    }
}

#[test]
fn little_data_shared_without_end() {
    let mut builder = Builder::default();
    builder.floats(&vec![[0.0; 3]; 60_000]);
    let primitives = vec![json!({ "attributes": { "POSITION": 0 } }); 200];
    let meshes = json!([{ "primitives": primitives }]);
    refused(builder.read(json!({ "meshes": meshes })), &["unfolds to more than"]);
}

#[test]
fn indices_out_of_range() {
    let mut builder = triangle();
    let indices = builder.indices(&[0, 1, 3]);
    let primitive = json!({ "attributes": { "POSITION": 0 }, "indices": indices });
    refused(
        builder.read(json!({ "meshes": mesh(primitive) })),
        &["mesh 0 'mesh' primitive 0", "index 2 is 3", "3 vertices"],
    );
    for (rest, what) in [
        (
            json!({ "meshes": mesh(json!({ "attributes": { "POSITION": 9 } })) }),
            "accessor 9",
        ),
        (
            json!({ "meshes": mesh(json!({ "attributes": { "POSITION": 0 }, "indices": 9 })) }),
            "accessor 9",
        ),
        (
            json!({ "meshes": mesh(json!({ "attributes": { "POSITION": 0 }, "material": 9 })) }),
            "material 9",
        ),
        (
            json!({ "meshes": mesh(json!({ "attributes": { "POSITION": 0 }, "mode": 9 })) }),
            "unknown mode",
        ),
        (json!({ "meshes": [], "nodes": [{ "mesh": 9 }] }), "mesh 9"),
        (json!({ "nodes": [{ "camera": 9 }] }), "camera 9"),
        (json!({ "nodes": [{ "children": [9] }] }), "child node 9"),
        (
            json!({ "nodes": [{ "extensions": { "KHR_lights_punctual": { "light": 9 } } }] }),
            "light 9",
        ),
        (json!({ "scenes": [{ "nodes": [9] }] }), "node 9"),
        (json!({ "scene": 9 }), "scene 9"),
    ] {
        refused(triangle().read(rest), &[what]);
    }
    let mut builder = triangle();
    builder.views[0]["buffer"] = 9.into();
    refused(
        builder.read(json!({ "meshes": plain() })),
        &["bufferView 0", "buffer 9"],
    );
    builder.accessors[0]["bufferView"] = 9.into();
    refused(
        builder.read(json!({ "meshes": plain() })),
        &["accessor 0", "bufferView 9"],
    );
}

#[test]
fn accessors_that_make_no_sense() {
    for (key, value, message) in [
        ("type", json!("VEC2"), "type 'VEC2' instead of VEC3"),
        ("type", json!("VEC9"), "unknown type"),
        ("componentType", json!(5124), "unknown componentType"),
        ("componentType", json!(5125), "32-bit integers"),
        ("byteOffset", json!(4), "claims 3 elements"),
        ("byteOffset", json!(u64::MAX), "claims 3 elements"),
    ] {
        let mut builder = triangle();
        builder.accessors[0][key] = value;
        refused(builder.read(json!({ "meshes": plain() })), &["POSITION", message]);
    }
    let mut builder = triangle();
    builder.views[0]["byteStride"] = 4.into();
    refused(builder.read(json!({ "meshes": plain() })), &["byteStride 4"]);
    let mut builder = triangle();
    let normals = builder.floats(&[[0.0, 0.0, 1.0]; 2]);
    let primitive = json!({ "attributes": { "POSITION": 0, "NORMAL": normals } });
    refused(
        builder.read(json!({ "meshes": mesh(primitive) })),
        &["NORMAL has 2 elements, POSITION 3"],
    );
}

#[test]
fn positions_that_are_not_numbers() {
    for (bad, message) in [
        (f32::NAN, "not finite"),
        (f32::INFINITY, "not finite"),
        (-1e12, "more than 1e9 m away"),
    ] {
        let mut builder = Builder::default();
        builder.floats(&[[0.0; 3], [1.0, bad, 0.0], [0.0; 3]]);
        refused(
            builder.read(json!({ "meshes": plain() })),
            &["mesh 0 'mesh' primitive 0, accessor 0", "POSITION 1", message],
        );
    }
    let far = json!({ "meshes": plain(), "nodes": [{ "mesh": 0, "scale": [1e12, 1, 1] }] });
    refused(triangle().read(far), &["more than 1e9 m away"]);
    let infinite = json!({ "meshes": plain(), "nodes": [{ "mesh": 0, "scale": [1e39, 1, 1] }] });
    refused(triangle().read(infinite), &["node 0", "not finite"]);
}

#[test]
fn triangles_without_area_are_kept_and_counted() {
    let mut builder = Builder::default();
    builder.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0; 3], [0.0; 3], [0.0; 3]]);
    let parts = builder.load(json!({ "meshes": plain() }));
    assert_eq!(parts.meshes[0].len(), 2);
    assert!(warns(&parts, "2 triangles have no area"));
}

#[test]
fn no_geometry_no_lights_no_camera() {
    for parts in [
        read_json(&json!({ "asset": { "version": "2.0" } })).unwrap(),
        triangle().load(json!({ "meshes": [{ "primitives": [] }] })),
        triangle().load(json!({ "meshes": mesh(json!({ "attributes": {} })) })),
    ] {
        assert!(parts.meshes.is_empty() && parts.instances.is_empty() && parts.punctual.is_empty());
        assert!(warns(&parts, "no triangles") && warns(&parts, "no lights") && warns(&parts, "no camera"));
        assert_eq!(parts.cameras.len(), 1);
        let camera = &parts.cameras[0];
        assert!(camera.world_from_camera.is_finite());
    }
}

#[test]
fn node_graphs_that_are_no_trees() {
    let nodes = |nodes: Value| triangle().read(json!({ "nodes": nodes }));
    refused(
        nodes(json!([{ "children": [0] }])),
        &["node 0", "own ancestor", "cycle"],
    );
    refused(
        nodes(json!([{}, { "children": [2] }, { "children": [3] }, { "children": [1] }])),
        &["own ancestor"],
    );
    refused(
        nodes(json!([{ "children": [2], "name": "a" }, { "children": [2] }, {}])),
        &["node 2", "two nodes, node 0 'a' and node 1"],
    );
    refused(nodes(json!([{ "children": [1, 1] }, {}])), &["node 1", "two nodes"]);
    let listed = json!({ "scenes": [{ "nodes": [0, 1] }], "nodes": [{ "children": [1] }, {}] });
    refused(triangle().read(listed), &["node 1", "shown twice"]);
}

#[test]
fn deep_hierarchies() {
    let chain = |length: usize| {
        let nodes: Vec<Value> = (0..length)
            .map(|i| {
                if i + 1 < length {
                    json!({ "children": [i + 1] })
                } else {
                    json!({})
                }
            })
            .collect();
        triangle().read(json!({ "nodes": nodes }))
    };
    assert!(chain(5_000).is_ok());
    refused(chain(20_000), &["levels deep"]);
}

#[test]
fn members_that_nothing_here_depends_on_may_be_missing() {
    let parts = triangle().load(json!({
        "meshes": [{}, { "primitives": [{}] }, { "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "nodes": [{ "mesh": 2 }, { "camera": 0 }],
        "scenes": [{ "nodes": [0, 1] }, {}],
        "cameras": [{ "perspective": { "yfov": 0.5 } }, { "orthographic": { "ymag": 1 } }],
        "animations": [{ "channels": [{ "sampler": 0, "target": { "path": "pointer" } }], "samplers": [] }],
        "skins": [{}],
        "extensions": { "KHR_lights_punctual": {} },
    }));
    assert_eq!((parts.meshes[0].len(), parts.cameras[0].fov_y), (1, 0.5));
    assert_eq!(parts.report.ignored["animations"], 1);
    // Errors of such files are those that remain.
    let file = |meshes: Value| read_json(&json!({ "asset": { "version": "2.0" }, "scenes": [{}], "meshes": meshes }));
    refused(file(json!({})), &["JSON: invalid type: map, expected a sequence"]);
    refused(
        read_json(&json!({ "asset": {}, "scenes": [] })),
        &["missing field `version` at line 1"],
    );
}

#[test]
fn materials_and_extensions_that_make_no_sense() {
    let material = |material: Value| {
        triangle().read(json!({
            "meshes": mesh(json!({ "attributes": { "POSITION": 0 }, "material": 0 })),
            "materials": [material],
            "textures": [{}],
        }))
    };
    refused(
        material(json!({ "alphaMode": "GLASS", "name": "a" })),
        &["material 0 'a'", "unknown alphaMode"],
    );
    let transform = json!({ "KHR_texture_transform": { "offset": 1 } });
    refused(
        material(json!({ "normalTexture": { "index": 0, "extensions": transform } })),
        &["material 0", "normalTexture"],
    );
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": 1 } });
    refused(
        triangle().read(json!({ "meshes": plain(), "nodes": [{ "mesh": 0, "extensions": instancing }] })),
        &["node 0", "instancing"],
    );
}

#[test]
fn text_that_is_no_gltf() {
    refused(read_bytes("a.gltf", b""), &["a.gltf", "JSON"]);
    refused(read_bytes("a.gltf", b"<html>"), &["JSON", "line 1"]);
    refused(read_bytes("a.gltf", "[".repeat(100_000).as_bytes()), &["JSON"]);
    refused(
        read_json(&json!({ "asset": { "version": "1.0" } })),
        &["glTF version '1.0'"],
    );
    refused(
        read_json(&json!({ "asset": { "version": "2.1", "minVersion": "2.1" } })),
        &["needs a reader of glTF version '2.1'"],
    );
}

#[test]
fn required_extensions() {
    let names = json!([
        "KHR_draco_mesh_compression",
        "KHR_lights_punctual",
        "EXT_meshopt_compression"
    ]);
    refused(
        triangle().read(json!({ "extensionsRequired": names })),
        &["requires KHR_draco_mesh_compression, EXT_meshopt_compression,"],
    );
}

#[test]
fn images_that_cannot_be_decoded() {
    let png = png(2, &[[9; 4]; 4]);
    let uri = |bytes: &[u8]| json!({ "uri": format!("data:image/png;base64,{}", base64(bytes)), "name": "wood" });
    assert!(textured(uri(&png)).is_ok());
    refused(
        textured(uri(&png[..40])),
        &["image 0 'wood'", "cannot be decoded", "replace the image"],
    );
    refused(
        textured(uri(b"RIFF....WEBP")),
        &["image 0 'wood'", "neither PNG nor JPEG"],
    );
    refused(
        textured(json!({ "name": "wood" })),
        &["image 0 'wood'", "neither URI nor bufferView"],
    );
    // A header that claims 65535 x 65535 texels.
    let mut huge = png;
    huge[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    assert!(textured(uri(&huge)).is_err());
}

/// A triangle with `image` as base colour.
fn textured(image: Value) -> Result<SceneParts, SceneError> {
    let mut builder = triangle();
    let uvs = builder.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    builder.read(json!({
        "meshes": mesh(json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": uvs }, "material": 0 })),
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }],
        "images": [image],
    }))
}

//! Transforms, indices, modes, quantisation, sparse data, instances.

use super::*;
use crate::gltf::merge::{Motion, append};
use crate::{PrimitiveId, Ray, Scene};
use glam::{Affine3A, DAffine3, DQuat, DVec3, EulerRot, Vec2, Vec3, Vec4};

fn positions(parts: &SceneParts) -> Vec<Vec3> {
    let mesh = &parts.meshes[0];
    mesh.indices
        .as_flattened()
        .iter()
        .map(|&v| mesh.positions[v as usize])
        .collect()
}

fn close(a: &[Vec3], b: &[[f32; 3]]) {
    assert_eq!(a.len(), b.len());
    for (a, &b) in a.iter().zip(b) {
        assert!(a.abs_diff_eq(b.into(), 1e-5), "{a} instead of {b:?}");
    }
}

#[test]
fn hierarchies_of_matrices_and_trs() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let parts = triangle().load(json!({
        "meshes": plain(),
        "nodes": [
            { "children": [1], "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 10, 0, 0, 1] },
            // A quarter turn about z, its quaternion not quite of unit length, after a scale.
            { "mesh": 0, "name": "lamp", "translation": [0, 1, 0], "rotation": [0, 0, 1.01 * half, 1.01 * half],
              "scale": [1, 3, 1] },
        ],
    }));
    close(
        &positions(&parts),
        &[[10.0, 2.0, 0.0], [10.0, 4.0, 0.0], [4.0, 2.0, 0.0]],
    );
    assert_eq!(parts.origins, [("lamp".to_string(), "mesh".to_string())]);
    assert_eq!(parts.meshes[0].origins, [0]);
    assert!(parts.instances[0].identity);
}

#[test]
fn mirrored_nodes_keep_their_front() {
    for scale in [[-1.0, 1.0, 1.0], [1.0, 1.0, -2.0], [-1.0, -1.0, -1.0], [1.0, 2.0, 1.0]] {
        let mut builder = triangle();
        let normals = builder.floats(&[[0.6, 0.0, 0.8]; 3]);
        let primitive = json!({ "attributes": { "POSITION": 0, "NORMAL": normals } });
        let nodes = json!([{ "mesh": 0, "scale": scale }]);
        let parts = builder.load(json!({ "meshes": mesh(primitive), "nodes": nodes }));
        let mesh = &parts.meshes[0];
        let [a, b, c] = mesh.corners(0);
        let geometric = (b - a).cross(c - a).normalize();
        // glTF flips the winding of mirrored nodes, so the front of a triangle in the xy plane follows its z axis.
        assert!(
            geometric.abs_diff_eq(Vec3::Z * f32::signum(scale[2]), 1e-6),
            "{scale:?}: {geometric}"
        );
        let normal = mesh.normals[mesh.indices[0][0] as usize];
        assert!(
            geometric.dot(normal) > 0.1 && (normal.length() - 1.0).abs() < 1e-6,
            "{scale:?}: {normal}"
        );
    }
}

#[test]
fn index_types() {
    let corners = [2_u32, 0, 1, 1, 3, 2];
    let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    for component in [5121, 5123, 5125] {
        let mut builder = Builder::default();
        builder.floats(&points);
        let bytes: Vec<u8> = match component {
            5121 => corners.iter().map(|&c| c as u8).collect(),
            5123 => corners.iter().flat_map(|&c| (c as u16).to_le_bytes()).collect(),
            _ => corners.iter().flat_map(|c| c.to_le_bytes()).collect(),
        };
        let indices = builder.accessor(&bytes, component, "SCALAR", corners.len());
        let primitive = json!({ "attributes": { "POSITION": 0 }, "indices": indices });
        let parts = builder.load(json!({ "meshes": mesh(primitive) }));
        close(&positions(&parts), &corners.map(|c| points[c as usize]));
    }
}

#[test]
fn modes() {
    let mut builder = Builder::default();
    builder.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    let count = |mode: u32| {
        let primitive = json!({ "attributes": { "POSITION": 0 }, "mode": mode });
        let parts = builder.load(json!({ "meshes": mesh(primitive) }));
        (parts.meshes.first().map_or(0, |m| m.len()), parts.report.ignored.len())
    };
    assert_eq!(
        [0, 1, 2, 3, 4, 5, 6].map(count),
        [(0, 1), (0, 1), (0, 1), (0, 1), (1, 0), (2, 0), (2, 0)]
    );
}

#[test]
fn quantised_attributes() {
    let mut builder = Builder::default();
    let position = builder.accessor(&[0_u8, 0, 0, 0, 2, 0, 0, 0, 0, 4, 0, 0], 5121, "VEC3", 3);
    builder.views[0]["byteStride"] = 4.into();
    let normal = builder.accessor(&[0, 0, 127, 0, 0x81, 0, 0, 0, 0x80, 0, 0, 0], 5120, "VEC3", 3);
    builder.views[1]["byteStride"] = 4.into();
    builder.accessors[normal]["normalized"] = true.into();
    let words = |values: &[u16]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let uv = builder.accessor(&words(&[0, 0, 65535, 0, 0, 32768]), 5123, "VEC2", 3);
    builder.accessors[uv]["normalized"] = true.into();
    let color = builder.accessor(
        &[255, 0, 51, 255, 255, 255, 255, 255, 255, 255, 255, 0],
        5121,
        "VEC4",
        3,
    );
    builder.accessors[color]["normalized"] = true.into();
    let attributes = json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color });
    let mut file = with_texture(json!({ "attributes": attributes, "material": 0 }));
    file["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let parts = builder.load(file);
    let mesh = &parts.meshes[0];
    close(&mesh.positions, &[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
    close(&mesh.normals, &[[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
    assert_eq!(mesh.uvs[..2], [Vec2::ZERO, Vec2::X]);
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.2, 1.0));
    assert_eq!(mesh.colors[2].w, 0.0);
}

#[test]
fn signed_shorts_unnormalised() {
    let mut builder = Builder::default();
    let values: Vec<u8> = [0_i16, 0, 0, -300, 0, 0, 0, 500, 0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    builder.accessor(&values, 5122, "VEC3", 3);
    let parts = builder.load(json!({ "meshes": plain() }));
    close(&positions(&parts), &[[0.0; 3], [-300.0, 0.0, 0.0], [0.0, 500.0, 0.0]]);
}

#[test]
fn interleaved_and_offset() {
    let mut builder = Builder::default();
    let rows: Vec<u8> = (TRIANGLE.iter())
        .flat_map(|p| [7.0, p[0], p[1], p[2], 9.0])
        .flat_map(|v: f32| v.to_le_bytes())
        .collect();
    builder.accessor(&rows, 5126, "VEC3", 3);
    builder.views[0]["byteStride"] = 20.into();
    builder.accessors[0]["byteOffset"] = 4.into();
    close(&positions(&builder.load(json!({ "meshes": plain() }))), &TRIANGLE);
}

#[test]
fn sparse_accessors_with_and_without_base() {
    for base in [true, false] {
        let mut builder = triangle();
        let indices = builder.view(&[1, 2]);
        let values: Vec<u8> = [5.0_f32, 0.0, 0.0, 0.0, 6.0, 0.0]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let values = builder.view(&values);
        builder.accessors[0]["sparse"] = json!({
            "count": 2,
            "indices": { "bufferView": indices, "componentType": 5121 },
            "values": { "bufferView": values },
        });
        if !base {
            builder.accessors[0].as_object_mut().unwrap().remove("bufferView");
        }
        let parts = builder.load(json!({ "meshes": plain() }));
        close(&positions(&parts), &[[0.0; 3], [5.0, 0.0, 0.0], [0.0, 6.0, 0.0]]);
        builder.accessors[0]["sparse"]["count"] = 3.into();
        assert!(
            builder.read(json!({ "meshes": plain() })).is_err(),
            "indices end too early"
        );
    }
}

#[test]
fn primitives_with_and_without_normals_in_one_mesh() {
    let mut builder = triangle();
    let normals = builder.floats(&[[0.0, 0.0, 5.0]; 3]);
    let flat = json!({ "attributes": { "POSITION": 0 } });
    let smooth = json!({ "attributes": { "POSITION": 0, "NORMAL": normals } });
    let parts = builder.load(json!({ "meshes": [{ "primitives": [flat, smooth, flat] }] }));
    let normals = &parts.meshes[0].normals;
    assert_eq!(normals.len(), 9);
    assert!(normals[..3].iter().chain(&normals[6..]).all(|&n| n == Vec3::ZERO));
    assert!(normals[3..6].iter().all(|&n| n == Vec3::Z));
    assert_eq!(parts.meshes[0].indices[2], [6, 7, 8]);
    let flat = triangle().load(json!({ "meshes": plain() }));
    assert!(flat.meshes[0].normals.is_empty() && flat.meshes[0].uvs.is_empty());
}

#[test]
fn large_meshes_are_instanced_and_small_ones_copied() {
    let mut builder = Builder::default();
    let corners: Vec<[f32; 3]> = (0..15_000).flat_map(|_| TRIANGLE).collect();
    builder.floats(&corners);
    builder.floats(&TRIANGLE);
    let large = json!({ "primitives": [{ "attributes": { "POSITION": 0 } }], "name": "large" });
    let small = json!({ "primitives": [{ "attributes": { "POSITION": 1 } }], "name": "small" });
    let node = |mesh: usize, x: f32| json!({ "mesh": mesh, "translation": [x, 0, 0] });
    let file = |copies: usize| {
        let mut nodes: Vec<Value> = (0..copies).map(|i| node(0, i as f32)).collect();
        nodes.extend([node(1, 50.0), node(1, 60.0)]);
        // Flattened to a line: there is no way back for rays, so it cannot be an instance.
        nodes.push(json!({ "mesh": 0, "scale": [1, 0, 0] }));
        let roots: Vec<usize> = (0..nodes.len()).collect();
        builder.load(json!({ "meshes": [large, small], "nodes": nodes, "scenes": [{ "nodes": roots }] }))
    };
    let once = file(1);
    assert_eq!((once.meshes.len(), once.instances.len()), (1, 1));
    assert_eq!(once.meshes[0].len(), 30_002);

    let parts = file(3);
    assert_eq!((parts.meshes.len(), parts.instances.len()), (2, 4));
    assert_eq!((parts.meshes[0].len(), parts.meshes[1].len()), (15_002, 15_000));
    assert!(parts.instances[0].identity && parts.instances[0].mesh == 0);
    for (i, instance) in parts.instances[1..].iter().enumerate() {
        let at = instance.world_from_local.transform_point3(Vec3::Y);
        assert_eq!((instance.mesh, at), (1, Vec3::new(i as f32, 1.0, 0.0)));
        assert_eq!(
            parts.origins[instance.origin as usize],
            (format!("node {i}"), "large".to_string())
        );
        assert!(
            instance
                .local_from_world
                .transform_point3(at)
                .abs_diff_eq(Vec3::Y, 1e-6)
        );
    }
    assert_eq!(parts.meshes[1].materials.len(), 15_000);
    assert_eq!(parts.meshes[0].origins.len(), 15_002);
}

#[test]
fn gpu_instancing() {
    let mut builder = triangle();
    let translation = builder.floats(&[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    let scale = builder.floats(&[[1.0; 3], [3.0; 3]]);
    let attributes = json!({ "TRANSLATION": translation, "SCALE": scale });
    let extensions = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    let parts = builder.load(json!({
        "meshes": plain(),
        "nodes": [{ "mesh": 0, "translation": [0, 0, 7], "extensions": extensions }],
        "extensionsRequired": ["EXT_mesh_gpu_instancing"],
    }));
    close(
        &positions(&parts),
        &[
            [1.0, 0.0, 7.0],
            [2.0, 0.0, 7.0],
            [1.0, 1.0, 7.0],
            [2.0, 0.0, 7.0],
            [5.0, 0.0, 7.0],
            [2.0, 3.0, 7.0],
        ],
    );
}

#[test]
fn containers_and_external_files() {
    let whole = triangle().glb(json!({ "meshes": plain() }));
    close(&positions(&read_bytes("a.glb", &whole).unwrap()), &TRIANGLE);

    let builder = triangle();
    let mut json = builder.json(json!({ "meshes": plain() }));
    json["buffers"][0]["uri"] = "sub%20folder/p%C5%99.bin".into();
    let folder = folder(&[
        ("scene.gltf", json.to_string().as_bytes()),
        ("sub folder/p\u{159}.bin", &builder.bytes),
    ]);
    let parts = read(&folder.path().join("scene.gltf")).unwrap();
    close(&positions(&parts), &TRIANGLE);
    assert_eq!(parts.name, "scene");
}

/// A file whose material 0 has a base-colour texture.
fn with_texture(primitive: Value) -> Value {
    let uri = format!("data:image/png;base64,{}", base64(&png(1, &[[255; 4]])));
    json!({
        "meshes": mesh(primitive),
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": uri }],
    })
}

#[test]
fn normal_maps_move_with_their_surface_also_when_mirrored() {
    let mut builder = triangle();
    let normals = builder.floats(&[[0.0, 0.0, 1.0]; 3]);
    let uvs = builder.floats(&[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    let image = builder.view(&png(1, &[[200, 170, 220, 255]]));
    let attributes = json!({ "POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs });
    let local = builder.load(json!({
        "meshes": mesh(json!({ "attributes": attributes, "material": 0 })),
        "materials": [{ "normalTexture": { "index": 0 } }],
        "textures": [{ "source": 0 }],
        "images": [{ "bufferView": image }],
    }));
    let shading_normal = |parts: SceneParts, place: Affine3A| {
        let scene = Scene::new(parts).unwrap();
        let ray = Ray {
            origin_ws: place.transform_point3(Vec3::new(0.2, 0.2, 1.0)),
            direction_ws: place.transform_vector3(-Vec3::Z).normalize(),
            t_max: f32::INFINITY,
        };
        let hit = scene.nearest(&ray, PrimitiveId::NONE).unwrap();
        scene.surface(&ray, &hit).bsdf.normal_ws
    };
    let before = shading_normal(local.clone(), Affine3A::IDENTITY);
    assert!(before.x > 0.3 && before.y > 0.2, "red is right, green is up: {before}");
    let rotation = DQuat::from_euler(EulerRot::XYZ, 0.5, -1.1, 0.3);
    for scale in [[2, 2, 2], [-2, 2, 2], [2, -2, 2], [2, 2, -2], [-2, -2, -2]] {
        let scale = DVec3::from_array(scale.map(f64::from));
        let motion = Motion::new(DAffine3::from_scale_rotation_translation(scale, rotation, DVec3::ONE));
        let mut instanced = local.clone();
        instanced.instances = vec![motion.instance(0, 0).unwrap()];
        let place = instanced.instances[0].world_from_local;
        let mut copied = local.clone();
        let original = std::mem::take(&mut copied.meshes[0]);
        copied.meshes[0].materials.clone_from(&original.materials);
        copied.meshes[0].origins.clone_from(&original.origins);
        append(&mut copied.meshes[0], &original, Some(&motion));
        let expected = place.transform_vector3(before).normalize();
        for normal in [instanced, copied].map(|parts| shading_normal(parts, place)) {
            assert!(
                normal.abs_diff_eq(expected, 1e-5),
                "{scale}: {normal} is not {expected}"
            );
        }
    }
}

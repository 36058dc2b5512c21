//! Textures that are decoded when somebody samples them.

use super::*;
use crate::{Scene, Texture, gltf};
use glam::Vec2;

/// A triangle whose base colour is image 0 of `images`.
fn scene(images: Value) -> (Builder, Value) {
    let mut builder = triangle();
    let uvs = builder.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let rest = json!({
        "meshes": mesh(json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": uvs }, "material": 0 })),
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }],
        "images": images,
    });
    (builder, rest)
}

fn green() -> Vec<u8> {
    png(2, &[[0, 255, 0, 255]; 4])
}

fn shows_green(texture: &Texture) -> bool {
    texture.sample(Vec2::splat(0.3)).truncate() == glam::Vec3::Y
}

#[test]
fn a_texture_is_decoded_when_it_is_first_sampled_and_once() {
    let uri = format!("data:image/png;base64,{}", base64(&green()));
    let (builder, rest) = scene(json!([{ "uri": uri }]));
    let scene = Scene::new(builder.load(rest)).unwrap();
    let texture = &scene.parts.textures[0];
    assert_eq!((texture.width, texture.height, texture.texels.len()), (2, 2, 4));
    assert_eq!(scene.memory().used().made, 0);
    assert!(
        scene
            .parts
            .report
            .skipped
            .iter()
            .any(|text| text.contains("not decoded"))
    );
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| assert!(shows_green(texture)));
        }
    });
    let used = scene.memory().used();
    assert_eq!((used.made, used.resident_bytes), (1, 16));
}

#[test]
fn what_is_dropped_is_decoded_again() {
    let uri = format!("data:image/png;base64,{}", base64(&green()));
    let (builder, rest) = scene(json!([{ "uri": uri }]));
    let mut scene = Scene::new(builder.load(rest)).unwrap();
    assert!(shows_green(&scene.parts.textures[0]));
    scene.set_memory_budget(16);
    scene.make_room();
    assert_eq!(scene.memory().used().dropped, 0);
    scene.set_memory_budget(15);
    scene.make_room();
    let used = scene.memory().used();
    assert_eq!((used.dropped, used.resident_bytes), (1, 0));
    assert!(shows_green(&scene.parts.textures[0]));
    let used = scene.memory().used();
    assert_eq!((used.made, used.made_again, used.resident_bytes), (2, 1, 16));
}

#[test]
fn an_image_that_breaks_off_is_found_when_it_is_sampled() {
    let png = green();
    let cut = &png[..png.len() - 24];
    let uri = format!("data:image/png;base64,{}", base64(cut));
    let (builder, rest) = scene(json!([{ "uri": uri, "name": "wood" }]));
    let scene = Scene::new(builder.load(rest)).unwrap();
    assert!(scene.fault().is_none());
    assert_eq!(scene.parts.textures[0].sample(Vec2::ZERO), glam::Vec4::ZERO);
    let fault = scene.fault().unwrap().to_string();
    for word in ["test.gltf", "image 0 'wood'", "cannot be decoded", "replace the image"] {
        assert!(fault.contains(word), "{fault}");
    }
}

#[test]
fn images_in_files_of_their_own_stay_there() {
    let (builder, rest) = scene(json!([{ "uri": "green.png" }]));
    let text = builder.json(rest).to_string();
    let load = |folder: &TempDir| Scene::new(read(&folder.path().join("a.gltf")).unwrap()).unwrap();
    let files: [(&str, &[u8]); 2] = [("a.gltf", text.as_bytes()), ("green.png", &green())];
    let folder = folder(&files);
    assert!(shows_green(&load(&folder).parts.textures[0]));
    let scene = load(&folder);
    std::fs::write(folder.path().join("green.png"), png(3, &[[0, 0, 255, 255]; 9])).unwrap();
    let _ = scene.parts.textures[0].sample(Vec2::ZERO);
    let fault = scene.fault().unwrap().to_string();
    assert!(fault.contains("green.png") && fault.contains("changed"), "{fault}");
    assert_eq!(scene.parts.textures[0].texels[3], [0; 4]);
}

#[test]
fn images_in_a_binary_file_on_the_disk_stay_there() {
    let (mut builder, mut rest) = scene(Value::Null);
    let view = builder.view(&green());
    rest["images"] = json!([{ "bufferView": view }]);
    let folder = folder(&[("a.glb", &builder.glb(rest))]);
    let path = folder.path().join("a.glb");
    let load = || Scene::new(gltf::read_above(&path, 0).unwrap()).unwrap();
    assert!(shows_green(&load().parts.textures[0]));
    let scene = load();
    drop(folder);
    let _ = scene.parts.textures[0].sample(Vec2::ZERO);
    assert!(scene.fault().unwrap().to_string().contains("a.glb"));
}

//! What is made on demand under a memory budget: dropped, made again, and the same picture to the bit.

use render::Settings;
use scene::{MemoryUse, Scene, export, generate, gltf};
use std::path::Path;
use std::sync::Arc;

/// A small city, all meshes of at least a thousand triangles left in a file.
fn city(folder: &Path) -> impl Fn() -> Scene {
    let path = folder.join("city.glb");
    let parts = generate::demo("city:300").expect("the scene is known");
    export::write_glb(&parts, &path).expect("there is room");
    move || Scene::new(gltf::read_above(&path, 0).expect("readable")).expect("valid")
}

/// The hall, whose materials have textures.
fn hall() -> Scene {
    scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/modern_hall.glb")).expect("part of the repository")
}

/// The image after a few frames from `camera` with the scene to oneself, and what was made on demand.
fn rendered(scene: Scene, camera: usize, budget: Option<u64>) -> (Vec<[u32; 3]>, MemoryUse) {
    if let Some(bytes) = budget {
        scene.set_memory_budget(bytes);
    }
    let camera = scene.parts.cameras[camera].clone();
    let settings = Settings {
        width: 64,
        height: 48,
        max_bounces: 1,
        ..Settings::default()
    };
    let mut frames = render::renderer(Arc::new(scene), &camera, &settings).expect("the settings are valid");
    for _ in 0..2 {
        frames.render_frame();
    }
    assert!(frames.error().is_none(), "{:?}", frames.error());
    let pixels = frames.film().image().pixels;
    let bits = pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect();
    (bits, frames.scene().memory().used())
}

#[test]
fn a_budget_drops_what_was_not_used_for_longest_and_leaves_the_image_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let load = city(folder.path());
    // From above, the whole city is seen.
    let (image, all) = rendered(load(), 1, None);
    assert_eq!((all.dropped, all.made_again, all.budget_bytes), (0, 0, None));
    assert!(all.resident_bytes == all.peak_bytes && all.made > 10, "{all:?}");
    for share in [2, 20] {
        let budget = all.peak_bytes / share;
        let (bounded, used) = rendered(load(), 1, Some(budget));
        assert!(image == bounded, "1/{share} of the memory");
        assert!(used.dropped > 0 && used.made_again > 0, "{used:?}");
        assert_eq!(used.made - used.made_again, all.made);
        assert_eq!(used.budget_bytes, Some(budget));
        assert!(used.peak_bytes < all.peak_bytes, "{used:?}");
    }
    let (same, enough) = rendered(load(), 1, Some(all.peak_bytes));
    assert!(image == same && enough.dropped == 0, "{enough:?}");
}

#[test]
fn textures_are_dropped_and_decoded_again() {
    let (image, all) = rendered(hall(), 0, None);
    assert!(all.made > 1, "{all:?}");
    let (bounded, used) = rendered(hall(), 0, Some(all.peak_bytes / 2));
    assert!(image == bounded && used.made_again > 0, "{used:?}");
}

#[test]
fn a_scene_that_others_use_too_keeps_everything() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = city(folder.path())();
    scene.set_memory_budget(1);
    let settings = Settings {
        width: 32,
        height: 24,
        ..Settings::default()
    };
    let camera = &scene.parts.cameras[1];
    let mut frames = render::renderer(&scene, camera, &settings).expect("the settings are valid");
    frames.render_frame();
    let used = scene.memory().used();
    assert!(used.resident_bytes > 1 && used.dropped == 0, "{used:?}");
}

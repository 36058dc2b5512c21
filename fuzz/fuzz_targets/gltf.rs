//! Loads the input as a `.glb`, or as a `.gltf` if it is one.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a temporary folder"));

fuzz_target!(|data: &[u8]| {
    let path = FOLDER.path().join("input.gltf");
    std::fs::write(&path, data).expect("the temporary folder can be written");
    let _ = scene::gltf::read(&path).and_then(scene::Scene::new);
});

//! OpenEXR images.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a temporary folder"));

fuzz_target!(|data: &[u8]| {
    let path = FOLDER.path().join("input.exr");
    std::fs::write(&path, data).expect("the temporary folder can be written");
    let _ = render::image::read_exr(&path);
});

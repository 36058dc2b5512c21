//! What is made on demand: budgets for it, and files that are not what they claim.

use super::{folder, manylight, refused, render, stderr};
use serde_json::Value;
use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

/// A small city in a file of more than 64 MiB, so that its larger meshes stay there; `edit` changes the JSON. What is not the city is a hole at the
/// end, which takes no room on most disks.
fn large_city(folder: &Path, edit: impl FnOnce(&mut Value)) {
    const LENGTH: u32 = 65 << 20;
    let path = folder.join("city.glb");
    let parts = scene::generate::demo("city:300").expect("the scene is known");
    scene::export::write_glb(&parts, &path).expect("there is room");
    let bytes = fs::read(&path).expect("readable");
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let (text, binary) = (&bytes[20..20 + length], &bytes[20 + length + 8..]);
    let mut json: Value = serde_json::from_slice(text).expect("JSON");
    edit(&mut json);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = File::create(&path).expect("writable");
    let mut put = |bytes: &[u8]| file.write_all(bytes).expect("there is room");
    put(b"glTF\x02\0\0\0");
    put(&LENGTH.to_le_bytes());
    put(&(text.len() as u32).to_le_bytes());
    put(b"JSON");
    put(&text);
    put(&(LENGTH - 28 - text.len() as u32).to_le_bytes());
    put(b"BIN\0");
    put(binary);
    file.set_len(LENGTH.into()).expect("there is room");
}

/// Makes the box of the last mesh of that name a little lower than its vertices.
fn lower(json: &mut Value, name: &str) {
    let meshes = json["meshes"].as_array().expect("meshes");
    let mesh = meshes.iter().rposition(|mesh| mesh["name"] == name).expect("the mesh");
    let primitives = json["meshes"][mesh]["primitives"].as_array().expect("primitives");
    for primitive in primitives.clone() {
        let accessor = primitive["attributes"]["POSITION"].as_u64().expect("an index") as usize;
        let highest = &mut json["accessors"][accessor]["max"][1];
        *highest = (0.995 * highest.as_f64().expect("a number")).into();
    }
}

#[test]
fn a_box_that_lies_ends_the_rendering_with_exit_code_2_and_no_file() {
    let temporary = folder();
    let folder = temporary.path();
    large_city(folder, |json| lower(json, "house"));
    let words = ["city.glb", "mesh", "'house'", "min, max", "export the file again"];
    refused(folder, &render("city.glb", &["--camera=1", "-q"]), &words);
    refused(folder, &render("city.glb", &["--build-all", "-q"]), &words);
    // What no ray comes near is not checked.
    let output = manylight(folder, &["info", "city.glb"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

#[test]
fn an_image_is_the_same_under_a_budget() {
    let temporary = folder();
    let folder = temporary.path();
    large_city(folder, |_| ());
    let image = |name: &str, more: &[&str]| -> (Vec<[u32; 3]>, Value) {
        let size = [
            "--width=64",
            "--height=48",
            "--spp=3",
            "--camera=1",
            "--max-bounces=1",
            "-q",
        ];
        let arguments = [
            &["render", "city.glb", "-o", name, "--stats=stats.json"],
            &size[..],
            more,
        ]
        .concat();
        let output = manylight(folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let pixels = render::image::read_exr(&folder.join(name)).expect("an image").pixels;
        let stats = fs::read(folder.join("stats.json")).expect("statistics");
        let bits = pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect();
        (bits, serde_json::from_slice(&stats).expect("JSON"))
    };
    let (free, all) = image("free.exr", &[]);
    let count = |stats: &Value, name: &str| stats["memory"][name].as_u64().expect("a number");
    assert!(
        all["memory"]["budget_bytes"].is_null() && count(&all, "dropped") == 0,
        "{all}"
    );
    let budget = count(&all, "peak_bytes") / 1024 / 4;
    let (bounded, some) = image("bounded.exr", &["--memory-budget", &format!("{budget}K")]);
    assert!(free == bounded);
    assert_eq!(count(&some, "budget_bytes"), budget * 1024);
    assert!(count(&some, "made_again") > 0 && count(&some, "peak_bytes") < count(&all, "peak_bytes"));
    assert!(some["kept"]["meshes"].as_u64() > Some(0) && some["film_bytes"].as_u64() > Some(0));
}

#[test]
fn budgets_that_cannot_be_are_refused() {
    let temporary = folder();
    let folder = temporary.path();
    for size in ["0M", "-5G", "lots", "512", "1e40G", ""] {
        let option = format!("--memory-budget={size}");
        refused(
            folder,
            &render("demo:one-light", &[&option]),
            &["--memory-budget", "512M"],
        );
    }
    let with = |more: &[&'static str]| render("demo:one-light", &[&["--memory-budget=1G"], more].concat());
    refused(folder, &with(&["--backend=gpu"]), &["--memory-budget", "GPU"]);
    refused(folder, &with(&["--sampler=oracle"]), &["--memory-budget", "oracle"]);
    refused(folder, &with(&["--sampler=restir"]), &["--memory-budget", "restir"]);
    refused(folder, &with(&["--build-all"]), &["--memory-budget", "--build-all"]);
}

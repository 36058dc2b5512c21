//! The program as people and scripts meet it: exit codes, messages, files, pipes.

mod camera_paths;
mod measuring;
mod memory;
mod sampling;
mod state;
mod unlucky;

use serde_json::{Value, json};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program in `folder`.
fn manylight(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_manylight-under-test"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder)
        .output()
        .expect("the program starts")
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn listing(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().expect("a folder");
    let mut names: Vec<String> = entries
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Runs the program, which must refuse: exit code 2, one line that begins with `error:` and has all of `words`, no
/// panic, no file more or less than before.
fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let before = listing(folder);
    let output = manylight(folder, arguments);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    assert!(text.starts_with("error:"), "{arguments:?}: {text}");
    for word in words {
        assert!(text.contains(word), "{arguments:?}: no '{word}' in: {text}");
    }
    assert!(!text.contains("panicked"), "{text}");
    assert_eq!(listing(folder), before, "{arguments:?}");
}

/// A triangle and a point light, with its only buffer inside; `edit` breaks or changes it.
fn triangle(edit: impl FnOnce(&mut Value)) -> String {
    triangle_at(&[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]], edit)
}

fn triangle_at(corners: &[[f32; 3]; 3], edit: impl FnOnce(&mut Value)) -> String {
    let bytes: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let mut scene = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "name": "lamp", "intensity": 10.0 }] } },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [
            { "mesh": 0, "name": "card" },
            { "extensions": { "KHR_lights_punctual": { "light": 0 } }, "translation": [0.0, 0.0, 2.0], "name": "lamp" },
            { "camera": 0, "translation": [0.0, 0.0, 3.0] }
        ],
        "cameras": [{ "type": "perspective", "name": "eye", "perspective": { "yfov": 0.8, "znear": 0.1 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                        "min": [-1.0, -1.0, 0.0], "max": [1.0, 1.0, 0.0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": format!("data:application/octet-stream;base64,{}", base64(&bytes)) }]
    });
    edit(&mut scene);
    scene.to_string()
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    assert!(bytes.len().is_multiple_of(3), "needs no padding");
    let group = |b: &[u8]| u32::from(b[0]) << 16 | u32::from(b[1]) << 8 | u32::from(b[2]);
    let digits = bytes
        .chunks(3)
        .flat_map(|b| [18, 12, 6, 0].map(|shift| DIGITS[(group(b) >> shift & 63) as usize]));
    digits.map(char::from).collect()
}

fn write(folder: &Path, name: &str, text: impl AsRef<[u8]>) {
    std::fs::write(folder.join(name), text).expect("writable");
}

const SMALL: [&str; 5] = ["--width=24", "--height=16", "--spp=2", "-o", "out.exr"];

fn render<'a>(scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", scene], &SMALL[..], more].concat()
}

#[test]
fn broken_scenes_are_refused_with_exit_code_2_and_no_file() {
    let temporary = folder();
    let folder = temporary.path();
    let broken: [(&str, String); 7] = [
        ("buffer.gltf", triangle(|s| s["buffers"][0]["uri"] = "gone.bin".into())),
        ("index.gltf", triangle(|s| s["nodes"][0]["mesh"] = 7.into())),
        (
            "claims.gltf",
            triangle(|s| s["accessors"][0]["count"] = 1_000_000_000.into()),
        ),
        ("cycle.gltf", triangle(|s| s["nodes"][0]["children"] = json!([0]))),
        ("json.gltf", "{\"asset\":".into()),
        ("truncated.glb", "glTF\u{2}\0\0\0\u{ff}\u{f}\0\0".into()),
        ("empty.glb", String::new()),
    ];
    for (name, text) in &broken {
        write(folder, name, text);
        refused(folder, &render(name, &[]), &[name]);
        refused(folder, &["dump", name, "-o", "out.csv"], &[name]);
        refused(folder, &["info", name], &[name]);
    }
    refused(folder, &render("missing.glb", &[]), &["missing.glb"]);
    refused(folder, &render("demo:nowhere", &[]), &["nowhere", "rooms"]);
    refused(folder, &render("demo:rooms:3", &[]), &["16"]);
}

#[test]
fn a_position_that_is_no_number_is_refused() {
    let temporary = folder();
    let folder = temporary.path();
    let corners = [[f32::NAN, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
    write(folder, "nan.gltf", triangle_at(&corners, |_| {}));
    refused(folder, &render("nan.gltf", &[]), &["nan.gltf"]);
}

#[test]
fn odd_scenes_render() {
    let temporary = folder();
    let folder = temporary.path();
    let flat = [[0.0, 0.0, 0.0]; 3];
    let scenes: [(&str, String); 5] = [
        ("whole.gltf", triangle(|_| {})),
        ("flat.gltf", triangle_at(&flat, |_| {})),
        ("bare.gltf", triangle(|s| s["scenes"][0]["nodes"] = json!([1, 2]))),
        ("dark.gltf", triangle(|s| s["scenes"][0]["nodes"] = json!([0, 2]))),
        ("blind.gltf", triangle(|s| s["scenes"][0]["nodes"] = json!([0, 1]))),
    ];
    for (name, text) in &scenes {
        write(folder, name, text);
        let output = manylight(folder, &render(name, &[]));
        assert_eq!(output.status.code(), Some(0), "{name}: {}", stderr(&output));
        let image = render::image::read_exr(&folder.join("out.exr")).expect("an image");
        let brightest = image.pixels.iter().flatten().fold(0.0f32, |most, value| {
            assert!(value.is_finite(), "{name}");
            most.max(*value)
        });
        assert_eq!(
            brightest > 0.0,
            ["whole.gltf", "blind.gltf"].contains(name),
            "{name}: {brightest}"
        );
        let warned = stderr(&output).contains("no lights");
        assert_eq!(warned, *name == "dark.gltf", "{name}: {}", stderr(&output));
    }
}

#[test]
fn bad_usage_is_refused_and_says_what_is_valid() {
    let temporary = folder();
    let folder = temporary.path();
    let demo = "demo:one-light";
    refused(
        folder,
        &render(demo, &["--sampler", "tabel"]),
        &["tabel", "table", "uniform", "exact"],
    );
    refused(
        folder,
        &render(demo, &["--pixel-filter", "gausian"]),
        &["gaussian", "blackman-harris"],
    );
    refused(folder, &render(demo, &["--camera", "nobody"]), &["nobody"]);
    refused(folder, &render(demo, &["--time", "-1"]), &["--time"]);
    refused(folder, &render(demo, &["--min-probability-mass", "2"]), &["0 to 1"]);
    refused(
        folder,
        &["render", demo, "-o", "out.tiff"],
        &["out.tiff", ".exr", ".png"],
    );
    refused(
        folder,
        &["render", demo, "-o", "no/such/folder/out.exr"],
        &["no/such/folder"],
    );
    refused(
        folder,
        &["render", demo, "-o", "out.png", "--stats", "no/stats.json"],
        &["no/stats.json"],
    );
    refused(folder, &["render", demo, "-o", "out.png", "--aov", "albedo"], &[".exr"]);
    refused(folder, &["dump", demo, "-o", "no/lights.csv"], &["no/lights.csv"]);
    refused(folder, &["dump", demo, "-o", "lights.txt"], &["lights.txt", ".parquet"]);
    refused(folder, &["info", demo, "--export", "no/scene.glb"], &["no/scene.glb"]);
    refused(folder, &["rendr", demo], &["render"]);
    refused(folder, &["view", demo, "--frame-time", "0"], &["frame-time"]);
}

#[test]
fn without_a_gpu_it_is_refused_with_exit_code_3() {
    let temporary = folder();
    let output = Command::new(env!("CARGO_BIN_EXE_manylight-under-test"))
        .args(render("demo:one-light", &["--backend", "gpu"]))
        .current_dir(temporary.path())
        // An interface that this system does not have.
        .env("WGPU_BACKEND", if cfg!(windows) { "metal" } else { "dx12" })
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("GPU"));
    assert!(listing(temporary.path()).is_empty());
}

#[test]
fn statistics_have_all_fields_and_threads_change_no_pixel() {
    let temporary = folder();
    let folder = temporary.path();
    let arguments = |threads, image| {
        let size = [
            "--width=40",
            "--height=30",
            "--spp=3",
            "--max-bounces=1",
            "--stats=stats.json",
        ];
        [
            &["render", "demo:rooms:64", "--threads", threads, "-o", image][..],
            &size,
        ]
        .concat()
    };
    for (threads, image) in [("1", "one.exr"), ("3", "three.exr")] {
        let output = manylight(folder, &arguments(threads, image));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    let image = |name: &str| render::image::read_exr(&folder.join(name)).expect("an image");
    assert_eq!(image("one.exr"), image("three.exr"));

    let text = std::fs::read_to_string(folder.join("stats.json")).expect("statistics");
    let stats: Value = serde_json::from_str(&text).expect("JSON");
    for field in [
        "load_s",
        "build_s",
        "light_build_s",
        "render_s",
        "spp",
        "width",
        "height",
        "threads",
        "backend",
        "sampler",
        "lights",
        "triangles",
        "rays_nearest",
        "rays_occluded",
        "cells",
        "min_probability",
        "skipped",
        "nonfinite_samples",
        "peak_rss_bytes",
        "seed",
        "version",
    ] {
        assert!(!stats[field].is_null(), "{field}");
    }
    for (field, value) in [
        ("spp", 3),
        ("width", 40),
        ("threads", 3),
        ("lights", 64),
        ("nonfinite_samples", 0),
    ] {
        assert_eq!(stats[field], value, "{field}");
    }
}

const COLUMNS: &str = "light,name,kind,x_m,y_m,z_m,area_m2,power_w,max_contribution,mean_contribution,\
                       visible_fraction,samples,probability,min_probability,node,mesh,material,triangle";

#[test]
fn a_dump_has_every_light_and_probabilities_that_total_1() {
    let temporary = folder();
    for sampler in light_cache::SamplerKind::ALL.map(light_cache::SamplerKind::name) {
        let arguments = [
            "dump",
            "demo:points:40",
            "--width=32",
            "--height=24",
            "--spp=3",
            "--sampler",
            sampler,
        ];
        let output = manylight(temporary.path(), &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let text = stdout(&output);
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some(COLUMNS));
        // The names of this scene have no commas.
        let column = COLUMNS
            .split(',')
            .position(|name| name == "probability")
            .expect("a column");
        let probabilities: Vec<f64> = lines
            .map(|line| {
                line.split(',')
                    .nth(column)
                    .and_then(|cell| cell.parse().ok())
                    .expect("a number")
            })
            .collect();
        assert_eq!(probabilities.len(), 40, "{sampler}");
        let total: f64 = probabilities.iter().sum();
        assert!((total - 1.0).abs() < 1e-4, "{sampler}: {total}");
    }
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let temporary = folder();
    let mut child = Command::new(env!("CARGO_BIN_EXE_manylight-under-test"))
        .args([
            "dump",
            "demo:points:5000",
            "--width=16",
            "--height=12",
            "--spp=1",
            "--quiet",
        ])
        .current_dir(temporary.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut first = [0; 5];
    child
        .stdout
        .take()
        .expect("piped")
        .read_exact(&mut first)
        .expect("five bytes");
    assert_eq!(&first, b"light");
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
}

#[cfg(unix)]
#[test]
fn pipes_stay_pipes_and_links_stay_links() {
    let temporary = folder();
    let folder = temporary.path();
    let pipe = folder.join("pipe.png");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    std::os::unix::fs::symlink("pipe.png", folder.join("to-pipe.png")).expect("a link");
    std::os::unix::fs::symlink("image.png", folder.join("to-image.png")).expect("a link");
    let image = |output: &str| {
        let arguments = ["render", "demo:one-light", "--width=8", "--spp=1", "-o", output];
        let output = manylight(folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    };
    let piped = std::thread::scope(|scope| {
        let reader = scope.spawn(|| std::fs::read(&pipe).expect("the pipe's other end"));
        image("to-pipe.png");
        reader.join().expect("all was read")
    });
    image("to-image.png");
    assert_eq!(
        piped,
        std::fs::read(folder.join("image.png")).expect("where the link points")
    );
    use std::os::unix::fs::FileTypeExt;
    assert!(pipe.metadata().expect("still there").file_type().is_fifo());
    assert!(folder.join("to-image.png").is_symlink() && folder.join("to-pipe.png").is_symlink());
}

#[test]
fn comparing_tells_same_from_different() {
    let temporary = folder();
    let folder = temporary.path();
    for (seed, size, name) in [
        ("1", "--width=32", "a.exr"),
        ("2", "--width=32", "b.exr"),
        ("1", "--width=48", "c.exr"),
    ] {
        let arguments = [
            "render",
            "demo:rooms:32",
            "--spp=1",
            "--height=24",
            "--seed",
            seed,
            size,
            "-o",
            name,
        ];
        assert_eq!(manylight(folder, &arguments).status.code(), Some(0));
    }
    let code = |arguments: &[&str]| manylight(folder, arguments).status.code();
    assert_eq!(code(&["compare", "a.exr", "a.exr", "--threshold", "0"]), Some(0));
    assert_eq!(
        code(&["compare", "a.exr", "b.exr"]),
        Some(0),
        "no threshold, no failure"
    );
    assert_eq!(
        code(&["compare", "a.exr", "b.exr", "--threshold", "1e-9", "-o", "d.png"]),
        Some(1)
    );
    assert!(folder.join("d.png").exists());
    refused(folder, &["compare", "a.exr", "c.exr"], &["32 x 24", "48 x 24"]);
    refused(folder, &["compare", "a.exr", "missing.exr"], &["missing.exr"]);
    let output = manylight(folder, &["compare", "a.exr", "a.exr", "--json"]);
    let figures: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    assert_eq!(figures["relmse"], 0.0);
    assert_eq!(figures["mean_ratio"], 1.0);
}

#[test]
fn info_tells_of_program_and_scene() {
    let temporary = folder();
    let folder = temporary.path();
    let text = stdout(&manylight(folder, &["info"]));
    for word in ["demo:rooms", "demo:plaza", "tree-visible", "RAYON_NUM_THREADS"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    write(
        folder,
        "scene.gltf",
        triangle(|s| s["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_magic"])),
    );
    let text = stdout(&manylight(folder, &["info", "scene.gltf"]));
    for word in ["triangles  1", "1 point", "'eye'", "KHR_magic"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let arguments = ["info", "demo:points:20", "--json", "--export", "points.glb"];
    let output = manylight(folder, &arguments);
    let figures: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    assert_eq!(figures["lights"], 20);
    let again: Value =
        serde_json::from_str(&stdout(&manylight(folder, &["info", "points.glb", "--json"]))).expect("JSON");
    assert_eq!(again["lights"], 20);
}

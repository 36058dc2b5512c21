//! Camera paths: what the window records, `render` and `bench` follow.

use super::{folder, listing, manylight, refused, stderr, write};

/// Three poses that look along -z, a little farther to the right each.
const PATH: &str = r#"[
    {"position": [0.0, 1.5, 3.0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "fov_y": 1.0},
    {"position": [0.1, 1.5, 3.0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "fov_y": 1.0},
    {"position": [0.2, 1.5, 3.0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "fov_y": 1.0}
]"#;

const RENDER: [&str; 6] = [
    "render",
    "demo:rooms:16",
    "--width=32",
    "--height=24",
    "--spp=1",
    "--camera-path=path.json",
];

#[test]
fn every_frame_of_a_path_becomes_an_image() {
    let temporary = folder();
    let folder = temporary.path();
    write(folder, "path.json", PATH);
    let output = manylight(folder, &[&RENDER[..], &["--frames=1..3", "-o", "f_###.exr"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(listing(folder), ["f_001.exr", "f_002.exr", "path.json"]);
    let output = manylight(folder, &[&RENDER[..], &["-o", "g_#.png"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(listing(folder).contains(&"g_2.png".into()));
}

#[test]
fn what_makes_no_sequence_is_refused() {
    let temporary = folder();
    let folder = temporary.path();
    write(folder, "path.json", PATH);
    write(folder, "odd.json", "[1, 2]");
    write(folder, "empty.json", "[]");
    let with = |more: &[&'static str]| [&RENDER[..], more].concat();
    refused(folder, &with(&["-o", "f.png"]), &["####"]);
    refused(folder, &with(&["-o", "f_#.png", "--frames=2..9"]), &["0..3"]);
    refused(folder, &with(&["-o", "f_#.png", "--frames=2"]), &["A..B"]);
    refused(folder, &with(&["-o", "f_#.png", "--camera=0"]), &["--camera"]);
    for (path, word) in [
        ("odd.json", "no camera path"),
        ("empty.json", "no frames"),
        ("none.json", "none.json"),
    ] {
        let arguments = ["render", "demo:rooms:16", "-o", "f_#.png", "--camera-path", path];
        refused(folder, &arguments, &[word]);
        let arguments = [
            "bench",
            "demo:rooms:16",
            "--scenario=walk",
            "-o",
            "b",
            "--camera-path",
            path,
        ];
        refused(folder, &arguments, &[word]);
    }
    refused(
        folder,
        &["bench", "--scenario=door", "--camera-path=path.json"],
        &["walk"],
    );
}

#[test]
fn a_walk_along_a_path_is_measured_as_it_is_displayed() {
    let temporary = folder();
    let folder = temporary.path();
    write(folder, "path.json", PATH);
    let arguments = [
        "bench",
        "demo:rooms:16",
        "--scenario=walk",
        "--camera-path=path.json",
        "--displayed",
        "--samplers=tree",
        "--reference-spp=2",
        "--width=32",
        "--height=24",
        "--reference-cache=cache",
        "-o",
        "walk",
    ];
    let output = manylight(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = std::fs::read_to_string(folder.join("walk").join("frames.csv")).expect("frames");
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + 3, "{text}");
    for name in ["flip", "clean_ms", "relmse_shown", "flip_shown"] {
        let column = rows[0].iter().position(|&field| field == name).expect(name);
        let finite = |row: &Vec<&str>| row[column].parse::<f64>().is_ok_and(f64::is_finite);
        assert!(rows[1..].iter().all(finite), "{name}: {text}");
    }
}

//! `estimate`, and the options that say how pixels are sampled.

use super::{folder, listing, manylight, refused, render, stderr, stdout};
use serde_json::Value;

#[test]
fn what_can_be_estimated_is_listed() {
    let temporary = folder();
    let output = manylight(temporary.path(), &["estimate", "--list"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for word in [
        "smooth-2d",
        "many-lights",
        "crude",
        "strata neyman",
        "mis optimal",
        "sobol-owen",
        "blue-noise",
    ] {
        assert!(stdout(&output).contains(word), "{word}");
    }
    assert!(listing(temporary.path()).is_empty());
}

#[test]
fn an_estimate_tells_rates_and_writes_its_files() {
    let temporary = folder();
    let folder = temporary.path();
    let arguments = [
        "estimate",
        "smooth-2d",
        "planar-shadow",
        "--samples=16,64,256",
        "--seeds=8",
        "--methods=points,mis power",
        "-o",
        "results",
    ];
    let output = manylight(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for word in [
        "smooth-2d, 2-D",
        "planar-shadow, 2-D",
        "crude",
        "stratified",
        "mis power",
        "rate",
    ] {
        assert!(stdout(&output).contains(word), "{word}: {}", stdout(&output));
    }
    assert!(!stdout(&output).contains("hit-or-miss"), "it was not asked for");
    let files = listing(&folder.join("results"));
    for file in [
        "discrepancy.csv",
        "discrepancy.svg",
        "estimates.csv",
        "points.svg",
        "rates.csv",
        "smooth-2d-points-evaluations.svg",
        "planar-shadow-combined-seconds.svg",
    ] {
        assert!(files.iter().any(|name| name == file), "{file}: {files:?}");
    }

    // Two integrands, of which both have crude, ten point sets and the heuristic, at three numbers of samples.
    let text = std::fs::read_to_string(folder.join("results/estimates.csv")).expect("written");
    assert_eq!(text.lines().count(), 1 + 2 * 12 * 3);
    // Jittered sampling falls like N^-1, crude like N^-1/2: within what eight seeds can tell.
    let rates = std::fs::read_to_string(folder.join("results/rates.csv")).expect("written");
    let rate = |method: &str| -> f64 {
        let row = rates
            .lines()
            .find(|row| row.starts_with(&format!("smooth-2d,{method},")));
        let cell = row.and_then(|row| row.split(',').nth(2)).expect("a row for the method");
        cell.parse().expect("a number")
    };
    assert!(
        (rate("stratified") + 1.0).abs() < 0.3 && (rate("crude") + 0.5).abs() < 0.3,
        "{rates}"
    );
}

#[test]
fn names_and_folders_that_cannot_be_are_refused() {
    let temporary = folder();
    let folder = temporary.path();
    std::fs::write(folder.join("file"), "in the way").expect("writable");
    refused(folder, &["estimate", "smooth"], &["smooth", "smooth-1d"]);
    refused(
        folder,
        &["estimate", "smooth-1d", "--methods=crud"],
        &["crud", "--list"],
    );
    refused(folder, &["estimate", "smooth-1d", "--samples=0"], &["--samples"]);
    refused(folder, &["estimate", "smooth-1d", "-o", "file"], &["file"]);
    refused(folder, &render("demo:rooms:16", &["--mis=powr"]), &["powr", "balance"]);
    refused(
        folder,
        &render("demo:rooms:16", &["--pixel-sampler=x"]),
        &["stratified"],
    );
    refused(
        folder,
        &render("demo:rooms:16", &["--target-error=0"]),
        &["target-error"],
    );
    let target = |more| render("demo:rooms:16", &["--target-error=0.01", more]);
    refused(folder, &target("--shard=1/2"), &["--shard", "--target-error"]);
    refused(folder, &target("--sampler=oracle"), &["oracle", "--target-error"]);
    let part = ["render", "demo:rooms:16", "--target-error=0.01", "-o", "a.part"];
    refused(folder, &part, &["--target-error", "joined"]);
}

#[test]
fn what_needs_independent_frames_is_refused_to_restir() {
    let temporary = folder();
    let folder = temporary.path();
    let restir = |more| render("demo:rooms:16", &["--sampler=restir", more]);
    refused(folder, &restir("--target-error=0.01"), &["restir", "--target-error"]);
    refused(folder, &restir("--shard=1/2"), &["restir", "--shard"]);
    refused(folder, &restir("--resume=state"), &["restir", "--resume"]);
    refused(folder, &restir("--aov=variance"), &["restir", "variance"]);
    refused(
        folder,
        &restir("--restir-candidates=0"),
        &["restir.candidates", "1 to 1,024"],
    );
    let part = ["render", "demo:rooms:16", "--sampler=restir", "-o", "a.part"];
    refused(folder, &part, &["restir", ".part"]);
    let dump = ["dump", "demo:rooms:16", "--sampler=restir", "-o", "a.csv"];
    refused(folder, &dump, &["restir", "adaptive"]);
}

#[test]
fn rendering_stops_when_the_image_is_good_enough() {
    let temporary = folder();
    let folder = temporary.path();
    let frames = |bound: &str| -> u64 {
        let size = [
            "--width=24",
            "--height=16",
            "-o",
            "out.exr",
            "--aov=samples",
            "--stats=-",
        ];
        let arguments = [&["render", "demo:rooms:16", "--sampler=tree", bound], &size[..]].concat();
        let output = manylight(folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).contains("95 % confidence"), "{}", stderr(&output));
        let stats: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let target = stats["target_error"].as_f64().expect("a number");
        assert!(stats["estimated_error"]["high"].as_f64() <= Some(target), "{stats}");
        let samples = &stats["samples"];
        assert!(samples["least"].as_u64() < samples["median"].as_u64(), "{samples}");
        assert!(samples["median"].as_u64() < samples["most"].as_u64(), "{samples}");
        stats["spp"].as_u64().expect("a number")
    };
    let (rough, fine) = (frames("--target-error=0.01"), frames("--target-error=0.001"));
    assert!(rough >= 16 && fine > 4 * rough && fine < 100_000, "{rough} {fine}");
}

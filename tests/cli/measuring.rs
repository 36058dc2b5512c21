//! `bench`, its scenarios, the oracle, and what `dump --cells` tells.

use super::{folder, listing, manylight, refused, render, stderr, stdout};
use serde_json::Value;
use std::collections::BTreeMap;

#[test]
fn a_benchmark_writes_its_files_and_keeps_its_reference() {
    let temporary = folder();
    let folder = temporary.path();
    let arguments = [
        "bench",
        "demo:rooms:16",
        "--samplers=uniform,power",
        "--time=0.01",
        "--reference-spp=16",
        "--width=64",
        "--height=48",
        "-o",
        "results",
        "--reference-cache",
        "cache",
        "--seeds=2",
    ];
    let output = manylight(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for word in [
        "uniform",
        "power",
        "efficiency",
        "x uniform",
        "x tree",
        "choose %",
        "over 2 seeds",
    ] {
        assert!(stdout(&output).contains(word), "{word}");
    }
    let files = [
        "frames.csv",
        "rooms-16-spp.svg",
        "rooms-16-time.svg",
        "setup.md",
        "summary.json",
    ];
    assert_eq!(listing(&folder.join("results")), files);
    let text = std::fs::read_to_string(folder.join("results/summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(summary["scenes"][0]["samplers"][0]["to_uniform"], 1.0);
    assert_eq!(summary["scenes"][0]["samplers"][1]["seeds"], 2);
    let kept = listing(&folder.join("cache"));
    assert_eq!(kept.len(), 2, "two independent parts");
    assert_eq!(manylight(folder, &arguments).status.code(), Some(0));
    assert_eq!(listing(&folder.join("cache")), kept, "the reference is used again");
}

#[test]
fn references_of_ones_own_are_one_image_or_independent_ones() {
    let temporary = folder();
    let folder = temporary.path();
    for seed in ["1", "2", "3"] {
        let name = format!("{seed}.exr");
        let size = ["--width=32", "--height=24", "--spp=4", "--seed", seed, "-o", &name];
        let output = manylight(folder, &[&["render", "demo:rooms:16"][..], &size].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    let bench = ["bench", "demo:rooms:16", "--width=32", "--height=24", "-o", "results"];
    let with = |reference| {
        [
            &bench[..],
            &["--time=0.01", "--samplers=uniform", "--reference", reference],
        ]
        .concat()
    };
    for (reference, estimator) in [
        ("1.exr", "plain"),
        ("1.exr,2.exr", "adds an offset"),
        ("1.exr,2.exr,3.exr", "adds no offset"),
    ] {
        let output = manylight(folder, &with(reference));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stdout(&output).contains(estimator), "{}", stdout(&output));
    }
    for (reference, word) in [("1.exr,2.exr,1.exr", "independent"), ("1.exr,none.exr", "none.exr")] {
        refused(folder, &with(reference), &[word]);
    }
}

#[test]
fn oracle_is_marked_as_research() {
    let temporary = folder();
    let folder = temporary.path();
    let arguments = render(
        "demo:rooms:64",
        &["--sampler=oracle", "--oracle-passes=2", "--stats=stats.json"],
    );
    refused(
        folder,
        &[&arguments[..], &["--max-bounces=1"]].concat(),
        &["oracle", "max_bounces"],
    );
    let output = manylight(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("research"));
    let text = std::fs::read_to_string(folder.join("stats.json")).expect("statistics");
    let stats: Value = serde_json::from_str(&text).expect("JSON");
    assert!(stats["prepare_s"].as_f64() > Some(0.0) && stats["research"].is_string());

    let arguments = [
        "bench",
        "demo:rooms:64",
        "--samplers=tree,oracle",
        // Enough for the two frames that are compared, also where other work goes on.
        "--time=0.3",
        "--width=32",
        "--height=24",
    ];
    let output = manylight(
        folder,
        &[&arguments[..], &["-o", "results", "--reference-cache", "cache"]].concat(),
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for word in ["a multiple of that of oracle", "oracle: research"] {
        assert!(stdout(&output).contains(word), "{word}: {}", stdout(&output));
    }
}

#[test]
fn statistics_tell_what_choosing_costs_and_say_nothing_twice() {
    let temporary = folder();
    let stats = |scene: &str, sampler: &str| -> Value {
        let arguments = ["--stats", "-", "--quiet", "--sampler", sampler];
        let output = manylight(temporary.path(), &render(scene, &arguments));
        serde_json::from_str(&stdout(&output)).expect("JSON")
    };
    let tree = stats("demo:rooms:64", "tree");
    assert!(tree["choosing"]["ns_per_choice"].as_f64() > Some(0.0));
    let share = |name: &str| tree[name].as_f64().expect("a share");
    assert!(share("choose_share") > 0.0 && share("choose_share") < 1.0 && share("learn_share") == 0.0);
    assert!(stats("demo:rooms:64", "exact")["choosing"].is_null());
    let one = stats("demo:one-light", "adaptive");
    let skipped = one["skipped"].as_array().expect("a list");
    let about_one_light = skipped.iter().filter(|text| text.to_string().contains("one light"));
    assert_eq!(about_one_light.count(), 1, "{skipped:?}");
}

#[test]
fn scenarios_measure_single_frames() {
    let temporary = folder();
    let folder = temporary.path();
    for (scenario, plot) in [
        ("walk", "rooms-64-walk.svg"),
        ("lights", "rooms-64-lights.svg"),
        ("door", "rooms-64-door.svg"),
    ] {
        let arguments = [
            "bench",
            "demo:rooms:64",
            "--samplers=tree,adaptive",
            "--frames=4",
            "--reference-spp=4",
            "--width=32",
            "--height=24",
            "--reference-cache=cache",
            "--scenario",
            scenario,
            "-o",
            scenario,
        ];
        let output = manylight(folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{scenario}: {}", stderr(&output));
        assert!(stdout(&output).contains("steady"), "{}", stdout(&output));
        assert_eq!(listing(&folder.join(scenario)), ["frames.csv", plot, "summary.json"]);
        let csv = std::fs::read_to_string(folder.join(scenario).join("frames.csv")).expect("frames");
        let frames = if scenario == "walk" { 4 } else { 8 };
        assert_eq!(csv.lines().count(), 1 + 2 * frames, "{csv}");
    }
    for (scene, scenario, words) in [
        ("demo:plaza:64", "door", ["door", "keyhole"]),
        ("demo:plaza:64", "walk", ["walk", "rooms"]),
    ] {
        let arguments = ["bench", scene, "--scenario", scenario, "-o", "walk"];
        refused(folder, &arguments, &words);
    }
    refused(folder, &["bench", "demo:rooms:64", "--frames", "9"], &["--scenario"]);
}

#[test]
fn cells_are_dumped() {
    let temporary = folder();
    let small = ["--cells", "--width=32", "--height=24", "--spp=3"];
    let arguments = [&["dump", "demo:rooms:64"], &small[..]].concat();
    let output = manylight(temporary.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let header = "cell,x_m,y_m,z_m,size_m,normal,primary,light,lights,probability,visible_fraction,samples,age";
    let table = stdout(&output);
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some(header));
    // A cell's entries cover all lights, each once, and their probabilities total 1.
    let mut cells = BTreeMap::<u64, (u32, f64)>::new();
    for line in lines {
        let field: Vec<&str> = line.split(',').collect();
        let cell = cells.entry(field[0].parse().expect("a number")).or_default();
        cell.0 += field[8].parse::<u32>().expect("a count");
        cell.1 += field[9].parse::<f64>().expect("a probability");
    }
    assert!(cells.len() > 10, "{}", cells.len());
    for (cell, (lights, probability)) in cells {
        assert_eq!(lights, 64, "cell {cell}");
        assert!((probability - 1.0).abs() < 1e-4, "cell {cell}: {probability}");
    }
    refused(
        temporary.path(),
        &[&arguments[..], &["--sampler=tree"]].concat(),
        &["tree", "adaptive"],
    );
}

//! Renderings that are stopped and continued, divided and joined; and the stress bench.

use super::{folder, manylight, refused, stderr, stdout};
use std::fs;
use std::path::Path;

const SCENE: [&str; 6] = [
    "render",
    "demo:rooms:32",
    "--width=48",
    "--height=40",
    "--max-bounces=1",
    "-q",
];

fn render(folder: &Path, arguments: &[&str]) {
    let output = manylight(folder, &[&SCENE, arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
}

/// The pixels of an image, to the bit.
fn pixels(folder: &Path, name: &str) -> Vec<[u32; 3]> {
    let image = render::image::read_exr(&folder.join(name)).expect("an image");
    image.pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

#[test]
fn a_rendering_goes_on_as_if_it_had_not_been_stopped() {
    let temporary = folder();
    let folder = temporary.path();
    for sampler in ["adaptive", "table", "tree-visible", "octree", "uniform", "exact"] {
        let sampler = format!("--sampler={sampler}");
        render(folder, &[&sampler, "--spp=19", "-o", "whole.exr"]);
        // Within an epoch, and past its end.
        for spp in ["--spp=7", "--spp=11", "--spp=19"] {
            render(folder, &[&sampler, spp, "--resume=state", "-o", "resumed.exr"]);
        }
        assert_eq!(pixels(folder, "resumed.exr"), pixels(folder, "whole.exr"), "{sampler}");
        fs::remove_file(folder.join("state")).expect("it was kept");
    }
}

/// Whatever the number of threads, and wherever it was cut: before, at and after the ends of blocks.
#[test]
fn samples_where_the_error_is_go_on_there() {
    let temporary = folder();
    let folder = temporary.path();
    for sampler in ["adaptive", "tree"] {
        let sampler = format!("--sampler={sampler}");
        let target = ["--target-error=0.000001", "--aov=samples"];
        let render = |more: &[&str]| render(folder, &[&target[..], &[&sampler], more].concat());
        render(&["--spp=37", "--threads=2", "-o", "whole.exr"]);
        for spp in ["--spp=7", "--spp=8", "--spp=16", "--spp=21", "--spp=37"] {
            render(&[spp, "--threads=1", "--resume=state", "-o", "resumed.exr"]);
        }
        assert_eq!(pixels(folder, "resumed.exr"), pixels(folder, "whole.exr"), "{sampler}");
        fs::remove_file(folder.join("state")).expect("it was kept");
    }
}

#[test]
fn states_of_something_else_are_refused() {
    let temporary = folder();
    let folder = temporary.path();
    render(folder, &["--spp=2", "--resume=state", "-o", "a.exr"]);
    let again = |arguments: &[&str], words: &[&str]| {
        let resume = ["--resume=state", "-o", "a.exr"];
        refused(folder, &[&SCENE[..], &resume, arguments].concat(), words);
    };
    again(&["--spp=4", "--seed=3"], &["state", "seed"]);
    again(&["--spp=4", "--sampler=table"], &["state", "settings"]);
    again(&["--spp=4", "--shard=1/2"], &["state", "shard"]);
    let mut bytes = fs::read(folder.join("state")).expect("it was kept");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(folder.join("state"), &bytes).expect("written");
    again(&["--spp=4"], &["state", "damaged"]);
    fs::write(folder.join("state"), "hello").expect("written");
    again(&["--spp=4"], &["state", "no state"]);
}

#[test]
fn parts_join_to_the_whole() {
    let temporary = folder();
    let folder = temporary.path();
    for (sampler, same) in [("uniform", true), ("tree", true), ("adaptive", false)] {
        let sampler = format!("--sampler={sampler}");
        render(folder, &[&sampler, "--spp=23", "-o", "whole.exr"]);
        for shard in 1..=3 {
            let (shard, part) = (format!("--shard={shard}/3"), format!("{shard}.part"));
            render(folder, &[&sampler, "--spp=23", &shard, "-o", &part]);
        }
        let output = manylight(folder, &["merge", "1.part", "2.part", "3.part", "-o", "joined.exr"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).contains("23 spp of 3 parts"), "{}", stderr(&output));
        // Sums in double precision in another order, rounded to single precision: a unit in the last place at most.
        let pairs = pixels(folder, "joined.exr")
            .into_iter()
            .zip(pixels(folder, "whole.exr"));
        let apart = pairs.flat_map(|(a, b)| [0, 1, 2].map(|c| a[c].abs_diff(b[c]))).max();
        assert_eq!(apart.is_some_and(|units| units <= 1), same, "{sampler}: {apart:?}");
    }
    let output = manylight(folder, &["merge", "3.part", "1.part", "-o", "some.png"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(stderr(&output).contains("missing: 2/3"), "{}", stderr(&output));
    refused(
        folder,
        &["merge", "1.part", "1.part", "-o", "b.exr"],
        &["1.part", "same samples"],
    );
    refused(
        folder,
        &["merge", "1.part", "4.part", "-o", "b.exr"],
        &["4.part", "cannot read"],
    );
    refused(
        folder,
        &["merge", "whole.exr", "-o", "b.exr"],
        &["whole.exr", "no state"],
    );
    render(
        folder,
        &["--spp=23", "--sampler=table", "--shard=2/3", "-o", "table.part"],
    );
    refused(
        folder,
        &["merge", "1.part", "table.part", "-o", "b.exr"],
        &["table.part", "settings"],
    );
}

#[test]
fn nothing_breaks_under_stress() {
    let temporary = folder();
    let output = manylight(temporary.path(), &["bench", "--stress=quick", "-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", stdout(&output));
    let text = fs::read_to_string(temporary.path().join("out/stress.json")).expect("written");
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(found["passed"], true);
    assert!(found["checks"].as_array().is_some_and(|checks| checks.len() > 900));
}

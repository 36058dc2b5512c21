//! `view` under a virtual display: scripts drive the window, and what it shows is compared with what it rendered.
//!
//! Without `Xvfb` these tests are skipped and say so; with `REQUIRE_GPU=1` they fail then.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

/// A virtual display, as long as it lives.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// Starts one; `None` if that is not possible here and not required.
    fn start() -> Option<Self> {
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut server) = server else {
            assert!(
                std::env::var_os("REQUIRE_GPU").is_none_or(|value| value != "1"),
                "REQUIRE_GPU=1, but Xvfb does not start"
            );
            eprintln!("SKIPPED: the window is not tested, because Xvfb does not start (install xvfb)");
            return None;
        };
        let mut number = String::new();
        let output = server.stdout.take().expect("it is piped");
        BufReader::new(output)
            .read_line(&mut number)
            .expect("the number of the display");
        Some(Self {
            server,
            name: format!(":{}", number.trim()),
        })
    }

    /// Runs `view` on `scene` with a script, in `folder`. `None` if there is no driver here and none is required.
    fn view(&self, folder: &Path, scene: &str, script: &str) -> Option<Output> {
        self.view_with(folder, scene, script, &[])
    }

    /// The same with further `arguments`.
    fn view_with(&self, folder: &Path, scene: &str, script: &str, arguments: &[&str]) -> Option<Output> {
        std::fs::write(folder.join("script.txt"), script).expect("a writable folder");
        let output = program(folder)
            .args([
                "view",
                scene,
                "--width",
                "160",
                "--height",
                "120",
                "--script",
                "script.txt",
            ])
            .args(arguments)
            .env("DISPLAY", &self.name)
            .output()
            .expect("the program starts");
        if output.status.code() == Some(3) && std::env::var_os("REQUIRE_GPU").is_none_or(|value| value != "1") {
            eprintln!("SKIPPED: the window is not tested: {}", stderr(&output));
            return None;
        }
        Some(output)
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_manylight-under-test"));
    command
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder)
        .env("XDG_CONFIG_HOME", folder)
        .env("XDG_RUNTIME_DIR", folder)
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .env_remove("DISPLAY");
    command
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn succeeded(output: &Output) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(!text.contains("panicked") && !text.contains("GPU:"), "{text}");
}

#[test]
fn without_a_display_the_window_is_refused_with_the_remedy() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for arguments in [&["view", "demo:one-light"][..], &["demo:one-light"]] {
        let output = program(folder.path())
            .args(arguments)
            .output()
            .expect("the program starts");
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{text}");
        assert!(
            text.contains("manylight render") && !text.contains("panicked"),
            "{text}"
        );
    }
}

#[test]
fn a_script_that_is_not_understood_is_refused_with_the_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("script.txt"), "0 settle 2\n0 jump\n").expect("a writable folder");
    let arguments = ["view", "demo:one-light", "--script", "script.txt"];
    let output = program(folder.path())
        .args(arguments)
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("line 2"), "{}", stderr(&output));
}

#[test]
fn the_window_shows_what_was_rendered_through_the_tone_curve_of_png_files() {
    let Some(display) = Display::start() else { return };
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let folder = temporary.path();
    let script = "0 key n\n0 settle 8\n0 key f2\n0 key x\n1 key space\n40 screenshot linear.exr\n40 screenshot seen.png\n\
                  45 report report.json\n60 quit\n";
    let Some(output) = display.view(folder, "demo:rooms:64", script) else {
        return;
    };
    succeeded(&output);
    let report = std::fs::read_to_string(folder.join("report.json")).expect("a report");
    let report: Value = serde_json::from_str(&report).expect("JSON");
    let exposure = report["exposure"].as_f64().expect("a number") as f32;
    let linear = render::image::read_exr(&folder.join("linear.exr")).expect("an EXR");
    assert_eq!((linear.width, linear.height), (160, 120));
    assert!(linear.pixels.iter().any(|pixel| pixel[1] > 0.0), "black");
    render::image::write_png(&folder.join("expected.png"), &linear, exposure).expect("a PNG");
    let [seen, expected] = ["seen.png", "expected.png"].map(|name| decode(&folder.join(name)));
    assert_eq!(seen.len(), expected.len());
    let largest = seen
        .iter()
        .zip(&expected)
        .map(|(a, b)| a.abs_diff(*b))
        .max()
        .expect("pixels");
    assert!(largest <= 2, "the shader and the PNG writer differ by {largest} of 255");
}

#[test]
fn walking_reloading_resizing_to_nothing_and_random_inputs_do_no_harm() {
    let Some(display) = Display::start() else { return };
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let script = "0 key w 5\n2 look 40 -10\n4 key f5\n5 resize 0 0\n8 resize 200 150\n10 open demo:points:64\n\
                  11 random 1500 3\n12 sampler tree\n12 open no-such-file.glb\n14 open demo:keyhole:16\n20 report report.json\n\
                  20 quit\n";
    let Some(output) = display.view(temporary.path(), "demo:rooms:64", script) else {
        return;
    };
    succeeded(&output);
    assert!(temporary.path().join("report.json").exists());
    let written = temporary.path().read_dir().expect("a folder").flatten();
    let mut names: Vec<_> = written
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.retain(|name| name != "mesa_shader_cache");
    names.sort();
    assert_eq!(
        names,
        ["report.json", "script.txt"],
        "no other file is written by a script"
    );
}

#[test]
fn a_window_whose_device_is_lost_goes_on_with_another_one() {
    let Some(display) = Display::start() else { return };
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let folder = temporary.path();
    // Panels included: their letters were in the memory of the device that is gone.
    let script = "0 key f2\n0 key n\n0 settle 4\n0 key x\n1 key space\n1 key f2\n1 key f1\n20 key f3\n60 screenshot before.png\n\
                  61 lose-device window\n100 screenshot after.png\n101 quit\n";
    let Some(output) = display.view(folder, "demo:rooms:64", script) else {
        return;
    };
    succeeded(&output);
    assert!(
        stderr(&output).contains("goes on with another one"),
        "{}",
        stderr(&output)
    );
    let [before, after] = ["before.png", "after.png"].map(|name| decode(&folder.join(name)));
    assert_eq!(before.len(), after.len());
    // The figures in the corner are not the same ones.
    let different = before.iter().zip(&after).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(different * 50 < before.len(), "{different} of {} differ", before.len());
    assert!(after.iter().any(|&value| value > 0), "black");
}

#[test]
fn a_window_that_loses_one_device_after_the_other_ends_with_exit_code_4_and_a_remedy() {
    let Some(display) = Display::start() else { return };
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let script = "2 lose-device window\n20 lose-device window\n500 quit\n";
    let Some(output) = display.view(temporary.path(), "demo:rooms:64", script) else {
        return;
    };
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(4), "{text}");
    assert!(
        text.contains("manylight render") && !text.contains("panicked"),
        "{text}"
    );
}

/// The bytes of a PNG's pixels.
fn decode(path: &Path) -> Vec<u8> {
    image::open(path).expect("a PNG").into_rgb8().into_raw()
}

/// The mean of 160x120 pixels of 4 samples or more is within a few percent of that of many. Views of auxiliary images are the CPU's, and when the
/// GPU is taken away in the middle of a frame the CPU goes on, until the GPU is chosen again.
#[test]
fn the_window_shows_what_the_gpu_renders() {
    let Some(display) = Display::start() else { return };
    if crate::gpu::gpu().is_none() {
        return;
    }
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let folder = temporary.path();
    let on_gpu = ["--backend", "gpu", "--sampler", "uniform"];
    let script = "0 settle 4\n0 key f2\n1 screenshot gpu.exr\n1 view normal\n1 settle 4\n2 screenshot gpu.png\n3 report gpu.json\n\
                  3 backend cpu\n3 settle 4\n4 screenshot cpu.png\n5 report cpu.json\n5 backend gpu\n5 view image\n5 settle 2\n\
                  6 lose-device renderer\n6 settle 100\n7 report lost.json\n7 backend gpu\n7 settle 2\n8 report again.json\n\
                  8 sampler octree\n9 screenshot octree.exr\n10 quit\n";
    let Some(output) = display.view_with(folder, "demo:one-light", script, &on_gpu) else {
        return;
    };
    succeeded(&output);
    // What the GPU lacks is rendered all the same, and people are told where.
    assert!(
        stderr(&output).contains("lacks the sampler 'octree'"),
        "{}",
        stderr(&output)
    );
    assert!(
        stderr(&output).contains("was lost") && stderr(&output).contains("the CPU goes on"),
        "{}",
        stderr(&output)
    );
    for (file, expected) in [("gpu", "gpu"), ("cpu", "cpu"), ("lost", "cpu"), ("again", "gpu")] {
        let text = std::fs::read_to_string(folder.join(file).with_extension("json")).expect("a report");
        let report: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(report["rendered_on"], expected, "{text}");
        // The image alone, or all sums of a pixel for a view of auxiliary images; nothing of the CPU's.
        let per_pixel = report["bytes_read"].as_u64().expect("a number") / (160 * 120);
        let read = [("gpu", 208), ("again", 16)].iter().find(|(name, _)| *name == file);
        assert_eq!(per_pixel, read.map_or(0, |(_, bytes)| *bytes), "{text}");
    }
    let [gpu, cpu] = ["gpu.png", "cpu.png"].map(|name| decode(&folder.join(name)));
    let apart: u64 = gpu.iter().zip(&cpu).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    assert!(
        apart < 2 * gpu.len() as u64,
        "normals differ by {apart} of {}",
        gpu.len()
    );
    assert!(gpu.iter().any(|&value| value > 0), "black");
    let arguments = [
        "render",
        "demo:one-light",
        "--sampler",
        "uniform",
        "--width",
        "160",
        "--height",
        "120",
    ];
    let rendered = program(folder)
        .args(arguments)
        .args(["--spp", "16", "-o", "cpu.exr"])
        .output()
        .expect("the program starts");
    succeeded(&rendered);
    let mean = |file: &str| {
        let image = render::image::read_exr(&folder.join(file)).expect("an image");
        image
            .pixels
            .iter()
            .flatten()
            .map(|&value| f64::from(value))
            .sum::<f64>()
    };
    let ratio = mean("gpu.exr") / mean("cpu.exr");
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

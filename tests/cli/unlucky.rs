//! Limits of the system, and files that change under the program's hands.

use super::{folder, listing, stderr, triangle, write};
use scene::Scene;
use std::sync::atomic::{AtomicBool, Ordering};

/// The shell's limit is an error like a full disk: the process lives, and nothing half-written is left.
#[cfg(unix)]
#[test]
fn files_that_grow_beyond_the_limit_are_refused() {
    use std::process::Command;
    let temporary = folder();
    let folder = temporary.path();
    for (file, more) in [
        ("image.exr", ["--spp=2", "-q"]),
        ("image.png", ["--spp=2", "-q"]),
        ("state.part", ["--spp=2", "-q"]),
    ] {
        let output = Command::new("sh")
            .args([
                "-c",
                "ulimit -f 1 && exec \"$@\"",
                "sh",
                env!("CARGO_BIN_EXE_manylight-under-test"),
            ])
            .args(["render", "demo:rooms:32", "--width=64", "--height=48", "-o", file])
            .args(more)
            .current_dir(folder)
            .output()
            .expect("a shell");
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{file}: {:?}, {text}", output.status);
        assert!(
            text.contains("error:") && text.contains(file) && text.contains("too large"),
            "{text}"
        );
        assert_eq!(listing(folder), [""; 0], "{file}");
    }
}

/// What loads is one of the files that were there, whole; what does not says why.
#[test]
fn scenes_may_be_replaced_and_cut_short_while_they_load() {
    let temporary = folder();
    let folder = temporary.path();
    let path = folder.join("scene.gltf");
    let lamp = |intensity: f64| {
        triangle(|s| s["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = intensity.into())
    };
    let [one, other] = [1.0, 1000.0].map(lamp);
    write(folder, "scene.gltf", one.clone());
    let done = AtomicBool::new(false);
    let mut refusals = Vec::new();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for text in [&other[..], &one[..one.len() / 2], &one].iter().cycle() {
                if done.load(Ordering::Relaxed) {
                    break;
                }
                // Cut to nothing and written anew in place, as most programs do it.
                std::fs::write(&path, text).expect("a writable folder");
            }
        });
        for _ in 0..500 {
            match scene::gltf::read(&path).and_then(Scene::new) {
                Ok(scene) => assert!([1.0, 1000.0].contains(&scene.lights[0].intensity.x)),
                Err(error) => refusals.push(error.to_string()),
            }
        }
        done.store(true, Ordering::Relaxed);
    });
    assert!(refusals.iter().all(|text| text.contains("scene.gltf")), "{refusals:?}");
}

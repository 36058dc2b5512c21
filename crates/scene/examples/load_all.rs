//! Loads every glTF file below the folders or files named on the command line and says what came of each: a check of
//! the reader against conformance sets and damaged files. Exit code 1 if any file crashed it or took over 5 s.
//!
//! `cargo run --release -p scene --example load_all -- FOLDER`

use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() {
    let mut files = Vec::new();
    for argument in std::env::args_os().skip(1) {
        collect(Path::new(&argument), &mut files);
    }
    files.sort();
    let (mut loaded, mut refused, mut failed) = (0, 0, 0);
    for file in &files {
        let start = Instant::now();
        let outcome = catch_unwind(|| scene::load(&file.to_string_lossy()));
        let seconds = start.elapsed().as_secs_f64();
        let line = match outcome {
            Err(_) => {
                failed += 1;
                "CRASH".into()
            }
            Ok(Err(error)) => {
                refused += 1;
                format!("refused  {error}")
            }
            Ok(Ok(scene)) => {
                loaded += 1;
                let parts = &scene.parts;
                format!(
                    "loaded   {} triangles, {} meshes, {} instances, {} lights, {} textures, {} cameras; \
                     ignored {:?}; warnings {:?}",
                    scene.triangle_count(),
                    parts.meshes.len(),
                    parts.instances.len(),
                    scene.lights.len(),
                    parts.textures.len(),
                    parts.cameras.len(),
                    parts.report.ignored,
                    parts.report.warnings,
                )
            }
        };
        failed += i32::from(seconds > 5.0);
        println!("{seconds:7.3} s  {}  {line}", file.display());
    }
    println!(
        "{} files: {loaded} loaded, {refused} refused, {failed} crashed or too slow",
        files.len()
    );
    std::process::exit(i32::from(failed > 0));
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    if let Ok(entries) = std::fs::read_dir(path) {
        entries.flatten().for_each(|entry| collect(&entry.path(), files));
    } else if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"))
    {
        files.push(path.into());
    }
}

//! Loads damaged copies of glTF files: any outcome but a crash, a hang or a flood of memory.
//!
//! `cargo run --release -p scene --example fuzz_gltf -- EXECUTIONS SEED FOLDER...` takes the files of up to 64 KiB below the
//! folders, damages them by rules that keep most of their JSON readable, and loads what comes out. What crashes the
//! loader or takes over 5 s is written to `fuzz-findings`. Needs no more than a stable compiler; `fuzz` has the same for cargo-fuzz.

use sampling::Random;
use scene::Scene;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Larger files say little more and take longer.
const LARGEST_FILE: u64 = 1 << 16;
/// An execution that takes longer is a finding.
const TOO_SLOW_S: f64 = 5.0;
/// Numbers that programs do not expect.
const ODD_NUMBERS: [&str; 16] = [
    "-1",
    "0",
    "1",
    "2",
    "255",
    "65536",
    "2147483647",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551615",
    "1e38",
    "1e39",
    "-1e-45",
    "1e999",
    "null",
];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = || arguments.next().and_then(|text| text.parse().ok());
    let (Some(executions), Some(seed)) = (number(), number()) else {
        eprintln!("usage: fuzz_gltf EXECUTIONS SEED FOLDER...");
        std::process::exit(2);
    };
    let mut files = BTreeMap::new();
    arguments.for_each(|folder| collect(Path::new(&folder), &mut files));
    let folder = std::env::temp_dir().join(format!("fuzz-gltf-{}", std::process::id()));
    let failed = fuzz(&files, &folder, executions, seed);
    let _ = std::fs::remove_dir_all(&folder);
    match failed {
        Ok(0) => {}
        Ok(_) => std::process::exit(1),
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(2);
        }
    }
}

/// All small files by name, what glTF files refer to included.
fn collect(path: &Path, files: &mut BTreeMap<OsString, Vec<u8>>) {
    if let Ok(entries) = std::fs::read_dir(path) {
        entries.flatten().for_each(|entry| collect(&entry.path(), files));
    } else if let (Some(name), Ok(data)) = (path.file_name(), path.metadata())
        && data.len() <= LARGEST_FILE
        && let Ok(bytes) = std::fs::read(path)
    {
        files.insert(name.into(), bytes);
    }
}

/// Returns how many executions failed.
fn fuzz(files: &BTreeMap<OsString, Vec<u8>>, folder: &Path, executions: u64, seed: u64) -> std::io::Result<u64> {
    std::fs::create_dir_all(folder)?;
    for (name, bytes) in files {
        std::fs::write(folder.join(name), bytes)?;
    }
    let is_scene =
        |name: &OsString| [Some("gltf"), Some("glb")].contains(&Path::new(name).extension().and_then(|e| e.to_str()));
    let corpus: Vec<(&OsString, &Vec<u8>)> = files.iter().filter(|(name, _)| is_scene(name)).collect();
    if corpus.is_empty() {
        return Err(std::io::Error::other("no .gltf or .glb files in the folders"));
    }
    // A finding is reported below; the default hook would print every one.
    std::panic::set_hook(Box::new(|_| {}));
    let (mut loaded, mut refused, mut failed, mut slowest) = (0_u64, 0_u64, 0_u64, 0.0_f64);
    for execution in 0..executions {
        let random = Random::new(seed, execution as u32, (execution >> 32) as u32);
        let pick = |dimension: u32| corpus[random.u32(dimension) as usize % corpus.len()];
        let (name, original) = pick(0);
        let damaged = damage(original, pick(1).1, random);
        let extension = Path::new(name).extension().unwrap_or_default();
        let path = folder.join("damaged").with_extension(extension);
        std::fs::write(&path, &damaged)?;
        let start = Instant::now();
        let outcome = catch_unwind(|| scene::gltf::read(&path).and_then(Scene::new).is_ok());
        let seconds = start.elapsed().as_secs_f64();
        slowest = slowest.max(seconds);
        match outcome {
            Ok(true) => loaded += 1,
            Ok(false) => refused += 1,
            Err(_) => {}
        }
        if outcome.is_err() || seconds > TOO_SLOW_S {
            failed += 1;
            let kept = PathBuf::from("fuzz-findings");
            std::fs::create_dir_all(&kept)?;
            let kept = kept.join(format!("{seed}-{execution}")).with_extension(extension);
            std::fs::write(&kept, &damaged)?;
            println!("{}: {seconds:.1} s, crashed: {}", kept.display(), outcome.is_err());
        }
    }
    println!(
        "{executions} executions of {} files, seed {seed}: {loaded} loaded, {refused} refused, {failed} failed; slowest {slowest:.3} s",
        corpus.len()
    );
    Ok(failed)
}

/// A copy with one to four faults.
fn damage(original: &[u8], other: &[u8], random: Random) -> Vec<u8> {
    let mut bytes = original.to_vec();
    for fault in 0..1 + random.u32(2) % 4 {
        let number = |i: u32| random.u32(8 * fault + 8 + i) as usize;
        if bytes.is_empty() {
            break;
        }
        let at = number(0) % bytes.len();
        let span = at..(at + 1 + number(1) % 40).min(bytes.len());
        let digit = bytes
            .iter()
            .skip(at)
            .position(u8::is_ascii_digit)
            .map(|ahead| at + ahead);
        match (number(2) % 8, digit) {
            (0 | 1, Some(digit)) => bytes[digit] = b'0' + (number(3) % 10) as u8,
            (2 | 3, Some(digit)) => {
                let end = digit + bytes[digit..].iter().take_while(|b| b.is_ascii_digit()).count();
                bytes.splice(digit..end, ODD_NUMBERS[number(3) % ODD_NUMBERS.len()].bytes());
            }
            (4, _) => bytes[at] = number(3) as u8,
            (5, _) => drop(bytes.drain(span)),
            (6, _) if !other.is_empty() => {
                let from = number(3) % other.len();
                let to = (from + 1 + number(4) % 200).min(other.len());
                bytes.splice(span, other[from..to].iter().copied());
            }
            (7, _) if number(3) % 4 == 0 => bytes.truncate(at),
            _ => {
                let repeated = bytes[span.clone()].to_vec();
                bytes.splice(span.start..span.start, repeated);
            }
        }
    }
    bytes
}

//! Feeds damaged files to the readers of this project: any outcome but a crash, a hang or a flood of memory.
//!
//! `cargo run --release -p tests --example fuzz -- READER EXECUTIONS SEED FOLDER...` takes the files of up to 64 KiB below the folders, damages
//! them, and gives what comes out to a reader. What crashes it or takes over 5 s is written to `fuzz-findings`. Needs no more than a
//! stable compiler; the folder `fuzz` has the same for cargo-fuzz.

mod damage;
mod readers;

use readers::{File, Reader};
use sampling::Random;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Larger files say little more and take longer.
const LARGEST_FILE: u64 = 1 << 16;
/// An execution that takes longer is a finding.
const TOO_SLOW_S: f64 = 5.0;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let reader = arguments.next();
    let mut number = || arguments.next().and_then(|text| text.parse().ok());
    let (Some(reader), Some(executions), Some(seed)) = (reader, number(), number()) else {
        eprintln!(
            "usage: fuzz READER EXECUTIONS SEED FOLDER...\nreaders: {}",
            readers::names().join(", ")
        );
        return ExitCode::from(2);
    };
    let mut files = Vec::new();
    arguments.for_each(|folder| collect(Path::new(&folder), &mut files));
    let failed = Reader::new(&reader, files).and_then(|reader| fuzz(reader, executions, seed));
    match failed {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

/// All small files, in the order of their paths.
fn collect(path: &Path, files: &mut Vec<File>) {
    if let Ok(entries) = std::fs::read_dir(path) {
        let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        paths.iter().for_each(|path| collect(path, files));
    } else if let (Some(name), Ok(data)) = (path.file_name(), path.metadata())
        && data.len() <= LARGEST_FILE
        && let Ok(bytes) = std::fs::read(path)
    {
        files.push((name.into(), bytes));
    }
}

/// Returns how many executions failed.
fn fuzz(mut reader: Reader, executions: u64, seed: u64) -> std::io::Result<u64> {
    let start = Instant::now();
    let corpus = reader.corpus()?;
    // A finding is reported below; the default hook would print every one.
    std::panic::set_hook(Box::new(|_| {}));
    let (mut taken, mut refused, mut failed, mut slowest) = (0_u64, 0_u64, 0_u64, 0.0_f64);
    for execution in 0..executions {
        let random = Random::new(seed, execution as u32, (execution >> 32) as u32);
        let pick = |dimension: u32| &corpus[random.u32(dimension) as usize % corpus.len()];
        let (name, original) = pick(0);
        let damaged = damage::damage(original, &pick(1).1, random);
        let began = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| reader.read(name, &damaged)));
        let seconds = began.elapsed().as_secs_f64();
        slowest = slowest.max(seconds);
        match outcome {
            Ok(true) => taken += 1,
            Ok(false) => refused += 1,
            Err(_) => {}
        }
        if outcome.is_err() || seconds > TOO_SLOW_S {
            failed += 1;
            let kept = keep(&format!("{seed}-{execution}"), name, &damaged)?;
            println!("{}: {seconds:.1} s, crashed: {}", kept.display(), outcome.is_err());
        }
    }
    println!(
        "{}: {executions} executions of {} files, seed {seed}: {taken} taken, {refused} refused, {failed} failed; slowest {slowest:.3} s, {:.0} s in \
         all, peak memory {}",
        reader.name(),
        corpus.len(),
        start.elapsed().as_secs_f64(),
        peak_memory()
    );
    Ok(failed)
}

/// Writes a finding; returns where.
fn keep(number: &str, name: &OsString, damaged: &[u8]) -> std::io::Result<PathBuf> {
    let folder = PathBuf::from("fuzz-findings");
    std::fs::create_dir_all(&folder)?;
    let mut file = OsString::from(number);
    file.push("-");
    file.push(name);
    let path = folder.join(file);
    std::fs::write(&path, damaged)?;
    Ok(path)
}

/// The most memory that the process has held, where the system tells.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.map_or("unknown".into(), |size| size.trim().into())
}

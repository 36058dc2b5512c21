//! What the program runs on.

use serde::Serialize;
use std::time::{SystemTime, UNIX_EPOCH};

/// The machine and the program, for reports.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Machine {
    /// Name of the processor; "unknown" where the system does not tell.
    pub(crate) cpu: String,
    /// Logical processors available to the process.
    pub(crate) logical_cpus: usize,
    /// Threads that render.
    pub(crate) threads: usize,
    /// Vector instruction sets found.
    pub(crate) simd: Vec<&'static str>,
    /// Operating system and architecture.
    pub(crate) system: String,
    /// Memory, bytes; 0 if unknown.
    pub(crate) memory_bytes: u64,
    /// Version of the program.
    pub(crate) version: &'static str,
    /// Commit it was built from, if the build was told by `MANYLIGHT_COMMIT`.
    pub(crate) commit: Option<&'static str>,
}

/// Version of the program.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

impl Machine {
    /// This machine.
    pub(crate) fn detect() -> Self {
        Self {
            cpu: cpu_name().unwrap_or_else(|| "unknown".into()),
            logical_cpus: std::thread::available_parallelism().map_or(1, usize::from),
            threads: rayon::current_num_threads(),
            simd: simd(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            memory_bytes: proc_field("/proc/meminfo", "MemTotal:").unwrap_or(0),
            version: VERSION,
            commit: option_env!("MANYLIGHT_COMMIT"),
        }
    }
}

/// The most memory the process has held, bytes; 0 where the system does not tell.
pub(crate) fn peak_rss_bytes() -> u64 {
    proc_field("/proc/self/status", "VmHWM:").unwrap_or(0)
}

/// The memory that the process holds now, bytes; 0 where the system does not tell.
pub(crate) fn rss_bytes() -> u64 {
    proc_field("/proc/self/status", "VmRSS:").unwrap_or(0)
}

/// Memory that is free or can be freed, bytes, if the system tells.
pub(crate) fn available_memory_bytes() -> Option<u64> {
    proc_field("/proc/meminfo", "MemAvailable:")
}

/// Seconds for which all threads of the process together have had a processor, where the system tells.
pub(crate) fn processor_s() -> Option<f64> {
    let mut nanoseconds = 0_u64;
    for thread in std::fs::read_dir("/proc/self/task").ok()? {
        // Threads that have ended in between have had their time before.
        let Ok(text) = std::fs::read_to_string(thread.ok()?.path().join("schedstat")) else {
            continue;
        };
        nanoseconds += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    Some(nanoseconds as f64 * 1e-9)
}

/// A field in kB of one of Linux's text files, in bytes.
fn proc_field(path: &str, field: &str) -> Option<u64> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(field))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

fn cpu_name() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().into())
}

#[cfg(target_arch = "x86_64")]
fn simd() -> Vec<&'static str> {
    let found = [
        ("sse4.2", is_x86_feature_detected!("sse4.2")),
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
        ("avx512vl", is_x86_feature_detected!("avx512vl")),
    ];
    found
        .into_iter()
        .filter_map(|(name, here)| here.then_some(name))
        .collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn simd() -> Vec<&'static str> {
    if cfg!(target_arch = "aarch64") {
        vec!["neon"]
    } else {
        Vec::new()
    }
}

/// Today in UTC, `YYYY-MM-DD`.
pub(crate) fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    date(seconds / 86_400)
}

/// The Gregorian date of a day counted from 1970-01-01. Years are counted from March, so that the leap day is the last
/// of its year.
fn date(days: u64) -> String {
    let days = days + 719_468; // days from 0000-03-01 to 1970-01-01
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::date;

    #[test]
    fn dates_are_gregorian() {
        let known = [
            (0, "1970-01-01"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (20_819, "2027-01-01"),
        ];
        for (days, text) in known {
            assert_eq!(date(days), text);
        }
    }
}

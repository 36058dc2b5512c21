//! How the allocator is made to give memory back.

use crate::message;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;

/// Read by glibc when a program starts: bytes from which on an allocation is the system's own, and goes back there when it is freed.
const THRESHOLD: (&str, &str) = ("MALLOC_MMAP_THRESHOLD_", "131072");

/// Makes freed memory go back to the system, so that what is dropped can be used by others.
///
/// Without being told, glibc raises its threshold to the size of whatever is freed, up to 32 MiB, keeps what is smaller for itself, and each of its
/// arenas for itself (mallopt(3)). Being told is possible before the start only, or by a call that Rust thinks unsafe; so the program starts itself
/// again in its own process. Other allocators are left alone, and so is a threshold that the user has set.
pub(crate) fn give_back_what_is_freed() {
    let (name, value) = THRESHOLD;
    if !cfg!(target_env = "gnu") || std::env::var_os(name).is_some() {
        return;
    }
    let mut arguments = std::env::args_os();
    let called = arguments.next().unwrap_or_else(|| OsString::from("manylight"));
    let Ok(program) = std::env::current_exe() else { return };
    // Returns only if it fails.
    let error = Command::new(program)
        .arg0(called)
        .args(arguments)
        .env(name, value)
        .exec();
    message::warn(format!(
        "the memory that --memory-budget drops may stay with this program ({error}); set {name}={value} in the environment"
    ));
}

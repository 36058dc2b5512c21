//! Files the program writes: checked before the work begins, complete or absent after it.

use anyhow::{Context, Result};
use scene::file::{self, Pipe};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Whether the name stands for stdout.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Makes sure that `path` can be written, before hours are spent on what should go there. Leaves no trace.
///
/// # Errors
/// If the folder is missing or read-only, or a folder has that name.
pub(crate) fn check_writable(path: &Path) -> Result<()> {
    file::check(path).with_context(|| {
        let path = path.display();
        format!("{path}: cannot write; check that its folder exists and is writable, and that it is no folder itself")
    })
}

/// Where things are kept that can be made again; `None` if the user has no such folder.
pub(crate) fn cache_folder() -> Option<PathBuf> {
    let variable = |name| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let base = variable("XDG_CACHE_HOME").or_else(|| Some(variable("HOME")?.join(".cache")))?;
    Some(base.join("manylight"))
}

/// Writes a file by `fill`, see [`file::write`].
///
/// # Errors
/// Those of `fill` and of the file system.
pub(crate) fn write_with(path: &Path, fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>) -> Result<()> {
    file::write(path, fill).with_context(|| format!("{}: cannot write", path.display()))
}

/// Writes a whole text or binary file, see [`write_with`].
///
/// # Errors
/// Those of the file system.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, |file| Ok(file.write_all(bytes)?))
}

/// Writes results to stdout; a reader that has seen enough is no error.
///
/// # Errors
/// If stdout cannot be written for any other reason.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut stdout = stdout();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .context("cannot write to stdout")
}

/// Stdout, buffered, that swallows the rest once its reader has gone.
pub(crate) fn stdout() -> impl Write + Send {
    BufWriter::new(Pipe::new(std::io::stdout()))
}

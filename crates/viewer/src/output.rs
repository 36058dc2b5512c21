//! Files the program writes: checked before the work begins, complete or absent after it.

use anyhow::{Context, Result, bail};
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The folder a file will lie in.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.into(),
        _ => PathBuf::from("."),
    }
}

/// Whether the name stands for stdout.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// A pipe, terminal or device: written to as it is, for it cannot be replaced.
fn is_special(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Makes sure that `path` can be written, before hours are spent on what should go there. Leaves no trace.
///
/// # Errors
/// If the folder is missing or read-only, or a folder has that name.
pub(crate) fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        bail!("{}: cannot write: it is a folder; give a file name", path.display());
    }
    if is_special(path) {
        return Ok(());
    }
    let folder = folder_of(path);
    tempfile::Builder::new()
        .prefix(".manylight-")
        .tempfile_in(&folder)
        .with_context(|| {
            format!(
                "{}: cannot write; check that the folder {} exists and is writable",
                path.display(),
                folder.display()
            )
        })?;
    Ok(())
}

/// Writes a file by `fill`: beside the target first, then renamed, so that it is there in full or not at all.
///
/// # Errors
/// Those of `fill` and of the file system.
pub(crate) fn write_with(path: &Path, fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>) -> Result<()> {
    let place = || format!("{}: cannot write", path.display());
    if is_special(path) {
        let mut file = Pipe(Some(File::options().write(true).open(path).with_context(place)?));
        return fill(&mut file).with_context(place);
    }
    // A link keeps pointing to where it points: the file behind it is replaced.
    let target = path.canonicalize().unwrap_or_else(|_| path.into());
    let mut file = tempfile::Builder::new()
        .prefix(".manylight-")
        .permissions(default_permissions())
        .tempfile_in(folder_of(&target))
        .with_context(place)?;
    let mut buffer = BufWriter::new(file.as_file_mut());
    fill(&mut buffer).with_context(place)?;
    buffer.flush().with_context(place)?;
    drop(buffer);
    file.persist(&target).with_context(place)?;
    Ok(())
}

/// What a file would get that was not made as a temporary one; the system takes off the umask.
#[cfg(unix)]
fn default_permissions() -> std::fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o666)
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
    BufWriter::new(Pipe(Some(std::io::stdout())))
}

/// A writer that becomes a sink when the other end of the pipe is closed.
struct Pipe<W>(Option<W>);

impl<W: Write> Pipe<W> {
    fn attempt<T>(&mut self, whole: T, act: impl FnOnce(&mut W) -> std::io::Result<T>) -> std::io::Result<T> {
        let Some(inner) = &mut self.0 else { return Ok(whole) };
        match act(inner) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => {
                self.0 = None;
                Ok(whole)
            }
            result => result,
        }
    }
}

impl<W: Write> Write for Pipe<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.attempt(bytes.len(), |inner| inner.write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.attempt((), Write::flush)
    }
}

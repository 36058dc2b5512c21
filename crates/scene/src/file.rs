//! Writing files: the only place where the program makes one.
//!
//! A file is there in full or not at all: it is written beside its place under another name, then renamed. What cannot
//! be replaced (pipes, terminals, devices) is written to as it is. Links keep pointing to where they point.

use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes a file with what `fill` gives.
///
/// A pipe whose reader leaves early is no error: the rest is swallowed.
///
/// # Errors
/// Those of `fill` and of the file system; the file that was there before is then still there.
pub fn write<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<(), E>,
) -> Result<(), E> {
    if is_special(path) {
        let mut writer = BufWriter::new(Pipe::new(File::options().write(true).open(path)?));
        fill(&mut writer)?;
        return Ok(writer.flush()?);
    }
    let target = target_of(path)?;
    let mut file = temporary_beside(&target)?;
    let mut writer = BufWriter::new(file.as_file_mut());
    fill(&mut writer)?;
    writer.flush()?;
    drop(writer);
    file.persist(&target).map_err(|refused| refused.error)?;
    Ok(())
}

/// Whether [`write()`] could write `path`, as far as can be told before. Leaves no trace.
///
/// # Errors
/// If the folder is missing or read-only, or a folder has that name.
pub fn check(path: &Path) -> io::Result<()> {
    if !is_special(path) {
        temporary_beside(&target_of(path)?)?;
    }
    Ok(())
}

/// A pipe, terminal or device.
fn is_special(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Where the links of `path` end, whether there is anything or not.
fn target_of(path: &Path) -> io::Result<PathBuf> {
    /// As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        if target.is_dir() {
            return Err(io::Error::new(ErrorKind::IsADirectory, "it is a folder"));
        }
        match target.read_link() {
            Ok(next) => target = folder_of(&target).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::other("its links lead in a circle"))
}

fn folder_of(path: &Path) -> &Path {
    path.parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

/// An empty file in the folder of `target`, which goes away unless it is renamed. It may be read as any other new file,
/// not by its owner only; the process' umask still applies.
fn temporary_beside(target: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".manylight-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder_of(target))
}

/// A writer that becomes a sink when its reader has gone: whoever closes a pipe has seen enough.
#[derive(Debug)]
pub struct Pipe<W>(Option<W>);

impl<W: Write> Pipe<W> {
    /// Writes to `inner` as long as anybody reads.
    pub fn new(inner: W) -> Self {
        Self(Some(inner))
    }

    fn attempt<T>(&mut self, whole: T, act: impl FnOnce(&mut W) -> io::Result<T>) -> io::Result<T> {
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
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.attempt(bytes.len(), |inner| inner.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt((), Write::flush)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(path: &Path, text: &str) -> io::Result<()> {
        write(path, |file| file.write_all(text.as_bytes()))
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = folder.read_dir().unwrap();
        let mut names: Vec<_> = entries
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_or_stays_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        put(&path, "old").unwrap();
        put(&path, "new").unwrap();
        let failed = write(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
        check(&path).unwrap();
        check(&folder.path().join("b")).unwrap();
        assert_eq!(names(folder.path()), ["a"]);
        assert!(check(&folder.path().join("none/a")).is_err());
        assert!(check(folder.path()).is_err() && put(folder.path(), "").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn new_files_have_ordinary_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |name: &str| folder.path().join(name).metadata().unwrap().permissions().mode();
        put(&folder.path().join("ours"), "").unwrap();
        std::fs::write(folder.path().join("ordinary"), "").unwrap();
        assert_eq!(mode("ours"), mode("ordinary"));
    }

    #[cfg(unix)]
    #[test]
    fn links_keep_pointing() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("far")).unwrap();
        let links = [
            ("to", "far/to"),
            ("far/to", "end"),
            ("round", "trip"),
            ("trip", "round"),
        ];
        for (link, target) in links {
            std::os::unix::fs::symlink(target, at(link)).unwrap();
        }
        for text in ["made where a link pointed to nothing", "replaced"] {
            put(&at("to"), text).unwrap();
            assert_eq!(std::fs::read_to_string(at("far/end")).unwrap(), text);
        }
        assert!(put(&at("round"), "").is_err() && check(&at("trip")).is_err());
        for (link, target) in links {
            assert_eq!(at(link).read_link().unwrap(), Path::new(target));
        }
    }

    #[cfg(unix)]
    #[test]
    fn pipes_are_written_to_and_stay_pipes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status().unwrap();
        assert!(made.success());
        check(&path).unwrap();
        let text = "0123456789".repeat(20_000);
        let all = std::thread::scope(|scope| {
            let reader = scope.spawn(|| std::fs::read_to_string(&path).unwrap());
            put(&path, &text).unwrap();
            reader.join().unwrap()
        });
        assert_eq!(all, text);
        // A reader that leaves early.
        std::thread::scope(|scope| {
            scope.spawn(|| drop(File::open(&path).unwrap()));
            put(&path, &text).unwrap();
        });
        use std::os::unix::fs::FileTypeExt;
        assert!(path.metadata().unwrap().file_type().is_fifo());
        assert_eq!(names(folder.path()), ["pipe"]);
    }
}

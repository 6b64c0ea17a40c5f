//! Files that are always whole.
//!
//! A file is written beside its place under a temporary name, synced, renamed, and its folder synced: after a
//! crash at any moment the place holds the old content or the new one. The history is appended to and synced
//! row by row instead.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::OutputError;

/// Start of the names of unfinished files.
pub(super) const UNFINISHED: &str = ".fluxmorph-";

/// Write a whole file, replacing an older one.
///
/// # Errors
/// When the operating system refuses; the older file then is as it was.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomic_with(path, |file| file.write_all(bytes))
}

/// Write a whole file with a function that fills it, replacing an older one.
///
/// # Errors
/// When the function fails or the operating system refuses; the older file then is as it was.
pub fn write_atomic_with(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), OutputError> {
    let write = || {
        let folder = folder_of(path);
        let mut builder = tempfile::Builder::new();
        builder.prefix(UNFINISHED);
        // A temporary file is private by default; results are as readable as any file of the user.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut file = builder.tempfile_in(folder)?;
        let mut buffered = BufWriter::with_capacity(1 << 16, file.as_file_mut());
        fill(&mut buffered)?;
        buffered.flush()?;
        drop(buffered);
        file.as_file().sync_all()?;
        file.persist(path).map_err(|error| error.error)?;
        sync_folder(folder)
    };
    write().map_err(OutputError::io("write", path))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Make the names in a folder durable.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Other systems keep names without being asked, and cannot open folders as files.
#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> std::io::Result<()> {
    Ok(())
}

/// A text file that grows by whole lines, each on the disk before the next.
#[derive(Debug)]
pub struct SyncedLog {
    file: File,
    path: PathBuf,
}

impl SyncedLog {
    /// A new, empty log in place of an older one.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let file = File::create(path).map_err(OutputError::io("create", path))?;
        sync_folder(folder_of(path)).map_err(OutputError::io("create", path))?;
        Ok(Self { file, path: path.to_owned() })
    }

    /// An existing log, to go on behind its last line.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn reopen(path: &Path) -> Result<Self, OutputError> {
        let file = OpenOptions::new().append(true).open(path).map_err(OutputError::io("open", path))?;
        Ok(Self { file, path: path.to_owned() })
    }

    /// Append one line, given without its line break, and wait until it is on the disk.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn append(&mut self, line: &str) -> Result<(), OutputError> {
        let write = |file: &mut File| {
            file.write_all(format!("{line}\n").as_bytes())?;
            file.sync_data()
        };
        write(&mut self.file).map_err(OutputError::io("append to", &self.path))
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_file_is_written_whole_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("result.json");
        write_atomic(&path, b"one").expect("written");
        write_atomic(&path, b"two").expect("replaced");
        assert_eq!(std::fs::read(&path).expect("read"), b"two");
        assert_eq!(names(folder.path()), ["result.json"]);
    }

    #[test]
    fn a_failed_write_keeps_the_old_file() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("result.json");
        write_atomic(&path, b"old").expect("written");
        let failing = |file: &mut dyn Write| {
            file.write_all(b"half")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        let message = write_atomic_with(&path, failing).expect_err("no space").to_string();
        assert!(message.contains("result.json") && message.contains("free some space"), "{message}");
        assert_eq!(std::fs::read(&path).expect("read"), b"old");
        assert_eq!(names(folder.path()), ["result.json"]);
    }

    #[test]
    fn an_absent_folder_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("none/result.json");
        let message = write_atomic(&path, b"").expect_err("no folder").to_string();
        assert!(message.contains("cannot write") && message.contains("none/result.json"), "{message}");
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_the_file_as_the_umask_says() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mode = |name: &str| {
            let path = folder.path().join(name);
            std::fs::metadata(path).expect("a file").permissions().mode() & 0o777
        };
        write_atomic(&folder.path().join("ours"), b"").expect("written");
        std::fs::write(folder.path().join("plain"), b"").expect("written");
        assert_eq!(mode("ours"), mode("plain"));
    }

    #[test]
    fn a_log_grows_by_lines_and_goes_on_when_reopened() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("history.csv");
        SyncedLog::create(&path).and_then(|mut log| log.append("a")).expect("written");
        SyncedLog::reopen(&path).and_then(|mut log| log.append("b")).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("read"), "a\nb\n");
        assert!(SyncedLog::reopen(&folder.path().join("none")).is_err());
    }
}

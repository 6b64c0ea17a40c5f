//! Files that are always whole, and logs that grow record by record.
//!
//! A file is written beside its place under a temporary name, synced, renamed, and its folder synced: after a
//! crash at any moment the place holds the old content or the new one. A log is appended to and synced record by record
//! instead: after a crash its last record may be cut short, and whoever reads it back drops that.

use std::io;
use std::path::{Path, PathBuf};

use super::OutputError;
use super::disk::{Disk, DiskFile};

/// The file that a process locks before it touches a directory. It stays: whoever removed it could not know who has it open.
pub(crate) const LOCK: &str = ".fluxmorph-lock";

/// Start of the names of unfinished files.
pub(crate) const UNFINISHED: &str = ".fluxmorph-";

/// Writes a whole file, replacing an older one.
///
/// # Errors
/// When the operating system refuses; the older file then is as it was, or the new one is whole in its place.
pub(crate) fn write_whole(disk: &dyn Disk, path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let folder = folder_of(path);
    let unfinished = unfinished(path);
    let aside = || -> io::Result<()> {
        let mut file = match disk.create(&unfinished) {
            // Left by a process that was killed.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                disk.remove(&unfinished)?;
                disk.create(&unfinished)?
            }
            other => other?,
        };
        file.write_all(bytes)?;
        file.sync()?;
        drop(file);
        disk.rename(&unfinished, path)
    };
    let written = aside().inspect_err(|_| {
        // The error to report is the first one; what is left has a name that is cleared away later.
        let _ = disk.remove(&unfinished);
    });
    written.and_then(|()| disk.sync_dir(folder)).map_err(OutputError::io("write", path))
}

/// Removes what a process that was killed had not written to its end in a folder, which may be missing.
///
/// # Errors
/// When the operating system refuses.
pub(crate) fn remove_unfinished(disk: &dyn Disk, folder: &Path) -> Result<(), OutputError> {
    for name in names_in(disk, folder)? {
        if name.starts_with(UNFINISHED) && name != LOCK {
            remove(disk, &folder.join(name))?;
        }
    }
    Ok(())
}

/// Names in a folder, sorted; none when there is no folder.
///
/// # Errors
/// When the operating system refuses.
pub(super) fn names_in(disk: &dyn Disk, folder: &Path) -> Result<Vec<String>, OutputError> {
    match disk.names(folder) {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            Ok(Vec::new())
        }
        other => other.map_err(OutputError::io("read", folder)),
    }
}

/// Removes a file, if it is there.
///
/// # Errors
/// When the operating system refuses.
pub(super) fn remove(disk: &dyn Disk, path: &Path) -> Result<(), OutputError> {
    match disk.remove(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(OutputError::io("remove", path)(error)),
        _ => Ok(()),
    }
}

/// The temporary name of a file, in its folder; another process has another one.
fn unfinished(path: &Path) -> PathBuf {
    let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    path.with_file_name(format!("{UNFINISHED}{}-{name}", std::process::id()))
}

pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file that grows by whole records, each on the disk before the next.
#[derive(Debug)]
pub struct SyncedLog {
    file: Box<dyn DiskFile>,
    path: PathBuf,
    /// Bytes of whole records.
    length: u64,
}

impl SyncedLog {
    /// A new log that starts with some bytes. Those are written aside: the log never is without them.
    pub(super) fn create(disk: &dyn Disk, path: &Path, start: &[u8]) -> Result<Self, OutputError> {
        write_whole(disk, path, start)?;
        Self::reopen(disk, path, start.len() as u64)
    }

    /// An existing log, to be continued after its first `length` bytes.
    ///
    /// # Errors
    /// [`OutputError::InUse`] when another process writes it, or when the operating system refuses.
    pub(super) fn reopen(disk: &dyn Disk, path: &Path, length: u64) -> Result<Self, OutputError> {
        let file = disk.append(path, length).map_err(OutputError::io("open", path))?;
        Ok(Self { file, path: path.to_owned(), length })
    }

    /// Appends one record and waits until it is on the disk.
    ///
    /// # Errors
    /// When the operating system refuses; the log then ends with the record before, as far as the disk allows that.
    pub fn append(&mut self, record: &[u8]) -> Result<(), OutputError> {
        match self.file.write_all(record).and_then(|()| self.file.sync()) {
            Ok(()) => {
                self.length += record.len() as u64;
                Ok(())
            }
            Err(error) => {
                // Half a record would look like a row with other numbers. The error to report is the first one.
                let _ = self.file.cut(self.length);
                Err(OutputError::io("append to", &self.path)(error))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::disk::system_disk;
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        system_disk().names(folder).expect("a folder")
    }

    #[test]
    fn a_file_is_written_whole_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("result.json");
        // What a killed process of the same number left does no harm.
        std::fs::write(unfinished(&path), "half").expect("written");
        for content in ["one", "two"] {
            write_whole(&*system_disk(), &path, content.as_bytes()).expect("written");
            assert_eq!(std::fs::read_to_string(&path).expect("read"), content);
        }
        assert_eq!(names(folder.path()), ["result.json"]);
    }

    #[test]
    fn a_failed_write_names_the_file_and_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("none/result.json");
        let message = write_whole(&*system_disk(), &path, b"").expect_err("no folder").to_string();
        assert!(message.contains("cannot write") && message.contains("none/result.json"), "{message}");
        // A folder in the place of the file: all goes well but the last step.
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).expect("created");
        assert!(write_whole(&*system_disk(), &taken, b"x").is_err());
        assert_eq!(names(folder.path()), ["taken"]);
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
        write_whole(&*system_disk(), &folder.path().join("ours"), b"").expect("written");
        std::fs::write(folder.path().join("plain"), b"").expect("written");
        assert_eq!(mode("ours"), mode("plain"));
    }

    #[test]
    fn a_log_grows_by_records_and_goes_on_when_reopened() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (path, disk) = (folder.path().join("history.csv"), system_disk());
        SyncedLog::create(&*disk, &path, b"a\n").and_then(|mut log| log.append(b"b\ntorn")).expect("written");
        SyncedLog::reopen(&*disk, &path, 4).and_then(|mut log| log.append(b"c\n")).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("read"), "a\nb\nc\n");
        assert!(SyncedLog::reopen(&*disk, &folder.path().join("none"), 0).is_err());
    }
}

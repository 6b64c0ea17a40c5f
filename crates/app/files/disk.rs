//! The few operations through which run directories are written and read back, so that tests can put a disk that fails
//! in their place.
//!
//! What a file must go through to be safe is decided above ([`super::files`]); here is one call for each step.

use std::fmt::Debug;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use fluxmorph_geometry::io::read_at_most;

/// Operations on files and folders. All but [`Disk::read`] and [`Disk::names`] change something, and all fail where the
/// operating system refuses; what else they fail with stands with them.
pub trait Disk: Debug + Send + Sync {
    /// Makes a folder and those above it; one that is there already is no error.
    fn create_dir(&self, path: &Path) -> io::Result<()>;

    /// Makes a new file, readable for others as the user's mask says.
    ///
    /// # Errors
    /// When there is one already, be it a link, or the operating system refuses.
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>>;

    /// Opens a file, and not a link to one, to write after its first `length` bytes; what follows them is cut off.
    ///
    /// # Errors
    /// [`io::ErrorKind::ResourceBusy`] when another process holds it, or when the operating system refuses.
    fn append(&self, path: &Path, length: u64) -> io::Result<Box<dyn DiskFile>>;

    /// Locks a file, which is made where it is missing, until the lock is dropped; `None` where nothing can be written or the
    /// file system knows no locks.
    ///
    /// # Errors
    /// [`io::ErrorKind::ResourceBusy`] when another process has locked it, or when the operating system refuses.
    fn lock(&self, path: &Path, sharing: Sharing) -> io::Result<Option<Box<dyn DiskLock>>>;

    /// Gives a file another name, in place of what had it.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;

    /// Removes a file or a link.
    fn remove(&self, path: &Path) -> io::Result<()>;

    /// Removes an empty folder.
    ///
    /// # Errors
    /// [`io::ErrorKind::DirectoryNotEmpty`], or when the operating system refuses.
    fn remove_dir(&self, path: &Path) -> io::Result<()>;

    /// Waits until the names in a folder are on the disk.
    fn sync_dir(&self, path: &Path) -> io::Result<()>;

    /// Reads a whole regular file; a pipe or a device, which may never end, is refused.
    ///
    /// # Errors
    /// [`io::ErrorKind::FileTooLarge`] beyond `most` bytes, when it is a device or a pipe, or when the operating system refuses.
    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>>;

    /// Names in a folder, sorted.
    fn names(&self, path: &Path) -> io::Result<Vec<String>>;

    /// Whether a link is there, wherever it leads.
    fn is_link(&self, path: &Path) -> bool;
}

/// Who may hold a lock at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sharing {
    /// One process alone.
    Exclusive,
    /// All that share.
    Shared,
}

/// A lock, held until it is dropped or its process ends.
pub trait DiskLock: Debug + Send + Sync {
    /// Whether what lies at a path is another folder than that in which the file was locked, or nothing, and the file another one.
    fn is_replaced(&self, folder: &Path, file: &Path) -> bool;
}

/// A locked file, and its folder, which stays the same one wherever it is moved to.
#[derive(Debug)]
struct Locked {
    file: File,
    folder: Option<File>,
}

impl DiskLock for Locked {
    fn is_replaced(&self, folder: &Path, file: &Path) -> bool {
        let is_other = |held: &File, path: &Path| held.metadata().is_ok_and(|own| is_other(&own, path));
        // A folder that may not be read is judged by the file alone.
        self.folder.as_ref().is_none_or(|held| is_other(held, folder)) && is_other(&self.file, file)
    }
}

/// Whether nothing lies at a path, or another entry. What cannot be looked at is taken for the same.
fn is_other(entry: &fs::Metadata, path: &Path) -> bool {
    match fs::metadata(path) {
        Ok(there) => differ(entry, &there),
        Err(error) => error.kind() == io::ErrorKind::NotFound,
    }
}

#[cfg(unix)]
fn differ(entry: &fs::Metadata, other: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |entry: &fs::Metadata| (entry.dev(), entry.ino());
    place(entry) != place(other)
}

/// Other systems do not let go of what is open.
#[cfg(not(unix))]
fn differ(_: &fs::Metadata, _: &fs::Metadata) -> bool {
    false
}

/// A file that is written.
pub trait DiskFile: Write + Debug + Send {
    /// Waits until the content is on the disk.
    fn sync(&mut self) -> io::Result<()>;

    /// Cuts off what follows the first `length` bytes, and writes on from there.
    fn cut(&mut self, length: u64) -> io::Result<()>;
}

/// The disk of the operating system.
pub fn system_disk() -> Arc<dyn Disk> {
    Arc::new(SystemDisk)
}

#[derive(Debug)]
struct SystemDisk;

impl Disk for SystemDisk {
    fn create_dir(&self, path: &Path) -> io::Result<()> {
        fs::create_dir_all(path)
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        hold(&file)?;
        Ok(Box::new(file))
    }

    fn append(&self, path: &Path, length: u64) -> io::Result<Box<dyn DiskFile>> {
        plain(&fs::symlink_metadata(path)?)?;
        let mut file = OpenOptions::new().write(true).open(path)?;
        hold(&file)?;
        DiskFile::cut(&mut file, length)?;
        Ok(Box::new(file))
    }

    fn lock(&self, path: &Path, sharing: Sharing) -> io::Result<Option<Box<dyn DiskLock>>> {
        match fs::symlink_metadata(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            entry => drop(plain(&entry?)?),
        }
        let file = match OpenOptions::new().write(true).create(true).truncate(false).open(path) {
            Err(error) if is_write_protected(&error) => match File::open(path) {
                Ok(file) => file,
                Err(_) => return Ok(None),
            },
            other => other?,
        };
        let locked = match sharing {
            Sharing::Exclusive => file.try_lock(),
            Sharing::Shared => file.try_lock_shared(),
        };
        match locked {
            Ok(()) => Ok(Some(Box::new(Locked {
                file,
                folder: path.parent().and_then(|folder| File::open(folder).ok()),
            }))),
            Err(TryLockError::WouldBlock) => Err(io::ErrorKind::ResourceBusy.into()),
            Err(TryLockError::Error(_)) => Ok(None),
        }
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    fn remove_dir(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir(path)
    }

    /// Other systems than Unix keep names without being asked, and cannot open folders as files.
    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        if cfg!(unix) { File::open(path)?.sync_all() } else { Ok(()) }
    }

    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        if plain(&fs::metadata(path)?)? > most {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        read_at_most(path, most)
    }

    fn names(&self, path: &Path) -> io::Result<Vec<String>> {
        let names = fs::read_dir(path)?
            .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
            .collect::<io::Result<Vec<_>>>();
        names.map(|mut names| {
            names.sort();
            names
        })
    }

    fn is_link(&self, path: &Path) -> bool {
        fs::symlink_metadata(path).is_ok_and(|entry| entry.is_symlink())
    }
}

fn is_write_protected(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem)
}

/// The length of a plain file [bytes]. A pipe would be waited for without end, a device may have none, and a link leads out
/// of the run directory.
fn plain(entry: &fs::Metadata) -> io::Result<u64> {
    let refused = || io::Error::new(io::ErrorKind::InvalidInput, "it is no plain file");
    if entry.is_file() { Ok(entry.len()) } else { Err(refused()) }
}

/// Holds a file against other processes until it is closed, where the file system can do so.
fn hold(file: &File) -> io::Result<()> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(io::ErrorKind::ResourceBusy.into()),
        Err(TryLockError::Error(_)) | Ok(()) => Ok(()),
    }
}

impl DiskFile for File {
    fn sync(&mut self) -> io::Result<()> {
        self.sync_all()
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)?;
        io::Seek::seek(self, io::SeekFrom::Start(length)).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_written_is_held_against_others() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("log");
        let file = SystemDisk.create(&path).expect("created");
        let error = SystemDisk.append(&path, 0).expect_err("held");
        assert_eq!(error.kind(), io::ErrorKind::ResourceBusy);
        drop(file);
        assert!(SystemDisk.append(&path, 0).is_ok());
    }

    #[test]
    fn a_lock_is_one_process_s_or_shared() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("lock");
        let lock = |sharing| SystemDisk.lock(&path, sharing);
        let busy = |sharing| lock(sharing).is_err_and(|error| error.kind() == io::ErrorKind::ResourceBusy);
        let alone = lock(Sharing::Exclusive).expect("locked").expect("a lock");
        assert!(busy(Sharing::Exclusive) && busy(Sharing::Shared));
        drop(alone);
        let shared = [lock(Sharing::Shared).expect("locked"), lock(Sharing::Shared).expect("locked")];
        assert!(busy(Sharing::Exclusive));
        drop(shared);
        assert!(lock(Sharing::Exclusive).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_are_not_taken_for_files_of_a_run() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "theirs").expect("written");
        std::os::unix::fs::symlink(&file, &link).expect("linked");
        assert!(SystemDisk.append(&link, 0).is_err() && SystemDisk.lock(&link, Sharing::Exclusive).is_err());
        assert_eq!(SystemDisk.read(&link, 100).expect("read"), b"theirs");
        // It would fill the memory to the limit.
        let error = SystemDisk.read(Path::new("/dev/zero"), u64::MAX).expect_err("a device");
        assert!(error.to_string().contains("no plain file"), "{error}");
    }

    #[test]
    fn a_log_goes_on_where_it_is_cut() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("log");
        std::fs::write(&path, "abcdef").expect("written");
        let mut file = SystemDisk.append(&path, 3).expect("opened");
        file.write_all(b"XY").and_then(|()| file.sync()).expect("written");
        file.cut(4).and_then(|()| file.write_all(b"Z")).expect("cut");
        assert_eq!(SystemDisk.read(&path, 5).expect("read"), b"abcXZ");
        assert_eq!(SystemDisk.read(&path, 4).expect_err("too long").kind(), io::ErrorKind::FileTooLarge);
    }
}

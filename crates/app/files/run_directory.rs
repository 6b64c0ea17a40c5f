//! The run directory: which folder may become one, and how files get into it and out of it. Their names are in `run_files`,
//! those of the fields in `field_files`.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::OutputError;
use super::disk::{Disk, DiskLock, Sharing};
use super::manifest::Manifest;
use super::names::{FIELDS, is_case, is_surface};
use super::run_files::{FILES, OLDER_JOURNAL};
use super::synced::{
    LOCK, SyncedLog, UNFINISHED, folder_of, names_in, remove, remove_unfinished, write_whole,
};

/// What to do with an earlier run in the same folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OverwritePolicy {
    /// Leave it, and fail.
    Keep,
    /// Remove its files, and no others.
    Replace,
}

/// The folder one run writes into.
#[derive(Debug, Clone)]
pub struct RunDirectory {
    disk: Arc<dyn Disk>,
    path: PathBuf,
    /// What keeps other processes out while this or a copy of it lives; `None` where it is only looked into.
    lock: Option<Arc<dyn DiskLock>>,
}

/// How long a directory in use is waited for.
const PATIENCE: Duration = Duration::from_millis(500);

/// What a folder holds that a run may begin in.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Contents {
    /// Nothing, or what an interrupted start left.
    Leftovers,
    /// An earlier run.
    Run,
}

/// Whether a name is that of a file which a run leaves behind its manifest.
fn is_of_run(name: &str) -> bool {
    FILES.contains(&name) || is_case(name)
}

/// Whether an error says that a file is named where a directory is meant.
fn is_no_directory(error: &OutputError) -> bool {
    matches!(error, OutputError::Io { source, .. } if source.kind() == io::ErrorKind::NotADirectory)
}

/// Refuses to go on in a folder that is another one than that of a lock.
///
/// # Errors
/// [`OutputError::Replaced`].
pub(crate) fn check_place(lock: Option<&dyn DiskLock>, folder: &Path) -> Result<(), OutputError> {
    match lock {
        Some(lock) if lock.is_replaced(folder, &folder.join(LOCK)) => {
            Err(OutputError::Replaced { path: folder.to_owned() })
        }
        _ => Ok(()),
    }
}

impl RunDirectory {
    /// Make the folder ready: it is absent, empty, or holds an earlier run that may be replaced.
    ///
    /// The manifest of an earlier run stays until the new one takes its place, so that the folder is never
    /// without its mark.
    ///
    /// # Errors
    /// When the folder holds something else, or the operating system refuses.
    pub fn create(
        disk: &Arc<dyn Disk>,
        path: &Path,
        overwrite: OverwritePolicy,
    ) -> Result<Self, OutputError> {
        Self::at(disk, path).refuse_link()?;
        let directory = Self::create_flat(disk, path, overwrite)?;
        directory.make_fields()?;
        Ok(directory)
    }

    /// Makes the folder of the fields, if it is not there.
    pub fn make_fields(&self) -> Result<(), OutputError> {
        self.make(&self.fields())
    }

    /// Whether the configuration of a run has been saved, without which it cannot be resumed.
    pub fn holds_configuration(&self) -> bool {
        self.holds(&self.config())
    }

    /// Refuses a run whose journal has the form of earlier versions.
    ///
    /// # Errors
    /// [`OutputError::OlderJournal`].
    pub fn refuse_older_journal(&self) -> Result<(), OutputError> {
        let older = self.path.join(OLDER_JOURNAL);
        if self.holds(&self.journal()) || !self.holds(&older) {
            return Ok(());
        }
        let version = Manifest::read(self).map(|manifest| manifest.version).unwrap_or_default();
        Err(OutputError::OlderJournal { path: older, version })
    }

    fn holds(&self, file: &Path) -> bool {
        self.disk.names(&self.path).is_ok_and(|names| names.iter().any(|name| file.ends_with(name)))
    }

    /// The same without a folder for fields.
    pub fn create_flat(
        disk: &Arc<dyn Disk>,
        path: &Path,
        overwrite: OverwritePolicy,
    ) -> Result<Self, OutputError> {
        let mut directory = Self::at(disk, path);
        match disk.names(path) {
            // Nothing, not even a lock, is written where this run does not belong.
            Ok(_) => drop(directory.contents(overwrite)?),
            Err(error) if error.kind() == io::ErrorKind::NotFound => directory.make(path)?,
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => {
                return Err(OutputError::NotADirectory { path: path.to_owned() });
            }
            Err(error) => return Err(OutputError::io("read", path)(error)),
        }
        directory.acquire()?;
        // Another process may have come and gone between the look and the lock.
        directory.clear(overwrite)?;
        Ok(directory)
    }

    /// Refuses to go on where another folder has taken the place of the one in which the work began: it may be another run's.
    ///
    /// # Errors
    /// [`OutputError::Replaced`].
    pub fn check_place(&self) -> Result<(), OutputError> {
        check_place(self.lock.as_deref(), &self.path)
    }

    fn at(disk: &Arc<dyn Disk>, path: &Path) -> Self {
        Self { disk: Arc::clone(disk), path: path.to_owned(), lock: None }
    }

    /// The same, with other processes kept out; what was read before may be another's since. What a killed one left
    /// half-written goes.
    ///
    /// # Errors
    /// [`OutputError::InUse`] where one works in it, or when the operating system refuses.
    pub fn locked(mut self) -> Result<Self, OutputError> {
        if self.lock.is_none() {
            self.acquire()?;
            self.remove_unfinished(&self.path)?;
        }
        Ok(self)
    }

    /// A process that is about to end, or only writes a report, is waited for.
    fn acquire(&mut self) -> Result<(), OutputError> {
        let began = Instant::now();
        let locked = loop {
            match self.disk.lock(&self.path.join(LOCK), Sharing::Exclusive) {
                Err(error) if error.kind() == io::ErrorKind::ResourceBusy && began.elapsed() < PATIENCE => {
                    std::thread::sleep(PATIENCE / 50);
                }
                locked => break locked,
            }
        };
        self.lock = locked.map_err(OutputError::io("lock", &self.path))?.map(Arc::from);
        Ok(())
    }

    /// Whether another process works in it now.
    pub fn is_in_use(&self) -> bool {
        let locked = self.disk.lock(&self.path.join(LOCK), Sharing::Exclusive);
        locked.is_err_and(|error| error.kind() == io::ErrorKind::ResourceBusy)
    }

    /// The folder of an earlier run.
    ///
    /// # Errors
    /// When the folder does not hold one.
    pub fn open(disk: &Arc<dyn Disk>, path: &Path) -> Result<Self, OutputError> {
        let directory = Self::at(disk, path);
        match Manifest::read(&directory) {
            Ok(manifest) if manifest.is_ours() => {}
            // One that cannot be understood is that of a run all the same, unless it says that it is another program's.
            Err(damaged @ OutputError::Damaged { .. }) if !Manifest::is_of_another(&directory) => {
                return Err(damaged);
            }
            Err(OutputError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
                let of_run = [directory.config(), directory.journal()];
                return Err(match of_run.iter().all(|file| directory.holds(file)) {
                    true => OutputError::NoManifest { path: directory.manifest() },
                    false => OutputError::NoRun { path: path.to_owned() },
                });
            }
            Err(error @ OutputError::Io { .. }) if !is_no_directory(&error) => return Err(error),
            _ => return Err(OutputError::NoRun { path: path.to_owned() }),
        }
        directory.refuse_link()?;
        Ok(directory)
    }

    /// A link may lead anywhere, and what lies in an older folder may come from others.
    fn refuse_link(&self) -> Result<(), OutputError> {
        let path = self.fields();
        if self.disk.is_link(&path) { Err(OutputError::Linked { path }) } else { Ok(()) }
    }

    /// Makes a folder, and those above it that are missing; their names are on the disk then.
    pub(super) fn make(&self, path: &Path) -> Result<(), OutputError> {
        self.check_place()?;
        let is_missing = |folder: &&Path| {
            let names = self.disk.names(folder);
            !folder.as_os_str().is_empty()
                && names.is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
        };
        let missing = path.ancestors().skip(1).take_while(is_missing).count();
        // A link that leads nowhere is missing, and cannot be made.
        if let Some(link) = path.ancestors().take(missing + 1).find(|folder| self.disk.is_link(folder)) {
            return Err(OutputError::DeadLink { path: link.to_owned() });
        }
        self.disk.create_dir(path).map_err(OutputError::io("create", path))?;
        for folder in path.ancestors().take(missing + 1) {
            match self.disk.sync_dir(folder_of(folder)) {
                // Whoever may write into a folder may not always read it.
                Err(error) if error.kind() != io::ErrorKind::PermissionDenied => {
                    return Err(OutputError::io("create", path)(error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn holds_run(&self) -> bool {
        Manifest::read(self).is_ok_and(|manifest| manifest.is_ours())
    }

    /// What is in the folder, where a run may begin in it.
    fn contents(&self, overwrite: OverwritePolicy) -> Result<Contents, OutputError> {
        if !self.holds_run() {
            // What is left of a start that was interrupted before its manifest was complete is ours as well.
            return if self.holds_only_leftovers()? {
                Ok(Contents::Leftovers)
            } else {
                Err(OutputError::NotOurs { path: self.path.clone() })
            };
        }
        // One that was interrupted before its configuration was saved has nothing to lose.
        let holds_files = || {
            let names = self.entries(&self.path)?;
            Ok::<_, OutputError>(names.iter().any(|name| is_of_run(name)) || !self.has_no_fields()?)
        };
        if overwrite == OverwritePolicy::Keep && holds_files()? {
            return Err(OutputError::HoldsRun { path: self.path.clone() });
        }
        Ok(Contents::Run)
    }

    /// Removes what may be replaced.
    fn clear(&self, overwrite: OverwritePolicy) -> Result<(), OutputError> {
        if self.contents(overwrite)? == Contents::Leftovers {
            return self.remove_unfinished(&self.path);
        }
        let surfaces = Manifest::read(self).map(|manifest| manifest.surfaces).unwrap_or_default();
        self.remove_surfaces(&surfaces, &[])?;
        for name in FILES {
            self.remove(&self.path.join(name))?;
        }
        for name in self.entries(&self.path)?.iter().filter(|name| is_case(name)) {
            self.remove(&self.path.join(name))?;
        }
        self.remove_unfinished(&self.path)?;
        self.remove_fields(&[])
    }

    /// Removes the STL files that a manifest names, but for some.
    pub fn remove_surfaces(&self, named: &[String], kept: &[String]) -> Result<(), OutputError> {
        // The list is a file's content: only names that this program gives are taken from it.
        for name in named.iter().filter(|name| is_surface(name) && !kept.contains(name)) {
            self.remove(&self.path.join(name))?;
        }
        Ok(())
    }

    /// Removes what a killed process left half-written, and the fields of all evaluations but some.
    pub fn remove_leftovers(&self, kept: &[usize]) -> Result<(), OutputError> {
        self.remove_unfinished(&self.path)?;
        self.remove_fields(kept)
    }

    fn holds_only_leftovers(&self) -> Result<bool, OutputError> {
        for name in self.entries(&self.path)? {
            let leftover = name.starts_with(UNFINISHED) || (name == FIELDS && self.has_no_fields()?);
            if !leftover {
                return Ok(false);
            }
        }
        Ok(true)
    }

    pub(super) fn remove_unfinished(&self, folder: &Path) -> Result<(), OutputError> {
        self.check_place()?;
        remove_unfinished(&*self.disk, folder)
    }

    /// Names in a folder, sorted; none when there is no folder.
    pub(super) fn entries(&self, folder: &Path) -> Result<Vec<String>, OutputError> {
        names_in(&*self.disk, folder)
    }

    /// Removes a file of the run, if it is there.
    pub fn remove(&self, path: &Path) -> Result<(), OutputError> {
        self.check_place()?;
        remove(&*self.disk, path)
    }

    /// Writes a whole file of the run, replacing an older one: at any moment its place holds the one or the other.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
        self.check_place()?;
        write_whole(&*self.disk, path, bytes)
    }

    /// A new log of the run, in place of an older one.
    pub fn log(&self, path: &Path, start: &[u8]) -> Result<SyncedLog, OutputError> {
        self.check_place()?;
        SyncedLog::create(&*self.disk, path, start)
    }

    /// A log of the run, to be continued after its first `length` bytes.
    ///
    /// # Errors
    /// As [`SyncedLog::append`], and [`OutputError::InUse`].
    pub fn reopen(&self, path: &Path, length: u64) -> Result<SyncedLog, OutputError> {
        self.check_place()?;
        SyncedLog::reopen(&*self.disk, path, length)
    }

    /// The disk that the folder is on.
    pub fn disk(&self) -> &dyn Disk {
        &*self.disk
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

#[cfg(test)]
mod tests;

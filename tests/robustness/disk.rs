//! A disk in memory that distinguishes what has reached it from what has not, and fails on request.
//!
//! Content is durable once its file is synced, names once their folder is. A crash leaves what is durable, and of the rest
//! nothing, all, or a torn part: file systems promise no more.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use fluxmorph::files::{Disk, DiskFile, DiskLock, Sharing};

/// What happens at one operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The device reports an error; nothing is done.
    Eio,
    /// There is no space: this operation and all that need some fail. A write gets half of its bytes in before.
    Enospc,
    /// A write takes half of its bytes, without an error.
    ShortWrite,
    /// The power fails before it, and nothing is left of what was not synced.
    CrashLosing,
    /// The power fails before it, and all was on the disk by chance.
    CrashKeeping,
    /// The power fails amid it: names are kept, and half of what was not synced.
    CrashTearing,
}

impl Fault {
    pub(crate) const ALL: [Self; 6] = [
        Self::Eio,
        Self::Enospc,
        Self::ShortWrite,
        Self::CrashLosing,
        Self::CrashKeeping,
        Self::CrashTearing,
    ];

    pub(crate) fn is_crash(self) -> bool {
        matches!(self, Self::CrashLosing | Self::CrashKeeping | Self::CrashTearing)
    }
}

#[derive(Clone, Debug, Default)]
struct Content {
    now: Vec<u8>,
    durable: Vec<u8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Node {
    Folder,
    File(usize),
}

/// Whether the machine is on, and whether the disk is full.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Condition {
    #[default]
    Sound,
    Full,
    Off,
}

#[derive(Clone, Debug, Default)]
struct State {
    files: Vec<Content>,
    names: BTreeMap<PathBuf, Node>,
    durable_names: BTreeMap<PathBuf, Node>,
    /// Operations so far, of those that change something.
    operations: Vec<&'static str>,
    fault: Option<(usize, Fault)>,
    condition: Condition,
}

/// The disk.
#[derive(Clone, Debug, Default)]
pub(crate) struct SimulatedDisk(Arc<Mutex<State>>);

impl SimulatedDisk {
    pub(crate) fn shared(&self) -> Arc<dyn Disk> {
        Arc::new(self.clone())
    }

    /// A copy with its own state, and operations counted anew.
    pub(crate) fn copy(&self) -> Self {
        let state = State { operations: Vec::new(), fault: None, ..self.state().clone() };
        Self(Arc::new(Mutex::new(state)))
    }

    /// Fails at an operation, counted from now.
    pub(crate) fn fail_at(&self, operation: usize, fault: Fault) {
        let mut state = self.state();
        state.operations.clear();
        state.fault = Some((operation, fault));
    }

    /// The names of the operations since the last fault was set.
    pub(crate) fn operations(&self) -> Vec<&'static str> {
        self.state().operations.clone()
    }

    /// The machine is on again, and there is space.
    pub(crate) fn mend(&self) {
        let mut state = self.state();
        (state.condition, state.fault) = (Condition::Sound, None);
    }

    /// All files by their path in a folder.
    pub(crate) fn files(&self, folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let state = self.state();
        let in_folder = |(path, node): (&PathBuf, &Node)| match node {
            Node::File(id) => {
                Some((path.strip_prefix(folder).ok()?.to_owned(), state.files[*id].now.clone()))
            }
            Node::Folder => None,
        };
        state.names.iter().filter_map(in_folder).collect()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

fn crashed() -> io::Error {
    io::Error::other("the machine is off")
}

impl State {
    /// Counts an operation, and fails if it is its turn; `Some` is a write that shall be short.
    fn operate(&mut self, name: &'static str) -> io::Result<Option<Fault>> {
        if self.condition == Condition::Off {
            return Err(crashed());
        }
        let number = self.operations.len();
        self.operations.push(name);
        let needs_space = matches!(name, "create_dir" | "create" | "write" | "sync");
        match self.fault {
            Some((at, fault)) if at == number => match fault {
                Fault::Eio => Err(io::Error::from_raw_os_error(5)),
                Fault::Enospc => {
                    self.condition = Condition::Full;
                    if name == "write" { Ok(Some(fault)) } else { Err(io::ErrorKind::StorageFull.into()) }
                }
                Fault::ShortWrite => Ok(Some(fault)),
                Fault::CrashTearing if name == "write" => Ok(Some(fault)),
                Fault::CrashLosing | Fault::CrashKeeping | Fault::CrashTearing => {
                    self.crash(fault);
                    Err(crashed())
                }
            },
            _ if self.condition == Condition::Full && needs_space => Err(io::ErrorKind::StorageFull.into()),
            _ => Ok(None),
        }
    }

    /// The power fails: what is left is durable.
    fn crash(&mut self, fault: Fault) {
        if fault == Fault::CrashLosing {
            // What has no durable way that leads to it is lost as well.
            let durable = &self.durable_names;
            let is_reached = |path: &PathBuf| {
                let mut above = path.ancestors().skip(1).filter(|folder| folder.parent().is_some());
                above.all(|folder| durable.get(folder) == Some(&Node::Folder))
            };
            self.names =
                durable.iter().filter(|(path, _)| is_reached(path)).map(|(p, n)| (p.clone(), *n)).collect();
        }
        for content in &mut self.files {
            match fault {
                Fault::CrashLosing => content.now.clone_from(&content.durable),
                Fault::CrashTearing if content.now.starts_with(&content.durable) => {
                    let half = content.durable.len().midpoint(content.now.len());
                    content.now.truncate(half);
                }
                _ => {}
            }
            content.durable.clone_from(&content.now);
        }
        self.durable_names.clone_from(&self.names);
        self.condition = Condition::Off;
    }

    fn file(&self, path: &Path) -> io::Result<usize> {
        match self.names.get(path) {
            Some(Node::File(id)) => Ok(*id),
            Some(Node::Folder) => Err(io::ErrorKind::IsADirectory.into()),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

impl Disk for SimulatedDisk {
    fn create_dir(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.operate("create_dir")?;
        for folder in path.ancestors() {
            state.names.entry(folder.to_owned()).or_insert(Node::Folder);
        }
        Ok(())
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        let mut state = self.state();
        state.operate("create")?;
        let has_folder = path.parent().is_some_and(|folder| state.names.get(folder) == Some(&Node::Folder));
        if !has_folder {
            return Err(io::ErrorKind::NotFound.into());
        }
        if state.names.contains_key(path) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let id = state.files.len();
        state.files.push(Content::default());
        state.names.insert(path.to_owned(), Node::File(id));
        Ok(Box::new(SimulatedFile { disk: self.clone(), id }))
    }

    fn append(&self, path: &Path, length: u64) -> io::Result<Box<dyn DiskFile>> {
        let mut state = self.state();
        state.operate("append")?;
        let id = state.file(path)?;
        state.files[id].now.truncate(length as usize);
        Ok(Box::new(SimulatedFile { disk: self.clone(), id }))
    }

    fn lock(&self, _: &Path, _: Sharing) -> io::Result<Option<Box<dyn DiskLock>>> {
        Ok(None)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.operate("rename")?;
        let id = state.file(from)?;
        state.names.remove(from);
        state.names.insert(to.to_owned(), Node::File(id));
        Ok(())
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.operate("remove")?;
        state.file(path)?;
        state.names.remove(path);
        Ok(())
    }

    fn remove_dir(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.operate("remove_dir")?;
        match state.names.get(path) {
            Some(Node::Folder) if state.names.keys().any(|name| name.parent() == Some(path)) => {
                Err(io::ErrorKind::DirectoryNotEmpty.into())
            }
            Some(Node::Folder) => {
                state.names.remove(path);
                Ok(())
            }
            Some(Node::File(_)) => Err(io::ErrorKind::NotADirectory.into()),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.operate("sync_dir")?;
        let own = |name: &PathBuf| name.parent() == Some(path);
        let now: Vec<_> = state
            .names
            .iter()
            .filter(|(name, _)| own(name))
            .map(|(name, node)| (name.clone(), *node))
            .collect();
        state.durable_names.retain(|name, _| !own(name));
        state.durable_names.extend(now);
        Ok(())
    }

    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        let state = self.state();
        if state.condition == Condition::Off {
            return Err(crashed());
        }
        let id = state.file(path)?;
        let bytes = state.files[id].now.clone();
        if bytes.len() as u64 > most { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
    }

    fn names(&self, path: &Path) -> io::Result<Vec<String>> {
        let state = self.state();
        if state.condition == Condition::Off {
            return Err(crashed());
        }
        match state.names.get(path) {
            Some(Node::Folder) => {}
            Some(Node::File(_)) => return Err(io::ErrorKind::NotADirectory.into()),
            None => return Err(io::ErrorKind::NotFound.into()),
        }
        let name = |name: &PathBuf| name.file_name().map(|name| name.to_string_lossy().into_owned());
        Ok(state.names.keys().filter(|name| name.parent() == Some(path)).filter_map(name).collect())
    }

    fn is_link(&self, _: &Path) -> bool {
        false
    }
}

#[derive(Debug)]
struct SimulatedFile {
    disk: SimulatedDisk,
    id: usize,
}

impl Write for SimulatedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut state = self.disk.state();
        let taken = match state.operate("write")? {
            Some(_) => bytes.len() / 2,
            None => bytes.len(),
        };
        state.files[self.id].now.extend(&bytes[..taken]);
        match state.fault {
            Some((at, Fault::CrashTearing)) if at + 1 == state.operations.len() => {
                state.crash(Fault::CrashKeeping);
                Err(crashed())
            }
            // A write of nothing would be taken for the end of the disk.
            _ if taken == 0 && !bytes.is_empty() => {
                state.files[self.id].now.extend(&bytes[..1]);
                Ok(1)
            }
            _ => Ok(taken),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl DiskFile for SimulatedFile {
    fn sync(&mut self) -> io::Result<()> {
        let mut state = self.disk.state();
        state.operate("sync")?;
        let content = &mut state.files[self.id];
        content.durable.clone_from(&content.now);
        Ok(())
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        let mut state = self.disk.state();
        state.operate("cut")?;
        state.files[self.id].now.truncate(length as usize);
        Ok(())
    }
}

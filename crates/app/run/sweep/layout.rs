//! The directory of a sweep, and `sweep.json`, which says what is in it.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Planned, Setting, Sweep, SweepError};
use crate::error::Error;
use crate::files::{
    Disk, DiskLock, FileHash, LOCK, OutputError, OverwritePolicy, Sharing, UNFINISHED, check_place,
    read_json, remove_unfinished, shell_word, to_json, write_whole,
};

/// The mark by which a directory is known as ours.
const PROGRAM: &str = "fluxmorph";
const FILE: &str = "sweep.json";
const LOGS: &str = "logs";

/// Largest `sweep.json` that is read [bytes]: ten thousand combinations with long values.
const LARGEST: u64 = 1 << 28;

/// The directory of a sweep.
#[derive(Clone, Debug)]
pub struct Layout {
    disk: Arc<dyn Disk>,
    path: PathBuf,
    /// Keeps other sweeps out while it lives.
    lock: Option<Arc<dyn DiskLock>>,
}

/// The content of `sweep.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Description {
    program: String,
    schema_version: u32,
    /// Version of the program.
    version: String,
    config: FileHash,
    /// The keys with their values as typed.
    settings: Vec<Setting>,
    combinations: Vec<Described>,
}

/// A combination in `sweep.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Described {
    index: usize,
    /// The run directory, relative to that of the sweep.
    directory: String,
    /// The values of the swept keys.
    values: serde_json::Map<String, serde_json::Value>,
    /// The command that begins it.
    command: String,
}

/// What is done with a combination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// It is begun; what is in its directory is kept or replaced.
    Begin(OverwritePolicy),
    /// It is resumed.
    Resume,
}

impl Layout {
    /// Makes the directory ready for a sweep, and writes `sweep.json`.
    ///
    /// # Errors
    /// [`SweepError::NotASweep`], [`SweepError::OtherSweep`], or when the operating system refuses.
    pub fn create(disk: &Arc<dyn Disk>, sweep: &Sweep) -> Result<Self, Error> {
        let mut layout = Self { disk: Arc::clone(disk), path: sweep.directory.clone(), lock: None };
        layout.check_free(sweep)?;
        disk.create_dir(&layout.path).map_err(OutputError::io("create", &layout.path))?;
        layout.acquire(Sharing::Exclusive)?;
        // Another process may have come and gone between the look and the lock.
        layout.check_free(sweep)?;
        remove_unfinished(&**disk, &layout.path)?;
        let logs = layout.path.join(LOGS);
        if disk.is_link(&logs) {
            return Err(OutputError::Linked { path: logs }.into());
        }
        disk.create_dir(&logs).map_err(OutputError::io("create", &logs))?;
        layout.write(FILE, &to_json(&Description::of(sweep)))?;
        Ok(layout)
    }

    /// Keeps other processes out: all of them, or those that want the whole sweep.
    ///
    /// # Errors
    /// [`OutputError::InUse`].
    pub fn acquire(&mut self, sharing: Sharing) -> Result<(), OutputError> {
        let locked = self.disk.lock(&self.path.join(LOCK), sharing);
        self.lock = locked.map_err(OutputError::io("lock", &self.path))?.map(Arc::from);
        Ok(())
    }

    /// Whether the folder is absent, or free for this sweep.
    fn check_free(&self, sweep: &Sweep) -> Result<(), Error> {
        match self.description() {
            Ok(earlier) if sweep.overwrite == OverwritePolicy::Keep => {
                self.check_continues(&earlier, sweep)?
            }
            Ok(_) => {}
            Err(OutputError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
                self.is_free()?;
            }
            Err(OutputError::Io { source, .. }) if source.kind() == io::ErrorKind::NotADirectory => {
                return Err(OutputError::NotADirectory { path: self.path.clone() }.into());
            }
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    /// The directory of a sweep that was laid out by the same command; nothing is written.
    ///
    /// # Errors
    /// [`SweepError::NotLaidOut`].
    pub fn open(disk: &Arc<dyn Disk>, sweep: &Sweep) -> Result<Self, SweepError> {
        let layout = Self { disk: Arc::clone(disk), path: sweep.directory.clone(), lock: None };
        let refused =
            |cause: &str| Err(SweepError::NotLaidOut { path: layout.path.clone(), cause: cause.to_owned() });
        match layout.description() {
            Err(error) => refused(&error.to_string()),
            Ok(known) if known.config.blake3 != sweep.config.blake3 => {
                refused(&format!("`{}` has changed since", known.config.path))
            }
            Ok(known) if known.settings != sweep.settings => refused("its keys or values are others"),
            Ok(_) => Ok(layout),
        }
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The disk that it is on.
    pub fn disk(&self) -> &Arc<dyn Disk> {
        &self.disk
    }

    /// What the process of a combination says.
    pub fn log(&self, planned: &Planned) -> PathBuf {
        self.path.join(self.log_name(planned))
    }

    /// The same, relative to the sweep.
    pub fn log_name(&self, planned: &Planned) -> String {
        format!("{LOGS}/{}.log", planned.combination.name)
    }

    /// Writes a whole file of the sweep, replacing an older one.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), OutputError> {
        check_place(self.lock.as_deref(), &self.path)?;
        write_whole(&*self.disk, &self.path.join(name), bytes)
    }

    fn description(&self) -> Result<Description, OutputError> {
        let path = self.path.join(FILE);
        let read: Description = read_json(&*self.disk, &path, LARGEST)?;
        if read.program == PROGRAM {
            return Ok(read);
        }
        let cause = format!("it is of the program `{}`", read.program.escape_debug());
        Err(OutputError::damaged(path)(cause))
    }

    /// Whether there is nothing of others in the folder.
    fn is_free(&self) -> Result<(), Error> {
        let unfinished = |name: &String| name.starts_with(UNFINISHED) || name == LOGS;
        match self.disk.names(&self.path) {
            Ok(names) if names.iter().all(unfinished) => Ok(()),
            Ok(_) => Err(SweepError::NotASweep { path: self.path.clone() }.into()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(error) => Err(OutputError::io("read", &self.path)(error).into()),
        }
    }

    /// Whether a sweep is an earlier one with the same or more values.
    fn check_continues(&self, earlier: &Description, sweep: &Sweep) -> Result<(), SweepError> {
        let refused = |cause: String| Err(SweepError::OtherSweep { path: self.path.clone(), cause });
        let keys = |settings: &[Setting]| -> Vec<String> {
            settings.iter().filter(|s| s.is_swept()).map(|s| format!("`{}`", s.key)).collect()
        };
        let (before, now) = (keys(&earlier.settings), keys(&sweep.settings));
        if before != now {
            let listed =
                |keys: Vec<String>| if keys.is_empty() { "nothing".to_owned() } else { keys.join(", ") };
            return refused(format!("it sweeps {}, this one {}", listed(before), listed(now)));
        }
        let names: std::collections::BTreeSet<&str> =
            sweep.combinations.iter().map(|planned| planned.combination.name.as_str()).collect();
        match earlier.combinations.iter().find(|known| !names.contains(known.directory.as_str())) {
            Some(missing) => refused(format!("its combination `{}` is not among these", missing.directory)),
            None => Ok(()),
        }
    }
}

impl Description {
    fn of(sweep: &Sweep) -> Self {
        let described = |(index, planned): (usize, &Planned)| {
            let values = sweep.swept().zip(&planned.combination.values);
            Described {
                index,
                directory: planned.combination.name.clone(),
                values: values.map(|(setting, value)| (setting.key.clone(), value.clone().into())).collect(),
                command: command_text(&sweep.arguments(planned, Task::Begin(OverwritePolicy::Keep))),
            }
        };
        Self {
            program: PROGRAM.to_owned(),
            schema_version: 1,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            config: sweep.config.clone(),
            settings: sweep.settings.clone(),
            combinations: sweep.combinations.iter().enumerate().map(described).collect(),
        }
    }
}

impl Sweep {
    /// The arguments of the command that runs or resumes a combination.
    pub fn arguments(&self, planned: &Planned, task: Task) -> Vec<String> {
        let directory = self.run_directory(planned).display().to_string();
        let mut arguments = Vec::new();
        let mut add = |words: &[&str]| arguments.extend(words.iter().map(|word| (*word).to_owned()));
        // A resumed run remembers the limits it had; those of now hold.
        let (evaluations, time) = match task {
            Task::Begin(_) => {
                add(&["run", &self.config.path, "--out", &directory]);
                planned.combination.overrides.iter().for_each(|pair| add(&["--set", pair]));
                (self.limits.max_evaluations, self.limits.max_time)
            }
            Task::Resume => {
                add(&["resume", &directory]);
                (Some(planned.limits.max_evaluations), planned.limits.max_time_s)
            }
        };
        arguments.extend(self.shared_arguments(evaluations, time));
        if self.overwrite == OverwritePolicy::Replace || task == Task::Begin(OverwritePolicy::Replace) {
            arguments.push("--force".to_owned());
        }
        arguments
    }

    /// Limits, and whether files may lie elsewhere.
    pub(super) fn shared_arguments(&self, evaluations: Option<usize>, seconds: Option<f64>) -> Vec<String> {
        let evaluations = evaluations.map(|count| ["--max-evaluations".to_owned(), count.to_string()]);
        let seconds = seconds.map(|seconds| ["--max-time".to_owned(), seconds.to_string()]);
        let outside = (self.outside == super::Outside::Allowed).then(|| "--allow-outside".to_owned());
        evaluations.into_iter().chain(seconds).flatten().chain(outside).collect()
    }
}

/// A command of this program as a shell takes it.
pub(super) fn command_text(arguments: &[String]) -> String {
    let word = |word: &String| match word.strip_prefix("--") {
        // An option is no path that begins with a dash.
        Some(_) => word.clone(),
        None => shell_word(Path::new(word)),
    };
    format!("{PROGRAM} {}", arguments.iter().map(word).collect::<Vec<_>>().join(" "))
}

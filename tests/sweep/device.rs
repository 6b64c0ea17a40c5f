//! A small device with its configuration in a folder, and the program as a process.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

use crate::essence::{Essence, essence};

/// Far longer than any of these sweeps takes, on any machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// The block of the simulated disk, with few files.
const BLOCK: &str = include_str!("../durability/block.toml");

/// A temporary folder with `block.toml`.
pub(crate) struct Home {
    folder: TempDir,
}

/// How a sweep ended, and what it said on standard error.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) said: String,
    pub(crate) printed: String,
}

impl Ended {
    /// Asserts the exit code and what was said.
    #[track_caller]
    pub(crate) fn with(self, code: i32, fragments: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{}", self.said);
        for fragment in fragments {
            assert!(self.said.contains(fragment), "no `{fragment}` in:\n{}", self.said);
        }
        self
    }

    /// How many lines of progress say something.
    pub(crate) fn count(&self, what: &str) -> usize {
        self.said.lines().filter(|line| line.contains(what)).count()
    }
}

impl Home {
    /// The quick block, with a report left out where it is not looked at.
    pub(crate) fn new() -> Self {
        Self::with(&[])
    }

    /// The block with texts of its configuration replaced.
    pub(crate) fn with(changes: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut text = BLOCK.to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, 1);
        }
        std::fs::write(folder.path().join("block.toml"), text).expect("written");
        Self { folder }
    }

    /// The block on so many elements that a signal finds it at work.
    pub(crate) fn slower() -> Self {
        let cells = ["cells = [1, 1, 1]", "cells = [2, 2, 1]", "cells = [2, 2, 1]"];
        let finer = ["cells = [3, 3, 3]", "cells = [6, 6, 3]", "cells = [6, 6, 3]"];
        let changes: Vec<_> = cells.into_iter().zip(finer).collect();
        Self::with(&changes)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `fluxmorph ARGUMENTS` in the folder.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_fluxmorph"));
        command.args(arguments).current_dir(self.folder.path()).stdin(Stdio::null());
        command.env("NO_COLOR", "1").stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// `fluxmorph sweep block.toml --out OUT ARGUMENTS`, to its end.
    pub(crate) fn sweep(&self, out: &str, arguments: &[&str]) -> Ended {
        ended(&mut self.command(&[&["sweep", "block.toml", "--out", out], arguments].concat()))
    }

    /// The files of one run, without what depends on the clock.
    pub(crate) fn essence(&self, run: &str) -> Essence {
        essence(&files(&self.path(run)))
    }

    /// A JSON file.
    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.path(name)).expect(name)).expect("JSON")
    }

    pub(crate) fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect(name)
    }

    /// Names of the run directories of a sweep.
    pub(crate) fn runs(&self, out: &str) -> Vec<String> {
        let entries =
            std::fs::read_dir(self.path(out)).expect("a folder").map(|entry| entry.expect("an entry"));
        let folders = entries.filter(|entry| entry.path().join("manifest.json").is_file());
        let mut names: Vec<String> =
            folders.map(|entry| entry.file_name().to_str().expect("UTF-8").to_owned()).collect();
        names.sort();
        names
    }

    /// Rows in the history of a run.
    pub(crate) fn rows(&self, run: &str) -> usize {
        let text = std::fs::read_to_string(self.path(run).join("history.csv")).unwrap_or_default();
        text.lines().count().saturating_sub(1)
    }
}

/// Lets a command come to its end.
pub(crate) fn ended(command: &mut Command) -> Ended {
    let output = command.output().expect("the program starts");
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    Ended { code: output.status.code(), said: text(&output.stderr), printed: text(&output.stdout) }
}

/// Waits until a condition holds.
#[track_caller]
pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "{what} did not come");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Sends a signal by its name to processes, of which some may have ended.
pub(crate) fn send(signal: &str, processes: &[u32]) {
    for id in processes {
        let _ = Command::new("kill").args(["-s", signal, &id.to_string()]).stderr(Stdio::null()).status();
    }
}

/// The processes that another has started.
pub(crate) fn children_of(parent: &Child) -> Vec<u32> {
    let stat = |id: u32| std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    let ids = std::fs::read_dir("/proc")
        .expect("Linux")
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    // Behind the name in brackets: the state, then the parent.
    let is_child = |id: &u32| {
        let text = stat(*id);
        let parent_of = text.rsplit_once(')').and_then(|(_, rest)| rest.split_whitespace().nth(1));
        parent_of == Some(parent.id().to_string().as_str())
    };
    ids.filter(is_child).collect()
}

/// The files below a folder.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below it").to_owned();
                found.insert(name, std::fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

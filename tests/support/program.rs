//! The program as a process: how it is started, how it ended and what it said, and signals to it.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

use super::folder::LOCK;

/// Far longer than anything here takes, on any machine under any load: only what hangs is ended by it.
pub(crate) const PATIENCE: Duration = Duration::from_secs(600);

/// The record of a run's evaluations.
pub(crate) const JOURNAL: &str = "journal.jsonl";

/// How a command ended, and what it wrote.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Finished {
    /// Asserts the exit code; a failure shows all that was written.
    #[track_caller]
    pub(crate) fn exits_with(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        self
    }

    /// Asserts that standard error holds every fragment.
    #[track_caller]
    pub(crate) fn says(self, fragments: &[&str]) -> Self {
        for fragment in fragments {
            assert!(self.stderr.contains(fragment), "no `{fragment}` in:\n{}", self.stderr);
        }
        self
    }

    /// Asserts the exit code and what standard error holds.
    #[track_caller]
    pub(crate) fn with(self, code: i32, fragments: &[&str]) -> Self {
        self.exits_with(code).says(fragments)
    }

    /// Asserts that it came to the end of its work: converged, done, or at a limit.
    #[track_caller]
    pub(crate) fn completed(self) -> Self {
        assert!(matches!(self.code, Some(0 | 1)), "{:?}:\n{}", self.code, self.stderr);
        self
    }

    /// Standard output as the one JSON value that it must be.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}:\n{}", self.stdout))
    }

    /// How many lines of standard error hold a text.
    pub(crate) fn count(&self, what: &str) -> usize {
        self.stderr.lines().filter(|line| line.contains(what)).count()
    }
}

/// A temporary directory of one test.
pub(crate) fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// The binary, ready for arguments, without what the surroundings of the test may set.
pub(crate) fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fluxmorph"));
    for name in ["NO_COLOR", "RUST_BACKTRACE", "CLICOLOR_FORCE", "TERM"] {
        command.env_remove(name);
    }
    command.stdin(Stdio::null());
    command
}

/// The binary with arguments of any kind.
pub(crate) fn command(arguments: &[&dyn AsRef<OsStr>]) -> Command {
    let mut command = program();
    command.args(arguments);
    command
}

/// Runs the binary to its end.
pub(crate) fn fluxmorph(arguments: &[&dyn AsRef<OsStr>]) -> Finished {
    finish(&mut command(arguments))
}

/// Runs the binary in a folder to its end.
pub(crate) fn fluxmorph_in(folder: &Path, arguments: &[impl AsRef<OsStr>]) -> Finished {
    finish(program().current_dir(folder).args(arguments))
}

/// `fluxmorph resume DIR`, of which only the messages are read.
pub(crate) fn resume(directory: &Path) -> Command {
    let mut command = command(&[&"resume", &directory]);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Runs a prepared command to its end.
pub(crate) fn finish(command: &mut Command) -> Finished {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let text = |bytes| String::from_utf8(bytes).expect("what is written is UTF-8");
    Finished { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
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

/// The end of a process that was started before.
#[track_caller]
pub(crate) fn end_of(child: &mut Child) -> ExitStatus {
    let mut status = None;
    wait_until("the end of the process", || {
        status = child.try_wait().expect("a child of this process");
        status.is_some()
    });
    status.expect("it has ended")
}

/// Sends a signal by its name to a process of this test that has not been waited for.
#[track_caller]
pub(crate) fn send(signal: &str, process: u32) {
    let status = Command::new("kill").args(["-s", signal, &process.to_string()]).status();
    assert!(status.expect("kill is there").success());
}

/// Waits until nobody writes a run any more: a process keeps its lock until the system has cleared it away.
#[track_caller]
pub(crate) fn wait_for_lock(directory: &Path) {
    for name in [LOCK, JOURNAL] {
        let file =
            std::fs::OpenOptions::new().write(true).open(directory.join(name)).expect("a file of a run");
        wait_until("the lock of the run", || file.try_lock().is_ok());
    }
}

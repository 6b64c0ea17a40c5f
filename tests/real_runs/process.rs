//! The program as a process.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Far longer than any of these runs takes, on any machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// How a process ended, and what it said on standard error.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) said: String,
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

    /// Asserts that it came to the end of its work: converged, done, or at a limit.
    #[track_caller]
    pub(crate) fn completed(self) -> Self {
        assert!(matches!(self.code, Some(0 | 1)), "{:?}:\n{}", self.code, self.said);
        self
    }
}

/// The program, ready for further arguments.
pub(crate) fn fluxmorph(arguments: &[&dyn AsRef<OsStr>]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fluxmorph"));
    command.args(arguments.iter().map(|argument| argument.as_ref())).stdin(Stdio::null());
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// `fluxmorph resume DIR`.
pub(crate) fn resume(directory: &Path) -> Command {
    fluxmorph(&[&"resume", &directory])
}

/// Lets a command come to its end.
pub(crate) fn ended(command: &mut Command) -> Ended {
    let output = command.output().expect("the program starts");
    Ended { code: output.status.code(), said: String::from_utf8_lossy(&output.stderr).into_owned() }
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

/// Sends a signal by its name.
#[track_caller]
pub(crate) fn send(signal: &str, child: &Child) {
    let status = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status();
    assert!(status.expect("kill is there").success());
}

/// Rows of the history.
pub(crate) fn rows(directory: &Path) -> usize {
    let text = std::fs::read_to_string(directory.join("history.csv")).unwrap_or_default();
    text.lines().count().saturating_sub(1)
}

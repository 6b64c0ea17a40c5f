//! Runs the binary and keeps what it said.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Stdio};

/// How a command ended, and what it wrote.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// The binary in a folder, ready for arguments, without what the surroundings of the test may set.
pub(crate) fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fluxmorph"));
    command.current_dir(folder).stdin(Stdio::null());
    for name in ["NO_COLOR", "RUST_BACKTRACE", "CLICOLOR_FORCE", "TERM"] {
        command.env_remove(name);
    }
    command
}

/// Runs a command to its end.
pub(crate) fn finish(mut command: Command) -> Finished {
    let output = command.output().expect("it starts");
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    Finished { code: output.status.code(), stdout: text(&output.stdout), stderr: text(&output.stderr) }
}

/// Runs the binary in a folder.
pub(crate) fn fluxmorph(folder: &Path, arguments: &[impl AsRef<OsStr>]) -> Finished {
    let mut command = program(folder);
    command.args(arguments);
    finish(command)
}

/// A temporary folder with the tiny configurations of the cases.
pub(crate) fn tiny() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/cases/run.in");
    for name in ["tiny.toml", "motion.toml"] {
        std::fs::copy(cases.join(name), folder.path().join(name)).expect("copied");
    }
    folder
}

//! The program, and small runs to report of.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A quick block, with its objective, design and one coil-free field.
pub(crate) const BLOCK: &str = include_str!("../durability/block.toml");

/// How a command ended, and what it said on standard error.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) said: String,
}

impl Ended {
    #[track_caller]
    pub(crate) fn with(self, code: i32, fragments: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{}", self.said);
        for fragment in fragments {
            assert!(self.said.contains(fragment), "no `{fragment}` in:\n{}", self.said);
        }
        self
    }
}

/// Runs the program to its end.
pub(crate) fn fluxmorph(arguments: &[&dyn AsRef<OsStr>]) -> Ended {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fluxmorph"));
    command.args(arguments.iter().map(|a| a.as_ref())).stdin(Stdio::null());
    let output = command.output().expect("the program starts");
    Ended { code: output.status.code(), said: String::from_utf8_lossy(&output.stderr).into_owned() }
}

/// A file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A run of the quick shield, which ends at its limit of evaluations.
pub(crate) fn shield(out: &Path, further: &[&str]) {
    let config = repository("configs/shield_quick.toml");
    let mut arguments: Vec<&dyn AsRef<OsStr>> = vec![&"run", &config, &"--out", &out, &"--quiet"];
    further.iter().for_each(|argument| arguments.push(argument));
    fluxmorph(&arguments).with(1, &[]);
}

/// A run of the block with texts of its configuration replaced.
pub(crate) fn block(command: &str, folder: &Path, changes: &[(&str, &str)]) -> PathBuf {
    let mut text = BLOCK.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let config = folder.join("block.toml");
    std::fs::write(&config, text).expect("written");
    let out = folder.join("out");
    let code = if command == "run" { 1 } else { 0 };
    fluxmorph(&[&command, &config, &"--out", &out, &"--quiet"]).with(code, &[]);
    out
}

/// The page of a run directory, made now.
#[track_caller]
pub(crate) fn report(directory: &Path) -> String {
    fluxmorph(&[&"report", &directory]).with(0, &["report.html"]);
    std::fs::read_to_string(directory.join("report.html")).expect("the page")
}

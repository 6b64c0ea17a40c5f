//! A folder with the configuration of a small device, in which sweeps run.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;

use crate::support::changed;
use crate::support::device::BLOCK;
use crate::support::essence::{Essence, essence};
use crate::support::folder::{files, read_json, read_text, rows};
use crate::support::program::{Finished, finish, folder, program};

/// A temporary folder with `block.toml`.
pub(crate) struct Home {
    folder: TempDir,
}

impl Home {
    /// The block.
    pub(crate) fn new() -> Self {
        Self::with(&[])
    }

    /// The block with texts of its configuration replaced.
    pub(crate) fn with(changes: &[(&str, &str)]) -> Self {
        let home = Self { folder: folder() };
        home.write("block.toml", &changed(BLOCK, changes));
        home
    }

    /// The block of iron that saturates by `iron.csv`, at rest.
    pub(crate) fn on_a_curve() -> Self {
        let linear = "relative_permeability = 100\nconductivity = \"1e6 S/m\"";
        let home = Self::with(&[("\"50 Hz\"", "0"), (linear, "bh_file = \"iron.csv\"")]);
        home.write("iron.csv", "100, 0.5\n1000, 1.5\n100000, 2.2\n");
        home
    }

    /// The block on so many elements that a run has some hundred evaluations, and a second of them is a dozen.
    pub(crate) fn slower() -> Self {
        let finer = ("cells = [2, 2, 1]", "cells = [6, 6, 3]");
        Self::with(&[("cells = [1, 1, 1]", "cells = [3, 3, 3]"), finer, finer])
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `fluxmorph ARGUMENTS` in the folder.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = program();
        command.args(arguments).current_dir(self.folder.path());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// `fluxmorph ARGUMENTS` in the folder, to its end.
    pub(crate) fn fluxmorph(&self, arguments: &[&str]) -> Finished {
        finish(&mut self.command(arguments))
    }

    /// `fluxmorph sweep block.toml --out OUT ARGUMENTS`, to its end.
    pub(crate) fn sweep(&self, out: &str, arguments: &[&str]) -> Finished {
        self.fluxmorph(&[&["sweep", "block.toml", "--out", out], arguments].concat())
    }

    /// The files of one run, without what depends on the clock.
    pub(crate) fn essence(&self, run: &str) -> Essence {
        essence(&files(&self.path(run)))
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        read_json(&self.path(name))
    }

    pub(crate) fn text(&self, name: &str) -> String {
        read_text(&self.path(name))
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    /// Replaces a text in a file that must hold it.
    pub(crate) fn edit(&self, name: &str, from: &str, to: &str) {
        self.write(name, &changed(&self.text(name), &[(from, to)]));
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
        rows(&self.path(run))
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

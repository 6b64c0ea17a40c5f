//! Small devices as files of configuration, with what an undisturbed run of them leaves.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use crate::essence::{Essence, essence};
use crate::process::{ended, fluxmorph};

/// The block of the simulated disk.
const BLOCK: &str = include_str!("../durability/block.toml");

/// What is run.
#[derive(Clone, Debug)]
pub(crate) struct Device {
    pub(crate) name: &'static str,
    pub(crate) config: PathBuf,
    further: Vec<String>,
}

/// The block with some texts replaced, written into a folder.
fn written(name: &'static str, folder: &Path, changes: &[(&str, &str)]) -> Device {
    let mut text = BLOCK.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let config = folder.join(format!("{name}.toml"));
    std::fs::write(&config, text).expect("written");
    Device { name, config, further: Vec::new() }
}

const CONSTRAINT: (&str, &str) =
    ("[design]", "[[constraints]]\nkind = \"volume\"\nregion = \"iron\"\nupper_ratio = 1.02\n\n[design]");

/// The block with a constraint and steps so cautious that the mesh has several references.
pub(crate) fn block(folder: &Path, evaluations: usize) -> Device {
    written(
        "block",
        folder,
        &[
            CONSTRAINT,
            ("slide = [", "rounds = 4\ninversion_share = 0.1\nslide = ["),
            ("max_evaluations = 6", &format!("max_evaluations = {evaluations}")),
        ],
    )
}

/// A run that would go on for hours.
pub(crate) fn endless() -> Device {
    let further = ["--set", "optimizer.max_evaluations=1000000", "--set", "optimizer.ftol_rel=0"];
    shipped("shield_quick", &further)
}

/// The block on elements so small that an evaluation takes about a second.
pub(crate) fn slow(folder: &Path) -> Device {
    let changes = [
        ("cells = [1, 1, 1]", "cells = [6, 6, 6]"),
        ("cells = [2, 2, 1]", "cells = [10, 10, 6]"),
        ("cells = [2, 2, 1]", "cells = [10, 10, 6]"),
        ("max_evaluations = 6", "max_evaluations = 1000"),
    ];
    written("slow", folder, &changes)
}

/// A shipped configuration.
pub(crate) fn shipped(name: &'static str, further: &[&str]) -> Device {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("configs/{name}.toml"));
    Device { name, config, further: further.iter().map(|item| (*item).to_owned()).collect() }
}

impl Device {
    /// The same with a key of the configuration set.
    pub(crate) fn with(mut self, item: &str) -> Self {
        self.further.extend(["--set".to_owned(), item.to_owned()]);
        self
    }

    /// A command on it that writes into a directory.
    pub(crate) fn command(&self, name: &str, out: &Path) -> Command {
        let mut command = fluxmorph(&[&name, &self.config, &"--out", &out]);
        command.args(&self.further);
        command
    }

    /// What a run that nothing disturbs leaves, and how long it took.
    pub(crate) fn undisturbed(&self, folder: &Path) -> (Essence, Duration) {
        let out = folder.join("undisturbed");
        let clock = Instant::now();
        ended(&mut self.command("run", &out)).completed();
        (essence(&files(&out)), clock.elapsed())
    }
}

/// The files of a folder.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
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

//! Small devices as files of configuration, and what an undisturbed run of them leaves.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::essence::{Essence, essence};
use super::folder::files;
use super::program::{command, finish};
use super::{changed, repository};

/// An iron block over a gap in a uniform field, whose lower face moves: a run takes milliseconds.
pub(crate) const BLOCK: &str = include_str!("block.toml");

/// Two circular coils over a plate.
pub(crate) const COILS: &str = include_str!("coils.toml");

/// A bound on the volume of the block.
pub(crate) const CONSTRAINT: (&str, &str) =
    ("[design]", "[[constraints]]\nkind = \"volume\"\nregion = \"iron\"\nlower_ratio = 0.98\n\n[design]");

/// The block's mesh by the paper's law.
pub(crate) const LINEAR: (&str, &str) = ("slide = [", "law = \"linear\"\nslide = [");

/// The block's mesh by the law that moves nodes in all directions.
pub(crate) const HYPERELASTIC: (&str, &str) = ("slide = [", "law = \"hyperelastic\"\nslide = [");

/// The block of steel, in a field that saturates it, with the force on it; with the last change at rest.
pub(crate) const SATURATED: [(&str, &str); 4] = [
    ("relative_permeability = 100\n", "bh = \"team20_steel\"\n"),
    ("b = [0.0, 0.0, 0.1]", "b = [0.0, 0.0, 1.5]"),
    ("[objective]", "[[forces]]\nname = \"iron\"\nregions = [\"iron\"]\n\n[objective]"),
    ("frequency = \"50 Hz\"", "frequency = 0"),
];

/// Places that stay in the gap while its mesh moves through them; the face comes to 4 mm from the nearest.
pub(crate) const IN_A_MOVING_GAP: [(&str, &str); 3] = [
    ("kind = \"flux_density_squared\"", "kind = \"homogeneity\"\ndirection = [0, 0, 1]\nfollow = \"space\""),
    ("region = [\"gap\", \"iron\"]", "region = [\"observation\", \"gap\", \"iron\"]"),
    ("cells = [1, 1, 1]", "cells = [2, 2, 2]"),
];

/// A face that may move through all of the gap below it, which no mesh carries.
pub(crate) const THROUGH_THE_GAP: (&str, &str) = ("upper = \"4 mm\"", "upper = \"11 mm\"");

/// A block of 4 × 4 × 4 cells of 10 mm whose middle top node is lifted.
pub(crate) const MOTION: &str = r#"title = "lifted"
[mesh]
generator = "block"
[mesh.block]
size = ["40 mm", "40 mm", "40 mm"]
cells = [4, 4, 4]
[remesh]
region = "block"
free = ["z_max"]
[[morph.motion]]
nodes = [["20 mm", "20 mm", "40 mm"]]
displacement = ["0 mm", "0 mm", "5 mm"]
"#;

/// What is run.
#[derive(Clone, Debug)]
pub(crate) struct Device {
    pub(crate) name: &'static str,
    pub(crate) config: PathBuf,
    further: Vec<String>,
}

/// The block with changes, written into a folder.
pub(crate) fn written(name: &'static str, folder: &Path, changes: &[(&str, &str)]) -> Device {
    let config = folder.join(format!("{name}.toml"));
    std::fs::write(&config, changed(BLOCK, changes)).expect("written");
    Device { name, config, further: Vec::new() }
}

/// The block with a constraint and several references of its mesh.
pub(crate) fn block(folder: &Path, evaluations: usize) -> Device {
    let evaluations = format!("max_evaluations = {evaluations}");
    written("block", folder, &[CONSTRAINT, LINEAR, ("max_evaluations = 6", &evaluations)])
}

/// The block on elements so small that an evaluation takes far longer than the answer to a signal.
pub(crate) fn slow(folder: &Path) -> Device {
    let changes = [
        ("cells = [1, 1, 1]", "cells = [6, 6, 6]"),
        ("cells = [2, 2, 1]", "cells = [6, 6, 4]"),
        ("cells = [2, 2, 1]", "cells = [6, 6, 4]"),
        ("max_evaluations = 6", "max_evaluations = 1000"),
    ];
    written("slow", folder, &changes).with("remesh.law=linear")
}

/// A shipped configuration.
pub(crate) fn shipped(name: &'static str, further: &[&str]) -> Device {
    let config = repository("configs").join(format!("{name}.toml"));
    Device { name, config, further: further.iter().map(|item| (*item).to_owned()).collect() }
}

/// A run that would take hours.
pub(crate) fn endless() -> Device {
    let endless = shipped("shield_quick", &[]).with("optimizer.max_evaluations=1000000");
    // On rails the method would stall at the optimum.
    endless.with("optimizer.ftol_rel=0").with("remesh.law=linear")
}

impl Device {
    /// The same with a key of the configuration set.
    pub(crate) fn with(mut self, item: &str) -> Self {
        self.further.extend(["--set".to_owned(), item.to_owned()]);
        self
    }

    /// A command on it that writes into a directory; only its messages are read.
    pub(crate) fn command(&self, name: &str, out: &Path) -> Command {
        let mut command = command(&[&name, &self.config, &"--out", &out]);
        command.args(&self.further).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }

    /// What a run that nothing disturbs leaves, and how long it took.
    pub(crate) fn undisturbed(&self, folder: &Path) -> (Essence, Duration) {
        let out = folder.join("undisturbed");
        let clock = Instant::now();
        finish(&mut self.command("run", &out)).completed();
        (essence(&files(&out)), clock.elapsed())
    }
}

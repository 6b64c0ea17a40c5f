//! The files through VTK, as ParaView reads them: `tests/runs/check_run.py` on fresh runs.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::program::folder;
use crate::support::repository;
use crate::support::shield::Model;

/// A Python with pyvista, installed once below the target directory.
fn python() -> PathBuf {
    let environment = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pyvista");
    let python = environment.join("bin/python");
    if !succeeds(Command::new(&python).args(["-c", "import pyvista"])) {
        run(Command::new("python3").args(["-m", "venv"]).arg(&environment));
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "pyvista"];
        run(Command::new(&python).args(install));
    }
    python
}

fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

/// Runs a command that must succeed.
fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
#[ignore = "installs pyvista with pip below target/; run by `just test-pyvista` and `just test-long`"]
fn pyvista_reads_every_field_and_finds_the_plate_as_designed() {
    let home = folder();
    let runs = Model::ALL.map(|model| {
        let out = home.path().join(format!("{model:?}"));
        model.command("run", &out, &["--set", "output.fields=every"]).exits_with(1);
        out
    });
    let script = repository("tests/runs/check_run.py");
    let output = run(Command::new(python()).arg(script).args(&runs));
    let text = String::from_utf8_lossy(&output.stdout);
    print!("{text}");
    assert_eq!(text.lines().filter(|line| line.starts_with("OK ")).count(), runs.len(), "{text}");
}

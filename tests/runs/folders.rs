//! Where a run writes, and where it refuses to.

use std::fs;

use crate::support::folder::{RunFolder, files_below};
use crate::support::program::{command, finish, folder};
use crate::support::shield::{on_quick, quick};

#[test]
fn nothing_is_written_outside_of_the_output_directory() {
    let home = folder();
    let config = home.path().join("config/device.toml");
    fs::create_dir(home.path().join("config")).expect("made");
    fs::create_dir(home.path().join("elsewhere")).expect("made");
    fs::copy(quick(), &config).expect("copied");
    let scratch = home.path().join("scratch");
    fs::create_dir(&scratch).expect("made");
    for name in ["run", "solve", "check", "gradient"] {
        let mut command = command(&[&name, &config, &"--out", &"results", &"--force"]);
        finish(command.current_dir(home.path().join("elsewhere")).env("TMPDIR", &scratch)).completed();
    }
    // A relative --out is relative to where the command was given.
    for file in files_below(home.path()) {
        assert!(file == "config/device.toml" || file.starts_with("elsewhere/results/"), "{file}");
    }
}

#[test]
fn the_directory_of_the_configuration_is_relative_to_its_file() {
    let home = folder();
    let config = home.path().join("device.toml");
    fs::copy(quick(), &config).expect("copied");
    finish(command(&[&"solve", &config]).current_dir(std::env::temp_dir())).exits_with(0);
    assert!(home.path().join("runs/shield_quick/result.json").is_file());
}

#[test]
fn an_earlier_run_stays_until_it_is_replaced_by_force() {
    let home = folder();
    let out = home.path().join("out");
    on_quick("run", &out, &[]).exits_with(1);
    let note = out.join("notes.md");
    fs::write(&note, "mine").expect("written");
    let before = files_below(&out);
    let result = fs::read(out.join("result.json")).expect("a result");
    on_quick("run", &out, &[]).with(5, &["holds an earlier run", "--force", "--out"]);
    assert_eq!(files_below(&out), before);
    assert_eq!(fs::read(out.join("result.json")).expect("a result"), result);

    on_quick("solve", &out, &["--force"]).exits_with(0);
    let run = RunFolder(out);
    assert_eq!(run.json("result.json")["command"], "solve");
    assert!(!run.0.join("history.csv").exists() && !run.0.join("fields/eval_0004.vtu").exists());
    assert_eq!(fs::read_to_string(note).expect("the user's file stays"), "mine");
}

#[test]
fn an_output_that_cannot_be_written_is_named() {
    let home = folder();
    let file = home.path().join("file");
    fs::write(&file, "").expect("written");
    // Below a file nobody can write, whatever the rights of the user who tests.
    for out in [file.clone(), file.join("below"), file.join("far/below")] {
        on_quick("run", &out, &[]).with(5, &["error: ", out.to_str().expect("UTF-8")]);
    }
    assert_eq!(files_below(home.path()), ["file"]);
}

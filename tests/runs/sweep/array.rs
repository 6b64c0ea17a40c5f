//! `--script`: a job array that does what the sweep would do here.

use std::process::Command;

use super::home::Home;
use crate::support::essence::assert_same;
use crate::support::program::{Finished, finish};

const SET: [&str; 6] =
    ["--set", "design.upper=2 mm,4 mm", "--set", "optimizer.algorithm=mma,ccsaq", "--max-evaluations", "3"];

/// The script as the scheduler starts it: from another folder, with the number of the task.
fn task(home: &Home, index: usize) -> Finished {
    let mut command = Command::new("bash");
    command.arg(home.path("sweep.sh")).current_dir("/").env("SLURM_ARRAY_TASK_ID", index.to_string());
    finish(command.env("SLURM_CPUS_PER_TASK", "1").env_remove("FLUXMORPH"))
}

#[test]
fn the_tasks_of_the_script_do_what_the_sweep_does() {
    let home = Home::new();
    home.sweep("here", &SET).with(1, &[]);
    let written =
        home.sweep("there", &[&SET[..], &["--script", "sweep.sh", "--jobs", "2", "--threads", "1"]].concat());
    written.with(0, &["script of 4 combinations: sbatch sweep.sh"]);
    assert!(home.runs("there").is_empty(), "nothing is run");
    let script = home.text("sweep.sh");
    for line in ["#!/usr/bin/env bash", "#SBATCH --array=0-3%2", "#SBATCH --cpus-per-task=1", "set -eu"] {
        assert!(script.lines().any(|own| own == line), "{script}");
    }
    let checked = Command::new("bash").arg("-n").arg(home.path("sweep.sh")).status();
    assert!(checked.expect("bash is there").success());
    // Not every machine has it; where it is, it has nothing to say.
    if let Ok(output) = Command::new("shellcheck").arg(home.path("sweep.sh")).output() {
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    }
    let runs = home.runs("here");
    for index in 0..runs.len() {
        task(&home, index).with(1, &[": begun"]);
    }
    assert_eq!(home.runs("there"), runs);
    for run in &runs {
        let [here, there] = ["here", "there"].map(|out| home.essence(&format!("{out}/{run}")));
        assert_same(&here, &there, run);
    }
    // A task that is submitted again, and the comparison when all have ended.
    task(&home, 2).with(1, &["[3/4] design.upper=4mm,optimizer.algorithm=mma: skipped"]);
    let last = script.lines().rfind(|line| line.starts_with("#   fluxmorph sweep")).expect("a comment");
    let compare = last.replacen("#   fluxmorph", &format!("'{}'", env!("CARGO_BIN_EXE_fluxmorph")), 1);
    finish(Command::new("sh").args(["-c", &compare]).current_dir("/")).with(0, &["sweep.html"]);
    let cells = |out: &str| -> Vec<Vec<String>> {
        let table = home.text(&format!("{out}/sweep.csv"));
        table.lines().map(|line| line.split(',').take(9).map(str::to_owned).collect()).collect()
    };
    assert_eq!(cells("there"), cells("here"));
    // Beyond the last.
    task(&home, 4).with(2, &["the sweep has 4 combinations"]);
}

#[test]
fn a_broken_task_is_resumed_and_a_changed_sweep_refused() {
    let home = Home::new();
    home.sweep("out", &[&SET[..], &["--script", "sweep.sh"]].concat()).with(0, &[]);
    task(&home, 0).with(1, &[": begun"]);
    // As a kill leaves it.
    let manifest = "out/design.upper=2mm,optimizer.algorithm=mma/manifest.json";
    home.edit(manifest, "\"stopped\"", "\"running\"");
    task(&home, 0).with(1, &[": resumed"]);
    home.edit("block.toml", "50 Hz", "60 Hz");
    task(&home, 1).with(5, &["block.toml` has changed since"]);
    home.sweep("new", &["--set", "design.upper=2 mm,4 mm", "--only", "1"])
        .with(5, &["is not the directory of this sweep"]);
}

/// Each is a sound run by itself.
#[test]
fn runs_of_other_inputs_are_reported_and_not_compared() {
    let home = Home::on_a_curve();
    let set = ["--set", "design.upper=2 mm,3 mm,4 mm", "--max-evaluations", "1"];
    home.sweep("out", &[&set[..], &["--script", "sweep.sh"]].concat()).with(0, &[]);
    task(&home, 0).with(1, &[": begun"]);
    home.edit("iron.csv", "0.5", "0.4");
    task(&home, 1).with(1, &[": begun"]);
    let other = ["--set", "design.upper=4 mm", "--set", "analysis.frequency=60 Hz"];
    let run = ["run", "block.toml", "--out", "out/design.upper=4mm", "--max-evaluations", "1"];
    home.edit("iron.csv", "0.4", "0.5");
    home.fluxmorph(&[&run[..], &other].concat()).with(1, &[]);
    let compared = home.sweep("out", &[&set[..], &["--compare"]].concat()).with(
        0,
        &[
            "`design.upper=3mm` is not compared: `",
            "iron.csv` was another file when it began than for `design.upper=2mm`",
            "`design.upper=4mm` is not compared: its configuration is another",
        ],
    );
    assert_eq!(compared.count("is not compared"), 2, "{}", compared.stderr);
    let table = home.text("out/sweep.csv");
    let [first, second, third] = [1, 2, 3].map(|k| table.lines().nth(k).expect("a row").to_owned());
    assert!(first.starts_with("2 mm,stopped,max_evaluations,1,"), "{table}");
    assert!(second.starts_with("3 mm,stopped,max_evaluations,1,,,,"), "{table}");
    assert!(third.starts_with("4 mm,stopped,max_evaluations,1,,,,"), "{table}");
    let page = home.text("out/sweep.html");
    assert!(page.contains("not compared: its configuration is another"), "{page}");
}

#[test]
fn a_file_of_others_is_no_place_for_the_script() {
    let home = Home::with(&[("max_evaluations = 6", "max_evaluations = 1")]);
    let arguments = ["--set", "design.upper=2 mm,4 mm", "--script", "sweep.sh"];
    home.write("sweep.sh", "echo theirs\n");
    home.sweep("out", &arguments).with(5, &["`sweep.sh` exists and is no script of a sweep", "--force"]);
    assert_eq!(home.text("sweep.sh"), "echo theirs\n");
    home.sweep("out", &[&arguments[..], &["--force"]].concat()).with(0, &[]);
    home.sweep("out", &arguments).with(0, &[]);
}

//! A second sweep into the same directory: what is finished stays, what was interrupted is resumed, what is new is run.

use std::process::Child;

use super::home::{Home, children_of};
use crate::support::essence::assert_same;
use crate::support::folder::read_text;
use crate::support::program::{Finished, JOURNAL, send, wait_for_lock, wait_until};
use crate::support::with_mesh_file;

/// What is swept.
const SET: [&str; 2] = ["--set", "design.upper=2 mm,3 mm,4 mm"];
const RUNS: [&str; 3] = ["design.upper=2mm", "design.upper=3mm", "design.upper=4mm"];

/// A sweep whose runs are at work far longer than a test takes to find them there.
fn start(home: &Home, further: &[&str]) -> Child {
    let endless = ["--max-evaluations", "1000000"];
    let arguments = [&["sweep", "block.toml", "--out", "out"], &SET[..], &endless, further].concat();
    home.command(&arguments).spawn().expect("the program starts")
}

/// The same sweep with some evaluations more than any of its runs has, brought to its end in `out`: every run has the bits
/// of an undisturbed one.
#[track_caller]
fn brought_to_its_end(home: &Home, further: &[&str], context: &str) -> Finished {
    let most = RUNS.iter().map(|run| home.rows(&format!("out/{run}"))).max().expect("three runs");
    let limit = (most + 4).to_string();
    let set = [&SET[..], &["--max-evaluations", &limit]].concat();
    let again = home.sweep("out", &[&set[..], further].concat()).exits_with(1);
    home.sweep("expected", &set).exits_with(1);
    for run in RUNS {
        let [own, expected] = ["out", "expected"].map(|out| home.essence(&format!("{out}/{run}")));
        assert_same(&own, &expected, &format!("{context}, {run}"));
    }
    again
}

#[test]
fn finished_runs_are_skipped_and_further_values_begun() {
    let home = Home::new();
    let limit = ["--max-evaluations", "2"];
    home.sweep("out", &[&["--set", "design.upper=2 mm,4 mm"], &limit[..]].concat()).with(1, &[]);
    let journal = home.path("out/design.upper=2mm").join(JOURNAL);
    let before = std::fs::metadata(&journal).and_then(|file| file.modified()).expect("a file");
    // The program finds finished ones whatever they are called in the configuration, and with comments beside them.
    home.edit("block.toml", "title = ", "# A comment.\ntitle = ");
    let more = [SET, limit].concat();
    let again = home.sweep("out", &more).with(1, &["[2/3] design.upper=3mm: begun"]);
    let counts = (again.count("skipped, stopped: evaluations"), again.count("begun"));
    assert_eq!(counts, (2, 1), "{}", again.stderr);
    assert_eq!(std::fs::metadata(&journal).and_then(|file| file.modified()).expect("a file"), before);
    assert_eq!(home.runs("out"), RUNS);
    // Runs with wider limits continue from where the narrower ones ended.
    let wider = home.sweep("out", &[SET, ["--max-evaluations", "3"]].concat());
    assert_eq!(wider.with(1, &[]).count("resumed"), 3);
    assert_eq!(home.rows("out/design.upper=4mm"), 3);
}

#[test]
fn another_sweep_is_not_mixed_in() {
    let home = Home::new();
    let (two, limit) = (["--set", "design.upper=2 mm,4 mm"], ["--max-evaluations", "1"]);
    home.sweep("out", &[two, limit].concat()).with(1, &[]);
    home.sweep("out", &[["--set", "design.lower=-2 mm,-4 mm"], limit].concat())
        .with(5, &["it sweeps `design.upper`, this one `design.lower`", "--force"]);
    home.sweep("out", &[["--set", "design.upper=2 mm,3 mm"], limit].concat())
        .with(5, &["its combination `design.upper=4mm` is not among these"]);
    let other = [two, limit, ["--set", "analysis.frequency=60 Hz"]].concat();
    home.sweep("out", &other).with(5, &["out/design.upper=2mm` holds another run", "--force"]);
    assert_eq!(home.json("out/design.upper=2mm/result.json")["frequencies_hz"][0], 50.0);
    let replaced = home.sweep("out", &[&other[..], &["--force"]].concat()).with(1, &[]);
    assert_eq!(replaced.count("begun"), 2);
    assert_eq!(home.json("out/design.upper=2mm/result.json")["frequencies_hz"][0], 60.0);
    // A run of the sweep stays under force.
    assert_eq!(home.sweep("out", &[&other[..], &["--force"]].concat()).count("skipped"), 2);
}

#[test]
fn another_mesh_in_the_same_file_is_noticed() {
    let home = Home::new();
    // A mesh to read: that of the optimum of a first run is as good as any.
    home.fluxmorph(&["run", "block.toml", "--out", "first", "--max-evaluations", "2"]).exits_with(1);
    home.fluxmorph(&["solve", "block.toml", "--out", "flat"]).exits_with(0);
    home.write("block.toml", &with_mesh_file(&home.text("block.toml"), "device.msh"));
    let mesh = |from: &str| {
        std::fs::copy(home.path(from).join("optimum.msh"), home.path("device.msh")).expect("copied")
    };
    mesh("flat");
    let set = ["--set", "design.upper=2 mm,3 mm", "--max-evaluations", "1"];
    home.sweep("out", &set).with(1, &[]);
    assert_eq!(home.sweep("out", &set).with(1, &[]).count("skipped"), 2);
    // What is made of one file may differ.
    let set_of_surfaces = ["--set", "output.stl=[],[\"iron|gap\"]", "--max-evaluations", "1"];
    let alike = home.sweep("alike", &set_of_surfaces).with(1, &[]);
    assert_eq!(alike.count("is not compared"), 0, "{}", alike.stderr);
    mesh("first");
    home.sweep("out", &set).with(5, &["holds another run: its mesh file is another, or has changed since"]);
}

#[test]
fn another_curve_in_the_same_file_is_noticed() {
    let home = Home::on_a_curve();
    let set = ["--set", "design.upper=2 mm,3 mm", "--max-evaluations", "1"];
    home.sweep("out", &set).with(1, &[]);
    assert_eq!(home.sweep("out", &set).with(1, &[]).count("skipped"), 2);
    home.edit("iron.csv", "0.5", "0.4");
    home.sweep("out", &set).with(5, &["holds another run: the B–H table `", "iron.csv` has changed since"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_run_that_begins_on_another_curve_than_the_first_is_not_compared() {
    let home = Home::on_a_curve();
    let sweep = start(&home, &[]);
    for (k, run) in RUNS.iter().enumerate() {
        wait_until("a run at work", || home.rows(&format!("out/{run}")) > 0);
        if k == 0 {
            home.edit("iron.csv", "0.5", "0.4");
        }
        children_of(&sweep).into_iter().for_each(|run| send("TERM", run));
    }
    let output = sweep.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{said}");
    for run in &RUNS[1..] {
        let reason = "iron.csv` was another file when it began than for `design.upper=2mm`";
        assert!(said.contains(&format!("`{run}` is not compared: `")) && said.contains(reason), "{said}");
    }
    assert!(!said.contains("`design.upper=2mm` is not compared"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn killed_runs_go_on_and_end_as_if_they_had_not_been() {
    let home = Home::slower();
    let mut sweep = start(&home, &["--jobs", "2"]);
    wait_until("both runs at work", || RUNS[..2].iter().all(|run| home.rows(&format!("out/{run}")) > 1));
    let children = children_of(&sweep);
    sweep.kill().expect("killed");
    sweep.wait().expect("it has ended");
    assert_eq!(children.len(), 2);
    // They may have ended with the sweep by now.
    for process in children {
        let _ = std::process::Command::new("kill").args(["-s", "KILL", &process.to_string()]).output();
    }
    RUNS[..2].iter().for_each(|run| wait_for_lock(&home.path("out").join(run)));
    assert!(!home.path("out").join(RUNS[2]).exists(), "the third had not begun");
    let again = brought_to_its_end(&home, &["--jobs", "2"], "killed");
    assert_eq!((again.count(": resumed"), again.count(": begun")), (2, 1), "{}", again.stderr);
}

#[cfg(target_os = "linux")]
#[test]
fn a_sweep_that_is_killed_takes_its_runs_with_it() {
    let home = Home::slower();
    let mut sweep = start(&home, &["--jobs", "2"]);
    wait_until("both runs at work", || RUNS[..2].iter().all(|run| home.rows(&format!("out/{run}")) > 1));
    sweep.kill().expect("killed");
    sweep.wait().expect("it has ended");
    for run in &RUNS[..2] {
        // As after SIGTERM: what they have computed is in a result.
        let manifest = home.path(&format!("out/{run}/manifest.json"));
        wait_until("the end of the run", || !read_text(&manifest).contains("\"status\": \"running\""));
        assert_eq!(home.json(&format!("out/{run}/result.json"))["status"], "interrupted");
        wait_for_lock(&home.path("out").join(run));
    }
    brought_to_its_end(&home, &["--jobs", "2"], "killed");
}

#[cfg(target_os = "linux")]
#[test]
fn a_second_signal_to_a_sweep_ends_its_runs_at_once() {
    // Evaluations so long that none is complete between two signals.
    let finer = ("cells = [2, 2, 1]", "cells = [16, 16, 8]");
    let home = Home::with(&[("cells = [1, 1, 1]", "cells = [8, 8, 8]"), finer, finer]);
    let sweep = start(&home, &[]);
    let run = home.path("out").join(RUNS[0]);
    wait_until("a run at work", || run.join("config.toml").exists());
    let children = children_of(&sweep);
    send("INT", sweep.id());
    std::thread::sleep(std::time::Duration::from_millis(100));
    send("INT", sweep.id());
    let output = sweep.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    let is_gone = |process: &u32| {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        stat.is_empty() || stat.contains(") Z ")
    };
    wait_until("the end of the runs", || children.iter().all(is_gone));
    assert!(!run.join("result.json").exists(), "it was to end at once");
}

#[test]
fn a_signal_reaches_the_runs_at_work_once_and_no_further_one_begins() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let home = Home::slower();
        let sweep = start(&home, &[]);
        wait_until("a run at work", || home.rows(&format!("out/{}", RUNS[0])) > 1);
        send(signal, sweep.id());
        let output = sweep.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains("design.upper=2mm: interrupted, ") && said.contains("are saved"), "{said}");
        assert!(said.contains("resume with the same command"), "{said}");
        // It came to its end in order: what it has computed is in a result.
        assert_eq!(home.json("out/design.upper=2mm/result.json")["status"], "interrupted");
        assert!(home.text("out/sweep.csv").contains("\n3 mm,not_begun,"), "{}", home.text("out/sweep.csv"));
        if signal == "TERM" {
            brought_to_its_end(&home, &[], signal)
                .says(&["design.upper=2mm: resumed", "design.upper=3mm: begun"]);
        }
    }
}

#[test]
fn a_run_that_another_process_works_on_is_left_to_it() {
    let home = Home::slower();
    let run = format!("out/{}", RUNS[0]);
    let one = ["--set", "design.upper=2 mm,3 mm", "--max-evaluations", "1"];
    home.sweep("out", &one).with(1, &[]);
    let mut resume = home.command(&["resume", &run, "--max-evaluations", "1000000", "--quiet"]);
    let mut elsewhere = resume.spawn().expect("the program starts");
    wait_until("its work", || home.rows(&run) > 1);
    home.sweep("out", &one)
        .with(5, &["design.upper=2mm: another process is working on it", "design.upper=3mm: skipped"]);
    elsewhere.kill().expect("killed");
    elsewhere.wait().expect("it has ended");
}

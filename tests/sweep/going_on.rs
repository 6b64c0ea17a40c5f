//! A second sweep into the same directory: what is finished stays, what was broken off goes on, what is new begins.

use std::process::Child;

use crate::device::{Home, children_of, ended, send, wait_until};
use crate::essence::assert_same;

/// Long enough that a kill finds runs at work.
const SET: [&str; 4] = ["--set", "design.upper=2 mm,3 mm,4 mm", "--max-evaluations", "10"];
const RUNS: [&str; 3] = ["design.upper=2mm", "design.upper=3mm", "design.upper=4mm"];

fn start(home: &Home, further: &[&str]) -> Child {
    let mut command = home.command(&[&["sweep", "block.toml", "--out", "out"], &SET[..], further].concat());
    command.spawn().expect("the program starts")
}

/// Every run of the sweep has the bits of an undisturbed one.
#[track_caller]
fn undisturbed(home: &Home, context: &str) {
    home.sweep("expected", &SET).with(1, &[]);
    for run in RUNS {
        let [own, expected] = ["out", "expected"].map(|out| home.essence(&format!("{out}/{run}")));
        assert_same(&own, &expected, &format!("{context}, {run}"));
    }
}

#[test]
fn finished_runs_are_skipped_and_further_values_begun() {
    let home = Home::new();
    let limit = ["--max-evaluations", "2"];
    home.sweep("out", &[&["--set", "design.upper=2 mm,4 mm"], &limit[..]].concat()).with(1, &[]);
    let journal = home.path("out/design.upper=2mm/journal.jsonl");
    let before = std::fs::metadata(&journal).and_then(|file| file.modified()).expect("a file");
    // The program finds finished ones whatever they are called in the configuration, and with comments beside them.
    let text = home.text("block.toml").replace("title = ", "# A comment.\ntitle = ");
    std::fs::write(home.path("block.toml"), text).expect("written");
    let more = [&["--set", "design.upper=2 mm,3 mm,4 mm"], &limit[..]].concat();
    let again = home.sweep("out", &more).with(1, &["[2/3] design.upper=3mm: begun"]);
    assert_eq!(
        (again.count("skipped, stopped: evaluations"), again.count("begun")),
        (2, 1),
        "{}",
        again.said
    );
    assert_eq!(std::fs::metadata(&journal).and_then(|file| file.modified()).expect("a file"), before);
    assert_eq!(home.runs("out"), RUNS);
    // Wider limits go on from where the narrow ones ended.
    let wider = home
        .sweep("out", &[&["--set", "design.upper=2 mm,3 mm,4 mm"], &["--max-evaluations", "3"][..]].concat());
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
    ended(&mut home.command(&["run", "block.toml", "--out", "first", "--max-evaluations", "2", "--quiet"]))
        .with(1, &[]);
    ended(&mut home.command(&["solve", "block.toml", "--out", "flat", "--quiet"])).with(0, &[]);
    let text = home.text("block.toml");
    let (before, rest) = text.split_once("[mesh]").expect("a mesh");
    let (_, behind) = rest.split_once("[analysis]").expect("an analysis");
    let text = format!("{before}[mesh]\nfile = \"device.msh\"\nunit = \"mm\"\n\n[analysis]{behind}");
    std::fs::write(home.path("block.toml"), text).expect("written");
    let mesh = |from: &str| {
        std::fs::copy(home.path(from).join("optimum.msh"), home.path("device.msh")).expect("copied")
    };
    mesh("flat");
    let set = ["--set", "design.upper=2 mm,3 mm", "--max-evaluations", "1"];
    home.sweep("out", &set).with(1, &[]);
    assert_eq!(home.sweep("out", &set).with(1, &[]).count("skipped"), 2);
    mesh("first");
    home.sweep("out", &set).with(5, &["holds another run: its mesh file is another, or has changed since"]);
}

#[cfg(target_os = "linux")]
#[test]
fn killed_runs_go_on_and_end_as_if_they_had_not_been() {
    let home = Home::slower();
    let mut sweep = start(&home, &["--jobs", "2"]);
    wait_until("both runs at work", || RUNS[..2].iter().all(|run| home.rows(&format!("out/{run}")) > 1));
    let children = children_of(&sweep);
    sweep.kill().expect("killed");
    send("KILL", &children);
    sweep.wait().expect("it has ended");
    assert_eq!(children.len(), 2);
    // The locks of the dead are gone as soon as they are.
    wait_until("their end", || {
        children.iter().all(|id| {
            !std::path::Path::new(&format!("/proc/{id}/cmdline")).exists()
                || std::fs::read(format!("/proc/{id}/cmdline")).is_ok_and(|line| line.is_empty())
        })
    });
    assert!(!home.path("out").join(RUNS[2]).exists(), "the third had not begun");
    let again = home.sweep("out", &[&SET[..], &["--jobs", "2"]].concat()).with(1, &[]);
    assert_eq!((again.count(": resumed"), again.count(": begun")), (2, 1), "{}", again.said);
    undisturbed(&home, "killed");
}

#[test]
fn a_signal_reaches_the_runs_at_work_once_and_no_further_one_begins() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let home = Home::slower();
        let sweep = start(&home, &[]);
        wait_until("a run at work", || home.rows(&format!("out/{}", RUNS[0])) > 1);
        send(signal, &[sweep.id()]);
        let output = sweep.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains("design.upper=2mm: interrupted, ") && said.contains("are saved"), "{said}");
        assert!(said.contains("go on with the same command"), "{said}");
        // It came to its end in order: what it has computed is in a result.
        assert_eq!(home.json("out/design.upper=2mm/result.json")["status"], "interrupted");
        assert!(home.text("out/sweep.csv").contains("\n3 mm,not_begun,"), "{}", home.text("out/sweep.csv"));
        assert!(home.rows(&format!("out/{}", RUNS[0])) < 10);
        if signal == "TERM" {
            home.sweep("out", &SET).with(1, &["design.upper=2mm: resumed", "design.upper=3mm: begun"]);
            undisturbed(&home, signal);
        }
    }
}

#[test]
fn a_run_that_another_process_works_on_is_left_to_it() {
    let home = Home::slower();
    let run = format!("out/{}", RUNS[0]);
    let one = ["--set", "design.upper=2 mm,3 mm", "--max-evaluations", "1"];
    home.sweep("out", &one).with(1, &[]);
    let mut resume = home.command(&["resume", &run, "--max-evaluations", "100000", "--quiet"]);
    let mut elsewhere = resume.args(["--max-time", "60"]).spawn().expect("the program starts");
    wait_until("its work", || home.rows(&run) > 1);
    home.sweep("out", &one)
        .with(5, &["design.upper=2mm: another process works on it", "design.upper=3mm: skipped"]);
    elsewhere.kill().expect("killed");
    elsewhere.wait().expect("it has ended");
    ended(&mut home.command(&["resume", &run, "--max-evaluations", "2", "--quiet"]));
}

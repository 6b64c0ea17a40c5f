//! Signals end a run in order: what was computed is kept.
#![cfg(unix)]

use std::ffi::OsString;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::program::{command, finish, folder, quick};
use crate::shield::{RunFolder, count};

/// Far longer than any of these runs takes, on any machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A run that would go on for hours.
fn long_run(out: &Path) -> Child {
    let mut arguments = vec!["run".into(), quick().into_os_string(), "--out".into(), out.into()];
    for item in
        ["--max-evaluations", "1000000", "--set", "optimizer.ftol_rel=0", "--set", "output.fields=every"]
    {
        arguments.push(item.into());
    }
    command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the binary starts")
}

/// Waits until a condition holds.
fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "{what} did not come");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn send(signal: &str, child: &Child) {
    let status = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(status.expect("kill is there").success());
}

/// The exit code, once the process has ended.
fn exit_code(mut child: Child) -> Option<i32> {
    let mut code = None;
    wait_until("the end of the run", || {
        code = child.try_wait().expect("a child of this process");
        code.is_some()
    });
    code.and_then(|status| status.code())
}

fn rows(out: &Path) -> usize {
    std::fs::read_to_string(out.join("history.csv")).map_or(0, |text| text.lines().count().saturating_sub(1))
}

fn state_is_saved(out: &Path) {
    let run = RunFolder(out.to_owned());
    assert_eq!(run.json("manifest.json")["status"], "interrupted");
    let result = run.json("result.json");
    assert_eq!((&result["status"], &result["stop_reason"]), (&"interrupted".into(), &"interrupted".into()));
    let evaluations = count(&result, "/evaluations");
    assert_eq!(run.history().1.len() as u64, evaluations);
    for evaluation in 0..evaluations {
        assert_eq!(run.field(evaluation).points.len() as u64, count(&result, "/mesh/nodes"));
    }
}

#[test]
fn an_interrupted_or_terminated_run_keeps_its_state_and_says_so() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let home = folder();
        let out = home.path().join("out");
        let child = long_run(&out);
        wait_until("the first evaluation", || rows(&out) > 0);
        send(signal, &child);
        assert_eq!(exit_code(child), Some(code));
        state_is_saved(&out);
    }
}

#[test]
fn a_signal_before_the_first_evaluation_leaves_a_directory_to_go_on_with() {
    let home = folder();
    let out = home.path().join("out");
    let child = long_run(&out);
    wait_until("the manifest", || out.join("manifest.json").exists());
    send("-INT", &child);
    assert_eq!(exit_code(child), Some(130));
    assert_eq!(RunFolder(out.clone()).json("manifest.json")["status"], "interrupted");
    if out.join("result.json").exists() {
        // The first evaluation was in hand.
        state_is_saved(&out);
    }
    let arguments = ["resume".as_ref(), out.as_os_str(), "--max-evaluations".as_ref(), "2".as_ref()];
    finish(&mut command(&arguments)).exits_with(1);
    assert!(rows(&out) >= 2);
}

#[test]
fn the_manifest_says_running_while_a_run_goes_on() {
    let home = folder();
    let out = home.path().join("out");
    let child = long_run(&out);
    wait_until("the manifest", || out.join("manifest.json").exists());
    assert_eq!(RunFolder(out.clone()).json("manifest.json")["status"], "running");
    assert!(!out.join("result.json").exists());
    send("-TERM", &child);
    assert_eq!(exit_code(child), Some(143));
}

/// A block of 10 × 10 × 10 cells whose middle top node is lifted: a tenth of a second a motion.
const BLOCK: &str = r#"[mesh]
generator = "block"
[mesh.block]
size = ["40 mm", "40 mm", "40 mm"]
cells = [10, 10, 10]
[remesh]
region = "block"
free = ["z_max"]
[[morph.motion]]
nodes = [["20 mm", "20 mm", "40 mm"]]
displacement = ["0 mm", "0 mm", "2 mm"]
"#;

/// Ends `morph` with a signal once a file of the run directory is there; what was said, and the result.
fn interrupted_morph(
    text: &str,
    option: Option<&str>,
    file: &str,
    signal: &str,
    code: i32,
) -> (String, Value) {
    let home = folder();
    let (config, out) = (home.path().join("block.toml"), home.path().join("out"));
    std::fs::write(&config, text).expect("written");
    let mut arguments: Vec<OsString> =
        vec!["morph".into(), config.into(), "--out".into(), out.clone().into()];
    arguments.extend(option.map(OsString::from));
    let child = command(&arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut child = child.expect("the binary starts");
    let mut stderr = child.stderr.take().expect("it is piped");
    wait_until(file, || out.join(file).exists());
    send(signal, &child);
    assert_eq!(exit_code(child), Some(code));
    let mut said = String::new();
    stderr.read_to_string(&mut said).expect("UTF-8");
    let run = RunFolder(out);
    assert_eq!(run.json("manifest.json")["status"], "interrupted");
    let result = run.json("result.json");
    assert_eq!((&result["status"], &result["stop_reason"]), (&"interrupted".into(), &"interrupted".into()));
    assert!(run.0.join("morph.csv").exists() && run.0.join("tuned.toml").exists() == option.is_some());
    (said, result)
}

#[test]
fn an_interrupted_sweep_keeps_the_cases_that_are_done() {
    // Few cases of many cells: each takes far longer than a signal.
    let cases: String = (1..=8)
        .map(|k| format!("[[morph.case]]\nname = \"nu {k}\"\nremesh.poisson = {}\n", 0.05 * k as f64))
        .collect();
    let text = format!("{BLOCK}{cases}").replace("cells = [10, 10, 10]", "cells = [20, 20, 20]");
    let (said, result) = interrupted_morph(&text, None, "case_01_after.vtu", "-TERM", 143);
    let done = result["cases"].as_array().expect("a list").len();
    assert!((1..8).contains(&done), "{done}");
    assert!(said.contains(&format!("left out: {} of 8 cases: nu {}", 8 - done, done + 1)), "{said}");
}

#[test]
fn an_interrupted_tuner_keeps_the_best_it_found() {
    let text = format!("{BLOCK}[morph.tune]\nparameters = [\"poisson\", \"force\"]\n");
    let (said, result) = interrupted_morph(&text, Some("--tune"), "resolved.toml", "-INT", 130);
    assert_eq!(result["cases"].as_array().map(Vec::len), Some(0));
    assert!(count(&result, "/tuned/evaluations") >= 1);
    for fragment in ["left out: the search with the stiffness", "the motion with what was found"] {
        assert!(said.contains(fragment), "{said}");
    }
}

//! Signals end a run in order: what was computed is kept.
#![cfg(unix)]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{command, folder, quick};
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
fn a_signal_before_the_first_evaluation_leaves_that_one() {
    let home = folder();
    let out = home.path().join("out");
    let child = long_run(&out);
    wait_until("the manifest", || out.join("manifest.json").exists());
    send("-INT", &child);
    assert_eq!(exit_code(child), Some(130));
    state_is_saved(&out);
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

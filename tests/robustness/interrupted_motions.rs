//! `fluxmorph morph` that a signal ends keeps what was done.

use std::io::Read;
use std::process::Stdio;

use serde_json::Value;

use crate::support::changed;
use crate::support::device::MOTION;
use crate::support::folder::{RunFolder, count};
use crate::support::program::{command, end_of, folder, send, wait_until};

/// A motion in a block of so many cells a side that it takes a tenth of a second, or the like.
fn block(cells: usize, further: &str) -> String {
    let cells = format!("cells = [{cells}, {cells}, {cells}]");
    changed(MOTION, &[("cells = [4, 4, 4]", &cells), ("\"5 mm\"", "\"2 mm\"")]) + further
}

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
    let mut morph = command(&[&"morph", &config, &"--out", &out]);
    morph.args(option).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = morph.spawn().expect("the binary starts");
    let mut stderr = child.stderr.take().expect("it is piped");
    wait_until(file, || out.join(file).exists());
    send(signal, child.id());
    assert_eq!(end_of(&mut child).code(), Some(code));
    let mut said = String::new();
    stderr.read_to_string(&mut said).expect("UTF-8");
    let run = RunFolder(out);
    assert_eq!(run.json("manifest.json")["status"], "interrupted");
    let result = run.result();
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
    let (said, result) = interrupted_morph(&block(20, &cases), None, "case_01_after.vtu", "TERM", 143);
    let done = result["cases"].as_array().expect("a list").len();
    assert!((1..8).contains(&done), "{done}");
    assert!(said.contains(&format!("left out: {} of 8 cases: nu {}", 8 - done, done + 1)), "{said}");
}

#[test]
fn an_interrupted_tuner_keeps_the_best_it_found() {
    let text = block(10, "[morph.tune]\nparameters = [\"poisson\", \"force\"]\n");
    let (said, result) = interrupted_morph(&text, Some("--tune"), "resolved.toml", "INT", 130);
    assert_eq!(result["cases"].as_array().map(Vec::len), Some(0));
    assert!(count(&result, "/tuned/evaluations") >= 1);
    for fragment in ["left out: the search with the stiffness", "the motion with what was found"] {
        assert!(said.contains(fragment), "{said}");
    }
}

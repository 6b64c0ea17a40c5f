//! Numerical failures as a user meets them: the real binary, its exit code, its message, and what it leaves behind.

use std::path::Path;

use serde_json::Value;

use super::weight;
use crate::problems::quick;
use crate::support::folder::{files_below, read_json, read_text};
use crate::support::program::folder;
use crate::support::shield::on_quick;

/// Keys whose value may be missing: everything else in a published file is a number, a text, a list or a table of these.
const MAY_BE_NULL: &str = "verified_ratio region frequency frequency_hz admitted min_thickness_m max_thickness_m \
                           step_to_inversion inversion_element inversion_region methods";

/// No `null` where a number belongs, which is how JSON would write NaN.
fn no_null(value: &Value, key: &str) {
    match value {
        Value::Null => assert!(MAY_BE_NULL.split(' ').any(|own| own == key), "`{key}` is null"),
        Value::Array(items) => items.iter().for_each(|item| no_null(item, key)),
        Value::Object(map) => map.iter().for_each(|(key, value)| no_null(value, key)),
        _ => {}
    }
}

/// Everything that a run directory publishes is of numbers.
fn holds_numbers_alone(out: &Path) {
    for file in files_below(out) {
        let path = out.join(&file);
        if file == "result.json" {
            no_null(&read_json(&path), "");
        } else if file.ends_with(".jsonl") {
            for line in read_text(&path).lines() {
                no_null(&serde_json::from_str(line).expect("JSON"), "");
            }
        } else if file.ends_with(".csv") {
            let text = read_text(&path).to_lowercase();
            assert!(!text.contains("nan") && !text.contains("inf,") && !text.contains(",inf"), "{text}");
        }
    }
}

#[test]
fn a_run_that_overflows_after_some_evaluations_exits_with_4_and_saves_its_best_design() {
    let folder = folder();
    let out = folder.path().join("run");
    let weight = format!("objective.weight={:e}", weight(&quick(&[]).0, 1.5));
    let arguments = ["--set", &weight, "--set", "objective.goal=maximise", "--max-evaluations", "60"];
    on_quick("run", &out, &arguments).exits_with(4).says(&[
        "the adjoint of the objective at 60 Hz",
        "leave the range of numbers",
        "weights",
    ]);
    assert_eq!(read_json(&out.join("manifest.json"))["status"], "failed");
    let result = read_json(&out.join("result.json"));
    assert_eq!(result["stop_reason"], "numerical_failure");
    let [initial, best] = ["initial", "best"].map(|key| result["objective"][key].as_f64());
    assert!(result["evaluations"].as_u64() >= Some(2) && best > initial, "{result}");
    assert!(out.join("optimum.msh").exists(), "{:?}", files_below(&out));
    holds_numbers_alone(&out);
}

#[test]
fn what_fails_before_there_is_a_result_exits_with_4_and_publishes_none() {
    for command in ["run", "solve", "gradient"] {
        let folder = folder();
        let out = folder.path().join(command);
        on_quick(command, &out, &["--set", "objective.weight=1e200"])
            .with(4, &["the adjoint of the objective at 60 Hz", "weights"]);
        assert!(!out.join("result.json").exists());
        if command == "gradient" {
            assert!(!out.exists(), "a certificate writes nothing");
        } else {
            assert_eq!(read_json(&out.join("manifest.json"))["status"], "failed");
            holds_numbers_alone(&out);
        }
    }
}

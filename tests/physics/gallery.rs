//! Every shipped configuration against the numbers of `configs/expected.json`, by the real binary.
//!
//! An entry says `covered_by` when other tests compare the configuration in more detail; the tests here then run it only
//! where it is short. Long ones are run by the ignored test, as are long cases, beside which a short one has coarser cells or
//! elements. Numbers are looked up in the `result.json` of the run by
//! JSON pointer, and either have a `value` with a relative `tolerance` or are `at_most`.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::support::folder::read_json;
use crate::support::program::{command, finish, folder};
use crate::support::{repository, repository_text};

/// Which entries a test runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Length {
    Short,
    Long,
}

/// The entries by file name.
fn entries() -> BTreeMap<String, Value> {
    serde_json::from_str(&repository_text("configs/expected.json")).expect("a table of entries")
}

/// Of an entry or of one of its cases.
fn length(value: &Value) -> Length {
    if value["long"] == true { Length::Long } else { Length::Short }
}

/// Text of a key that must be there.
fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_else(|| panic!("no text `{key}` in {value}"))
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("no list `{key}` in {value}"))
}

/// `result.json` of one run of an entry.
fn result(config: &str, case: &Value) -> Value {
    let folder = folder();
    let (config, out) = (repository("configs").join(config), folder.path().join("run"));
    let mut command = command(&[&text(case, "command"), &config, &"--out", &out, &"--quiet"]);
    for change in list(case, "set") {
        command.args(["--set", change.as_str().expect("a text KEY=VALUE")]);
    }
    // Stopped at a limit, with valid results, is well: a run of the gallery may use up its evaluations, a row of a sweep
    // may be a broken mesh.
    finish(&mut command).completed();
    read_json(&out.join("result.json"))
}

/// What is wrong with the number at one path; prints what it finds.
fn deviation(config: &str, result: &Value, expected: &Value) -> Option<String> {
    let path = text(expected, "path");
    let Some(found) = result.pointer(path).and_then(Value::as_f64) else {
        return Some(format!("{config}: no number at {path}"));
    };
    let (kept, wish) = match (expected["value"].as_f64(), expected["at_most"].as_f64()) {
        (Some(value), None) => {
            let tolerance = expected["tolerance"].as_f64().expect("a value has a tolerance");
            let error = found / value - 1.0;
            (error.abs() <= tolerance, format!("{value} within {tolerance}, is off by {error:+.5}"))
        }
        (None, Some(most)) => (found <= most, format!("at most {most}")),
        _ => panic!("{config}: {path} has neither `value` nor `at_most`, or both"),
    };
    let line = format!("{config}: {path} = {found}, expected {wish} ({})", text(expected, "source"));
    println!("{line}");
    (!kept).then_some(line)
}

/// Runs the entries of one length and gathers all that deviates.
fn run(wanted: Length) {
    let mut wrong = Vec::new();
    for (config, entry) in &entries() {
        let of_case = |case: &Value| if length(entry) == Length::Long { Length::Long } else { length(case) };
        for case in list(entry, "cases").iter().filter(|case| of_case(case) == wanted) {
            let found = result(config, case);
            wrong.extend(list(case, "expect").iter().filter_map(|e| deviation(config, &found, e)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_configuration_has_an_entry_with_numbers_and_every_entry_a_configuration() {
    let files: BTreeSet<String> = std::fs::read_dir(repository("configs"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".toml"))
        .collect();
    let entries = entries();
    assert_eq!(files, entries.keys().cloned().collect::<BTreeSet<_>>());
    let gallery = repository_text("docs/gallery.md");
    for (config, entry) in &entries {
        assert!(!list(entry, "cases").is_empty(), "{config}");
        for case in list(entry, "cases") {
            assert!(matches!(text(case, "command"), "solve" | "run" | "morph"), "{config}");
            assert!(!list(case, "expect").is_empty(), "{config}");
        }
        if let Some(test) = entry["covered_by"].as_str() {
            assert!(repository(test).exists(), "{config}: no {test}");
        }
        assert!(gallery.contains(config.as_str()), "docs/gallery.md does not mention {config}");
    }
}

/// Long configurations are checked on coarse cells here, which shows that they are read and set up. One that a short case runs as it
/// is needs no check.
#[test]
fn every_configuration_passes_check_or_is_run() {
    let is_as_it_is = |case: &Value| length(case) == Length::Short && list(case, "set").is_empty();
    for (config, entry) in entries() {
        let path = repository("configs").join(&config);
        let mut check = command(&[&"check", &path]);
        if length(&entry) == Length::Long {
            let text = repository_text(&format!("configs/{config}"));
            let generator =
                ["boxes", "shield"].into_iter().find(|name| text.contains(&format!("[mesh.{name}]")));
            let generator = generator.expect("its mesh is generated");
            check.args(["--set", &format!("mesh.{generator}.refinement=0.25")]);
        } else if list(&entry, "cases").iter().any(is_as_it_is) {
            continue;
        }
        finish(&mut check).exits_with(0);
    }
}

#[test]
#[ignore = "large meshes"]
fn every_long_configuration_passes_check_as_it_is() {
    for (config, _) in entries().iter().filter(|(_, entry)| length(entry) == Length::Long) {
        finish(&mut command(&[&"check", &repository("configs").join(config)])).exits_with(0);
    }
}

#[test]
fn the_short_configurations_meet_their_numbers() {
    run(Length::Short);
}

#[test]
#[ignore = "minutes: just test-long"]
fn the_long_configurations_meet_their_numbers() {
    run(Length::Long);
}

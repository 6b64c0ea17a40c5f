//! Runs cut at every evaluation, and cut again.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fluxmorph::config::{Config, SourceMap};
use fluxmorph::files::{Disk, Refinements};
use fluxmorph::run::{RunLimits, journal};

use crate::disk::SimulatedDisk;
use crate::in_memory::{FOLDER, block, constrained, moved_by, resume, run, shipped, throttled};
use crate::support::device::{HYPERELASTIC, IN_A_MOVING_GAP, LINEAR, SATURATED};
use crate::support::essence::{Essence, assert_same, essence};

/// A disk on which a run has just lost its power behind `evaluations`: the journal ends there, and the rest is as it was.
fn cut_behind(files: &BTreeMap<PathBuf, Vec<u8>>, evaluations: usize) -> SimulatedDisk {
    let disk = SimulatedDisk::default();
    disk.create_dir(&Path::new(FOLDER).join("fields")).expect("made");
    for (path, bytes) in files {
        // What is written at the end is not there yet.
        let name = path.to_string_lossy();
        if name == "result.json" || name.starts_with("optimum") {
            continue;
        }
        let bytes = match name.as_ref() {
            "journal.jsonl" => cut_journal(bytes, evaluations),
            "manifest.json" => {
                String::from_utf8_lossy(bytes).replace("\"stopped\"", "\"running\"").into_bytes()
            }
            _ => bytes.clone(),
        };
        let mut file = disk.create(&Path::new(FOLDER).join(path)).expect("made");
        file.write_all(&bytes).expect("written");
    }
    disk
}

/// The header and so many records of a journal, and half of the next.
fn cut_journal(bytes: &[u8], records: usize) -> Vec<u8> {
    let mut lines = bytes.split_inclusive(|&byte| byte == b'\n');
    let mut kept: Vec<u8> = lines.by_ref().take(1 + records).flatten().copied().collect();
    kept.extend(lines.next().map_or(&[][..], |next| &next[..next.len() / 2]));
    kept
}

fn count(bytes: &[u8]) -> usize {
    journal::parse(bytes).expect("a journal").records.len()
}

fn whole_run(device: &(Config, SourceMap)) -> (BTreeMap<PathBuf, Vec<u8>>, Essence) {
    let disk = SimulatedDisk::default();
    run(&disk.shared(), device).unwrap_or_else(|e| panic!("{e}"));
    let files = disk.files(FOLDER.as_ref());
    let own = essence(&files);
    (files, own)
}

#[test]
fn a_run_cut_at_any_evaluation_goes_on_as_if_it_had_not_been() {
    let kept = |fields: &str| {
        block(&[("verify_refinement = 0", &format!("verify_refinement = 0\nfields = \"{fields}\""))])
    };
    for (name, device) in [
        ("plain", block(&[])),
        ("constrained", constrained()),
        ("linear", moved_by(LINEAR)),
        ("hyperelastic", moved_by(HYPERELASTIC)),
        ("saturated", block(&[SATURATED[0], SATURATED[1], SATURATED[2], SATURATED[3]])),
        ("saturated at 50 Hz", block(&SATURATED[..3])),
        ("throttled", throttled()),
        ("observed where it moves", block(&IN_A_MOVING_GAP)),
        ("last", kept("first_last")),
        ("none", kept("none")),
        ("shield", shipped("shield_quick.toml")),
        ("loads", shipped_with("shield_two_loads.toml", 6)),
    ] {
        let journal = cut_everywhere(name, &device);
        assert!(journal.records.len() >= 5, "{name}: {}", journal.records.len());
    }
}

/// Cuts a run at every evaluation and goes on; its journal.
fn cut_everywhere(name: &str, device: &(Config, SourceMap)) -> journal::Contents {
    let (files, expected) = whole_run(device);
    let journal = journal::parse(&files[Path::new("journal.jsonl")]).expect("a journal");
    for cut in 0..=journal.records.len() {
        let disk = cut_behind(&files, cut);
        resume(&disk.shared(), RunLimits::default()).unwrap_or_else(|e| panic!("{name}, cut at {cut}: {e}"));
        assert_same(&essence(&disk.files(FOLDER.as_ref())), &expected, &format!("{name}, cut at {cut}"));
    }
    journal
}

/// The saturated block, cut above what moves by a slit so narrow that the elements in it are nearly flat.
fn slit(width: &str) -> (Config, SourceMap) {
    let further = format!(
        "[[mesh.boxes.regions]]\nname = \"slit\"\nbox = [[0, 0, \"25 mm\"], [\"20 mm\", \"20 mm\", \"{width}\"]]\n\n\
         [[mesh.boxes.regions]]\nname = \"head\"\nbox = [[0, 0, \"{width}\"], [\"20 mm\", \"20 mm\", \"30 mm\"]]\n\n\
         [[mesh.boxes.surfaces]]"
    );
    let [steel, field, force, _] = SATURATED;
    block(&[
        steel,
        field,
        force,
        (
            "frequency = \"50 Hz\"",
            "frequency = 0\nelements = \"edge\"\nlinear_solver = { method = \"incomplete\" }",
        ),
        ("[\"20 mm\", \"20 mm\", \"30 mm\"]]", "[\"20 mm\", \"20 mm\", \"25 mm\"]]"),
        ("[[mesh.boxes.surfaces]]", &further),
        ("[regions.iron]", "[regions.head]\nmaterial = \"iron\"\n\n[regions.iron]"),
        ("lower = \"-4 mm\"", "lower = \"-1 mm\""),
        ("upper = \"4 mm\"", "upper = \"1 mm\""),
    ])
}

/// The method that follows one that fails within a step of Newton's is in the journal.
#[test]
fn a_run_whose_newton_steps_fell_back_goes_on_with_the_same_method() {
    let records = cut_everywhere("fallback", &slit("25.00003 mm")).records;
    let methods: Vec<_> = records.iter().map(|record| record.methods[0]).collect();
    println!("{methods:?}");
    assert!(methods.last().is_some_and(Option::is_some), "no method failed: {methods:?}");
}

/// A shield, which keeps the fields of its first and its last evaluation alone.
fn shipped_with(name: &str, evaluations: usize) -> (Config, SourceMap) {
    let (mut config, source) = shipped(name);
    config.optimizer.max_evaluations = evaluations;
    (config, source)
}

#[test]
fn a_run_may_be_cut_again_and_again() {
    for device in [constrained(), moved_by(HYPERELASTIC), throttled(), shipped_with("shield_quick.toml", 8)] {
        let (files, expected) = whole_run(&device);
        let count = count(&files[Path::new("journal.jsonl")]);
        let mut disk = cut_behind(&files, 0);
        for depth in 1..=5 {
            // Each time one evaluation more, then it is cut within the next.
            let limits = RunLimits { max_evaluations: Some(depth), max_time: None };
            resume(&disk.shared(), limits).unwrap_or_else(|e| panic!("depth {depth}: {e}"));
            disk = cut_behind(&disk.files(FOLDER.as_ref()), depth);
        }
        let limits = RunLimits { max_evaluations: Some(device.0.optimizer.max_evaluations), max_time: None };
        resume(&disk.shared(), limits).unwrap_or_else(|e| panic!("at last: {e}"));
        assert!(count > 5);
        assert_same(&essence(&disk.files(FOLDER.as_ref())), &expected, "at last");
    }
}

/// A mesh that is refined before the search, and again for the best design.
fn refined() -> (Config, SourceMap) {
    block(&[
        (
            "frequency = \"50 Hz\"",
            "frequency = \"50 Hz\"\nelements = \"edge\"\norder = 1\n\n[accuracy]\ntolerance = \"4 %\"",
        ),
        ("max_evaluations = 6", "max_evaluations = 8"),
        ("ftol_rel = 0", "ftol_rel = 1e-2"),
    ])
}

#[test]
fn a_run_cut_anywhere_makes_its_refinements_again() {
    let (files, expected) = whole_run(&refined());
    let history = String::from_utf8_lossy(&files[Path::new("history.csv")]).into_owned();
    println!("{history}");
    let kept: Refinements = serde_json::from_slice(&files[Path::new("refinements.json")]).expect("JSON");
    let evaluations: Vec<usize> = kept.refinements.iter().map(|step| step.evaluations).collect();
    assert!(evaluations[0] == 0 && *evaluations.last().expect("some") > 0, "{evaluations:?}");
    let count = count(&files[Path::new("journal.jsonl")]);
    for cut in 0..=count {
        // What was marked is known, or the process ended before that was written, or it was lost.
        for steps in 0..=kept.refinements.len() {
            let refinements = kept.refinements[..steps].to_vec();
            let mut files = files.clone();
            if steps == 0 {
                files.remove(Path::new("refinements.json"));
            } else {
                let mut bytes = serde_json::to_vec_pretty(&Refinements { refinements }).expect("JSON");
                bytes.push(b'\n');
                files.insert(PathBuf::from("refinements.json"), bytes);
            }
            let disk = cut_behind(&files, cut);
            let context = format!("cut at {cut} with {steps} refinements");
            resume(&disk.shared(), RunLimits::default()).unwrap_or_else(|e| panic!("{context}: {e}"));
            assert_same(&essence(&disk.files(FOLDER.as_ref())), &expected, &context);
        }
    }
}

/// The mesh is not refined for a search that has too few evaluations left: the best design would not be among its own. With more of
/// them the run goes on as if there had been no limit.
#[test]
fn a_limit_between_two_meshes_loses_nothing() {
    let (_, expected) = whole_run(&refined());
    let mut least = 1.0_f64;
    for evaluations in 1..8 {
        let mut device = refined();
        device.0.optimizer.max_evaluations = evaluations;
        let disk = SimulatedDisk::default();
        let result = run(&disk.shared(), &device).unwrap_or_else(|e| panic!("{evaluations}: {e}"));
        let ratio = result.objective.expect("an objective").ratio;
        println!("{evaluations} evaluations: {ratio:.4}");
        assert!(ratio < 1.0 || least == 1.0, "{evaluations} evaluations end at {ratio}, fewer at {least}");
        least = least.min(ratio);
        let limits = RunLimits { max_evaluations: Some(8), max_time: None };
        resume(&disk.shared(), limits).unwrap_or_else(|e| panic!("{evaluations}: {e}"));
        assert_same(&essence(&disk.files(FOLDER.as_ref())), &expected, &format!("{evaluations} at first"));
    }
    assert!(least < 0.99, "nothing was to be lost: {least}");
}

#[test]
fn refinements_that_are_not_those_of_the_run_are_refused() {
    let (files, _) = whole_run(&refined());
    let damaged = |change: &dyn Fn(&mut Refinements)| {
        let path = Path::new("refinements.json");
        let mut kept: Refinements = serde_json::from_slice(&files[path]).expect("JSON");
        change(&mut kept);
        let mut files = files.clone();
        files.insert(path.to_owned(), serde_json::to_vec(&kept).expect("JSON"));
        let disk = cut_behind(&files, 1);
        resume(&disk.shared(), RunLimits::default()).expect_err("another mesh").to_string()
    };
    let error = damaged(&|kept| kept.refinements[0].marked.push(1_000_000));
    assert!(
        error.contains("refinements.json") && error.contains("an element that the mesh does not have"),
        "{error}"
    );
    let error = damaged(&|kept| {
        kept.refinements[0].marked.pop();
    });
    assert!(error.contains("it makes another mesh than it says"), "{error}");
    // The second one, of the best design, as if it had been made before the search: nothing is written behind what the journal has.
    let error = damaged(&|kept| kept.refinements[1].evaluations = 0);
    assert!(
        error.contains("on a mesh of 2 refinements, where the journal has one on a mesh of 1"),
        "{error}"
    );
}

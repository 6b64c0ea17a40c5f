//! The same bits for any number of threads, and from a program built with and without optimisation.
//!
//! Compared are all files of a run but for times, memory and the manifest: history, fields, journal, result, mesh.

use std::path::Path;
use std::process::Command;

use crate::support::device::{Device, block, shipped, slow};
use crate::support::essence::{Essence, assert_same, essence};
use crate::support::folder::{RunFolder, files};
use crate::support::program::{finish, folder};
use crate::support::shield::Model;

/// All settings of the linear solver; `two_level` is for quadratic elements.
const METHODS: [&str; 6] =
    ["direct", "direct_single", "real_factor", "real_factor_single", "incomplete", "two_level"];

fn on_threads(device: &Device, home: &Path, threads: &str) -> Essence {
    let out = home.join(threads);
    finish(device.command("run", &out).args(["--threads", threads])).completed();
    assert_eq!(RunFolder(out.clone()).json("manifest.json")["threads"].to_string(), threads);
    essence(&files(&out))
}

/// Numbers of threads that are compared with one: where runs take milliseconds, and where they take seconds. Three divide nothing
/// that is cut into powers of two, and leave one without a core on small machines.
const ALL: [&str; 3] = ["2", "4", "8"];
const FEW: [&str; 2] = ["2", "3"];

fn same_on(numbers: &[&str], device: &Device) {
    let home = folder();
    let expected = on_threads(device, home.path(), "1");
    assert!(expected.keys().any(|path| path.extension().is_some_and(|e| e == "vtu")), "fields are compared");
    for threads in numbers {
        let context = format!("{}, {threads} threads", device.name);
        assert_same(&on_threads(device, home.path(), threads), &expected, &context);
    }
}

#[test]
fn any_number_of_threads_writes_the_same_bits_with_every_linear_solver() {
    let home = folder();
    for method in METHODS {
        let device = block(home.path(), 8).with(&format!("analysis.linear_solver.method={method}"));
        let device = match method {
            "two_level" => device.with("analysis.elements=nodal").with("analysis.order=2"),
            _ => device,
        };
        same_on(&ALL, &device);
    }
}

#[test]
fn any_number_of_threads_writes_the_same_bits_on_systems_cut_into_many_tasks() {
    let home = folder();
    // A state, its adjoint and the gradient: motion and further designs are compared on small systems.
    let device = slow(home.path()).with("optimizer.max_evaluations=1");
    let fine = [1, 2].map(|region| format!("mesh.boxes.regions.{region}.cells=[10, 10, 6]"));
    let fine = fine.iter().fold(device.clone(), |device, cells| device.with(cells));
    same_on(&FEW, &fine.with("analysis.linear_solver.method=direct"));
    // Iterations of an incomplete factor in three parts.
    same_on(&FEW, &device.with("analysis.linear_solver.method=incomplete"));
}

#[test]
fn any_number_of_threads_writes_the_same_bits_of_edge_elements() {
    let home = folder();
    let block = block(home.path(), 6).with("analysis.elements=edge");
    same_on(&FEW, &block.clone().with("analysis.order=2"));
    same_on(&FEW, &block.with("analysis.order=1").with("accuracy.tolerance=0.04"));
}

#[test]
fn any_number_of_threads_writes_the_same_bits_of_the_shields() {
    let few = |device: Device| device.with("output.fields=every").with("optimizer.max_evaluations=2");
    same_on(&FEW, &few(shipped("shield_quick", &[])));
    // Without the check on a finer mesh, which the first has.
    for name in ["shield_two_frequencies", "shield_two_loads"] {
        same_on(&FEW, &few(shipped(name, &[])).with("output.verify_refinement=0"));
    }
    same_on(&FEW, &few(shipped("shield_quick", Model::Meshed.arguments())));
}

/// Needs the program of the `dev` profile: `just determinism` builds it first.
#[test]
#[ignore = "needs the program built without optimisation: just determinism"]
fn debug_and_release_write_the_same_bits() {
    let home = folder();
    let release = Path::new(env!("CARGO_BIN_EXE_fluxmorph"));
    let debug = release.with_file_name("../debug/fluxmorph");
    assert!(debug.is_file(), "{} is not there: run `cargo build` first", debug.display());
    let small = METHODS.iter().map(|method| {
        let device = block(home.path(), 12).with(&format!("analysis.linear_solver.method={method}"));
        if *method == "two_level" { device.with("analysis.order=2") } else { device }
    });
    let shields = ["shield_quick", "shield_two_frequencies"];
    let shields = shields.map(|name| shipped(name, &["--set", "output.fields=every"]));
    for (number, device) in small.chain(shields).enumerate() {
        let essences = [release, &debug].map(|program| {
            let out = home.path().join(format!("{number}_{}", program == debug));
            let prepared = device.command("run", &out);
            finish(Command::new(program).args(prepared.get_args())).completed();
            essence(&files(&out))
        });
        assert_same(&essences[1], &essences[0], &format!("{} without optimisation", device.name));
        println!("{}: {} files the same", device.name, essences[0].len());
    }
}

//! Ranks that are killed, and signals to one of them: what was computed is kept, and the run can be resumed.

use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Output};

use crate::launch::{COARSE, assert_same, completed, fluxmorph, on, records, result};
use crate::support::folder::rows;
use crate::support::program::{folder, send, wait_until};

/// Starts a run, waits for its second evaluation, and sends a signal to one of its ranks, or without one to mpirun; how mpirun
/// ended.
fn stopped(out: &Path, rank: Option<usize>, signal: &str) -> Output {
    let child = on(2, "run", "shield.toml", out, &COARSE).spawn().expect("it starts");
    wait_until("a second evaluation", || rows(out) > 1);
    send(signal, rank.map_or(child.id(), |rank| process_of(&child, rank)));
    child.wait_with_output().expect("it ends")
}

/// The process of a rank: the child of mpirun with that number.
fn process_of(mpirun: &Child, rank: usize) -> u32 {
    let id = mpirun.id().to_string();
    let children = std::fs::read_to_string(format!("/proc/{id}/task/{id}/children")).expect("Linux has it");
    let variable_of_rank = format!("OMPI_COMM_WORLD_RANK={rank}");
    let is_it = |process: &&str| {
        let environment = std::fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
        environment.split(|&byte| byte == 0).any(|variable| variable == variable_of_rank.as_bytes())
    };
    children.split_whitespace().find(is_it).expect("mpirun has started it").parse().expect("a number")
}

#[test]
fn a_run_one_of_whose_ranks_is_killed_goes_on_as_if_it_had_not_been() {
    let folder = folder();
    let whole = folder.path().join("whole");
    completed(&mut on(2, "run", "shield.toml", &whole, &COARSE));
    for (killed, goes_on) in [(1, 2), (0, 3)] {
        let out = folder.path().join(format!("killed{killed}"));
        let ended = stopped(&out, Some(killed), "KILL");
        assert!(!ended.status.success() && ended.status.signal().is_none(), "mpirun ends the others");
        assert!(!out.join("result.json").exists());
        completed(fluxmorph(goes_on).arg("resume").arg(&out));
        assert_same(&out, &whole);
        assert_eq!(result(&out)["evaluations"], result(&whole)["evaluations"]);
    }
}

#[test]
fn a_signal_to_one_rank_ends_all_with_the_state_saved() {
    let folder = folder();
    for (rank, signal) in [(Some(0), "TERM"), (Some(1), "TERM"), (None, "USR1")] {
        let out = folder.path().join(format!("{rank:?}"));
        let ended = stopped(&out, rank, signal);
        let said = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(143), "{said}");
        assert_eq!(result(&out)["status"], "interrupted");
        assert!(said.contains("fluxmorph resume"), "{said}");
    }
}

#[test]
fn a_run_on_ranks_goes_on_with_other_limits() {
    let folder = folder();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    completed(&mut on(2, "run", "shield.toml", &whole, &COARSE));
    let fewer = ["optimizer.max_evaluations=2"];
    completed(&mut on(2, "run", "shield.toml", &out, &[&COARSE[..], &fewer].concat()));
    completed(fluxmorph(2).arg("resume").arg(&out).args(["--max-evaluations", "4"]));
    completed(fluxmorph(2).arg("resume").arg(&out).args(["--max-evaluations", "6", "--max-time", "1 h"]));
    assert_eq!(result(&out)["evaluations"], result(&whole)["evaluations"]);
    assert_same(&out, &whole);
}

/// On one process it is refused at its key.
#[test]
fn an_initial_design_that_the_mesh_does_not_carry_is_refused_on_ranks_too() {
    let folder = folder();
    let far = ["design.upper=\"200 mm\"", "design.initial=\"150 mm\""];
    let ends = [0, 2].map(|ranks| {
        let out = folder.path().join(format!("on{ranks}"));
        let ended =
            on(ranks, "run", "shield.toml", &out, &[&COARSE[..], &far].concat()).output().expect("it ends");
        assert!(!out.join("journal.jsonl").exists());
        (ended.status.code(), String::from_utf8_lossy(&ended.stderr).into_owned())
    });
    for (code, said) in &ends {
        assert_eq!(*code, Some(3), "{said}");
        assert!(said.contains("of the initial design") && said.contains("design.initial"), "{said}");
    }
}

/// One process answers designs that the mesh carries no farther than known ones without an evaluation, and writes no record of them.
#[test]
fn a_run_of_one_process_with_such_designs_goes_on_on_ranks() {
    let folder = folder();
    let out = folder.path().join("out");
    let far = [
        "design.upper=\"300 mm\"",
        "output.verify_refinement=0",
        "output.fields=\"none\"",
        "optimizer.max_evaluations=20",
    ];
    completed(&mut on(0, "run", "shield_quick.toml", &out, &far));
    let before = records(&out);
    completed(fluxmorph(2).arg("resume").arg(&out).args(["--max-evaluations", "22"]));
    assert_eq!((before.len(), records(&out).len()), (20, 22));
}

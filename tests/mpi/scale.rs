//! The measurement of docs/scale.md on a small mesh.

use std::process::Command;

use crate::launch::ranks;
use crate::support::folder::{count, read_text};
use crate::support::program::{finish, folder};
use crate::support::repository;

#[test]
fn two_ranks_take_at_most_twice_the_iterations_of_one() {
    let folder = folder();
    let mut command = Command::new("python3");
    let program = env!("CARGO_BIN_EXE_fluxmorph");
    command.arg(repository("tools/scale.py"));
    command.args(["--program", program, "--mesh", "meshed 14k", "--keep"]);
    // The same surroundings as for every other start of mpirun.
    let surroundings = ranks(0, program.as_ref());
    command.arg(folder.path()).envs(surroundings.get_envs().filter_map(|(name, value)| Some((name, value?))));
    finish(&mut command).exits_with(0);
    let lines = read_text(&folder.path().join("scale.jsonl"));
    let records: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("it is JSON")).collect();
    assert_eq!(records.len(), 4, "two solvers, each on one and two ranks");
    for pair in records.chunks(2) {
        let iterations = |record: &serde_json::Value| count(record, "/iterations");
        assert_eq!((&pair[0]["solver"], &pair[0]["ranks"]), (&pair[1]["solver"], &1.into()));
        assert!(iterations(&pair[1]) <= 2 * iterations(&pair[0]), "{pair:?}");
        assert_eq!(pair[1]["mib"].as_array().map(Vec::len), Some(2));
    }
}

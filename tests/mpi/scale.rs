//! The measurement of docs/scale.md on the smallest mesh of `tools/scale.py`, which has hats in its coarse space.

use std::process::Command;

use crate::launch::ranks;
use crate::support::folder::{count, read_text};
use crate::support::program::{finish, folder};
use crate::support::repository;

/// What either solver may take on one rank: half as much again as Schwarz's method does.
const MOST_ITERATIONS: u64 = 45;

#[test]
fn four_ranks_take_at_most_a_fifth_more_iterations_than_one() {
    let folder = folder();
    let mut command = Command::new("python3");
    let program = env!("CARGO_BIN_EXE_fluxmorph");
    command.arg(repository("tools/scale.py"));
    command.args([
        "--program",
        program,
        "--mesh",
        "meshed 73k",
        "--ranks",
        "1",
        "--ranks",
        "2",
        "--ranks",
        "4",
        "--keep",
    ]);
    // The same surroundings as for every other start of mpirun.
    let surroundings = ranks(0, program.as_ref());
    command.arg(folder.path()).envs(surroundings.get_envs().filter_map(|(name, value)| Some((name, value?))));
    finish(&mut command).exits_with(0);
    let lines = read_text(&folder.path().join("scale.jsonl"));
    let records: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("it is JSON")).collect();
    assert_eq!(records.len(), 6, "two solvers, each on one, two and four ranks");
    for of_solver in records.chunks(3) {
        let iterations = |record: &serde_json::Value| count(record, "/iterations");
        let one = iterations(&of_solver[0]);
        assert!(one <= MOST_ITERATIONS, "{of_solver:?}");
        for (record, ranks) in of_solver.iter().zip([1, 2, 4]) {
            assert_eq!((&record["solver"], &record["ranks"]), (&of_solver[0]["solver"], &ranks.into()));
            assert!(5 * iterations(record) <= 6 * one, "{of_solver:?}");
            assert_eq!(record["mib"].as_array().map(Vec::len), Some(ranks));
        }
    }
}

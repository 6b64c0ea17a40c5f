//! What the command line takes, says, and ends with: over a hundred cases, all of them fast.
//!
//! `cases/*.trycmd` hold commands with everything that they print, which is compared; what depends on the machine is left
//! out as `[..]`. After a change that is meant: `TRYCMD=overwrite cargo test --release --test runs commands_print`, and a
//! look at what changed. What such files cannot say (closed pipes, terminals, names that are no UTF-8) is in `surroundings`, what
//! `init` and `generate` make in `products`.

mod products;
mod surroundings;
mod terminal;

use tempfile::TempDir;

use crate::support::program::folder;
use crate::support::repository;

/// A temporary folder with the tiny configurations of the cases.
fn tiny() -> TempDir {
    let folder = folder();
    for name in ["tiny.toml", "motion.toml"] {
        let case = repository("tests/runs/cli/cases/run.in").join(name);
        std::fs::copy(case, folder.path().join(name)).expect("copied");
    }
    folder
}

/// Files of cases, with their number of commands.
const FEWEST_CASES: usize = 100;

#[test]
fn commands_print_what_is_written_down() {
    // Other tests look at colours and terminals.
    trycmd::TestCases::new()
        .env("TERM", "dumb")
        .insert_var("[VERSION]", env!("CARGO_PKG_VERSION"))
        .expect("the name of a variable")
        .case("tests/runs/cli/cases/*.trycmd");
}

#[test]
fn there_are_enough_cases() {
    let mut cases = 0;
    for entry in std::fs::read_dir(repository("tests/runs/cli/cases")).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "trycmd") {
            let text = std::fs::read_to_string(&path).expect("a file");
            cases += text.lines().filter(|line| line.starts_with("$ ")).count();
        }
    }
    assert!(cases >= FEWEST_CASES, "{cases} cases");
}

//! Whole runs on ranks: the same evaluations, fields in pieces, going on after a break, a rank that fails.

use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;

use fluxmorph::build::Mode;
use fluxmorph::files::{OverwritePolicy, RunResult, StopReason, system_disk};
use fluxmorph::run::{self, Options, RunLimits, SavedRun};
use fluxmorph::show::Silent;
use fluxmorph::show::report::ReportedRun;
use fluxmorph_geometry::parallel::{RankGroup, Role, threads};

use crate::support;

const CONFIG: &str = "shield_quick.toml";

/// A run with all its fields, and no fresh mesh.
const SETTINGS: [&str; 4] = [
    "mesh.shield.refinement=0.3",
    "optimizer.max_evaluations=6",
    "output.verify_refinement=0",
    "output.fields=\"every\"",
];

/// What a run is to do.
#[derive(Clone, Copy)]
enum Task {
    Run,
    /// Breaks off when so many evaluations were asked for.
    BreakOff(usize),
    Resume,
}

/// A run into a directory on so many ranks; 0 for one process without ranks.
fn run(directory: &Path, size: usize, task: Task) -> RunResult {
    let disk = system_disk();
    let lead = |group: Option<&RankGroup>| {
        let (mut config, source) = support::config(CONFIG, &SETTINGS);
        config.output.directory = directory.to_owned();
        if let Some(group) = group.filter(|group| group.role() == Role::Worker) {
            run::serve(group, &config, &source, Mode::Optimisation);
            return None;
        }
        let asked = Cell::new(0);
        let interrupted = || {
            asked.set(asked.get() + 1);
            matches!(task, Task::BreakOff(most) if asked.get() > most)
        };
        let options = Options {
            disk: &disk,
            overwrite_policy: OverwritePolicy::Keep,
            threads: 1,
            ranks: group,
            interrupted: &interrupted,
            searched: &|_| None,
        };
        let result = match task {
            Task::Resume => {
                let saved = SavedRun::open(&disk, directory).expect("there is a run");
                run::resume(&saved, RunLimits::default(), options, &mut Silent)
            }
            _ => run::run(&config, &source, options, &mut Silent),
        };
        if let Some(group) = group {
            group.shut_down();
        }
        Some(result.unwrap_or_else(|error| panic!("{error}")))
    };
    match size {
        0 => lead(None).expect("one process leads"),
        _ => {
            let led = threads::run(size, |ranks| lead(Some(&RankGroup::new(ranks, Arc::default()))));
            led.into_iter().flatten().next().expect("the first rank leads")
        }
    }
}

/// Objective and design agree; the sums of ranks have other last bits.
fn assert_same(own: &RunResult, other: &RunResult) {
    assert_eq!((own.evaluations, own.iterations), (other.evaluations, other.iterations));
    let best = |result: &RunResult| result.objective.as_ref().expect("there is one").best;
    assert!((best(own) / best(other) - 1.0).abs() < 1e-8, "{} and {}", best(own), best(other));
    let values = |result: &RunResult| result.design.as_ref().expect("there is one").values_m.clone();
    let difference = values(own).iter().zip(values(other)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // Bounds are 25 mm apart.
    assert!(difference < 1e-8 * 25e-3, "{difference:e} m");
}

#[test]
fn a_run_on_ranks_takes_the_same_evaluations_and_writes_its_fields_in_pieces() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let alone = run(&folder.path().join("alone"), 0, Task::Run);
    for size in [1, 3] {
        let directory = folder.path().join(format!("ranks{size}"));
        let shared = run(&directory, size, Task::Run);
        assert_same(&shared, &alone);
        let manifest = std::fs::read_to_string(directory.join("manifest.json")).expect("written");
        assert!(manifest.contains(&format!("\"ranks\": {size}")), "{manifest}");
        for evaluation in 0..alone.evaluations {
            for rank in 0..size {
                let piece = directory.join(format!("fields/eval_{evaluation:04}/rank_{rank:03}.vtu"));
                assert!(piece.is_file(), "{}", piece.display());
            }
        }
        let collection = std::fs::read_to_string(directory.join("fields.pvd")).expect("written");
        assert_eq!(collection.matches(".pvtu\"").count(), alone.evaluations, "{collection}");
    }
    // The page of either has the same figures.
    let page = |name: &str| {
        let directory = folder.path().join(name);
        let path =
            ReportedRun::open(&system_disk(), &directory).and_then(|run| run.write(None)).expect("a page");
        std::fs::read_to_string(path).expect("written")
    };
    let figures = |page: String| page.matches("<figure").count();
    assert_eq!(figures(page("alone")), figures(page("ranks3")));
}

#[test]
fn a_run_that_was_broken_off_goes_on_with_the_same_ranks_with_others_and_with_none() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole = run(&folder.path().join("whole"), 2, Task::Run);
    for (begun, size) in [(2, 2), (2, 3), (2, 0), (0, 2)] {
        let directory = folder.path().join(format!("from{begun}to{size}"));
        let cut = run(&directory, begun, Task::BreakOff(5));
        assert!(cut.stop_reason == StopReason::Interrupted && cut.evaluations < whole.evaluations);
        assert_same(&run(&directory, size, Task::Resume), &whole);
    }
}

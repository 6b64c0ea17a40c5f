//! What a run directory holds after a failure or a panic.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use fluxmorph::files::system_disk;
use fluxmorph::run::{self, RunLimits, SavedRun};
use fluxmorph::show::{Evaluation, Observer, RunObserver, Silent};

use crate::support::folder::read_json;
use crate::support::{config, options};

/// Panics at a given evaluation.
struct Faulty {
    at: usize,
}

impl Observer for Faulty {
    fn evaluation(&mut self, evaluation: &Evaluation) {
        assert!(evaluation.evaluation != self.at, "a fault of the program");
    }
}

impl RunObserver for Faulty {}

/// A run of a few evaluations in a directory, with an observer.
fn run(directory: &Path, observer: &mut dyn RunObserver) -> Result<(), fluxmorph::Error> {
    let overrides = ["output.verify_refinement=0", "output.fields=every"];
    let (mut config, source) = config("shield_quick.toml", &overrides);
    config.output.directory = directory.to_owned();
    run::run(&config, &source, options(&system_disk()), observer).map(drop)
}

#[test]
fn a_panic_leaves_a_failed_manifest_whole_files_and_a_run_that_can_be_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let [broken, sound] = ["broken", "sound"].map(|name| folder.path().join(name));
    let caught = catch_unwind(AssertUnwindSafe(|| run(&broken, &mut Faulty { at: 2 })));
    assert!(caught.is_err(), "the panic is not swallowed");
    assert_eq!(read_json(&broken.join("manifest.json"))["status"], "failed");
    assert!(!broken.join("result.json").exists());
    let history = std::fs::read_to_string(broken.join("history.csv")).unwrap();
    assert_eq!(history.lines().count(), 4);
    for evaluation in 0..3 {
        fluxmorph_geometry::io::read_vtu(&broken.join(format!("fields/eval_{evaluation:04}.vtu"))).unwrap();
    }
    // Its evaluations are not lost.
    let disk = system_disk();
    let limits = RunLimits { max_evaluations: None, max_time: None };
    let resumed =
        run::resume(&SavedRun::open(&disk, &broken).unwrap(), limits, options(&disk), &mut Silent).unwrap();
    run(&sound, &mut Silent).unwrap();
    let expected = read_json(&sound.join("result.json"));
    assert_eq!(expected["objective"], read_json(&broken.join("result.json"))["objective"]);
    assert_eq!(Some(resumed.evaluations as u64), expected["evaluations"].as_u64());
}

#[test]
fn a_panic_before_the_first_evaluation_is_kept_leaves_a_failed_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken");
    assert!(catch_unwind(AssertUnwindSafe(|| run(&broken, &mut Faulty { at: 0 }))).is_err());
    assert_eq!(read_json(&broken.join("manifest.json"))["status"], "failed");
}

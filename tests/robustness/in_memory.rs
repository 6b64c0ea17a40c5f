//! Small devices run through the library, on any disk; a run takes milliseconds.

use std::path::PathBuf;
use std::sync::Arc;

use fluxmorph::Error;
use fluxmorph::config::{Config, SourceMap};
use fluxmorph::files::{Disk, OverwritePolicy, RunResult};
use fluxmorph::run::{self, Options, RunLimits, SavedRun};
use fluxmorph::show::Silent;

use crate::support::device::{BLOCK, CONSTRAINT, THROUGH_THE_GAP};
use crate::support::{self, changed, parsed};

/// Where the runs write.
pub(crate) const FOLDER: &str = "/runs/block";

fn into_folder((mut config, source): (Config, SourceMap)) -> (Config, SourceMap) {
    config.output.directory = PathBuf::from(FOLDER);
    (config, source)
}

/// The block with some texts replaced.
pub(crate) fn block(changes: &[(&str, &str)]) -> (Config, SourceMap) {
    into_folder(parsed(&changed(BLOCK, changes)))
}

/// The block with a bound on its volume.
pub(crate) fn constrained() -> (Config, SourceMap) {
    block(&[CONSTRAINT])
}

/// The block on one of the laws that are not the default, with a face that the mesh does not carry to its bound.
pub(crate) fn moved_by(law: (&str, &str)) -> (Config, SourceMap) {
    block(&[
        law,
        THROUGH_THE_GAP,
        ("max_evaluations = 6", "max_evaluations = 12"),
        ("verify_refinement = 0", "verify_refinement = 0\nfields = \"improved\""),
    ])
}

/// The block with a face that the mesh does not carry to its bound: on rails, steps are cut short.
pub(crate) fn throttled() -> (Config, SourceMap) {
    block(&[THROUGH_THE_GAP, ("max_evaluations = 6", "max_evaluations = 12")])
}

/// A shipped configuration, without the check on a fresh mesh.
pub(crate) fn shipped(name: &str) -> (Config, SourceMap) {
    into_folder(support::config(name, &["output.verify_refinement=0"]))
}

/// Runs a configuration from its start.
pub(crate) fn run(disk: &Arc<dyn Disk>, (config, source): &(Config, SourceMap)) -> Result<RunResult, Error> {
    let options = Options { overwrite_policy: OverwritePolicy::Replace, ..support::options(disk) };
    run::run(config, source, options, &mut Silent)
}

/// Goes on with the run on a disk.
pub(crate) fn resume(disk: &Arc<dyn Disk>, limits: RunLimits) -> Result<RunResult, Error> {
    run::resume(&SavedRun::open(disk, FOLDER.as_ref())?, limits, support::options(disk), &mut Silent)
}

//! Small devices whose runs take milliseconds.

use std::path::PathBuf;
use std::sync::Arc;

use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::config::{Config, SourceMap};
use fluxmorph_optimizer::observer::Silent;
use fluxmorph_optimizer::output::{Disk, OlderRun, RunResult};
use fluxmorph_optimizer::session::{self, Limits, Options, SavedRun};

/// An iron block over a gap in a uniform field; its lower face moves.
const BLOCK: &str = include_str!("block.toml");

/// Where the runs write.
pub(crate) const FOLDER: &str = "/runs/block";

/// The block with some texts replaced.
pub(crate) fn block(changes: &[(&str, &str)]) -> (Config, SourceMap) {
    let mut text = BLOCK.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let (mut config, source) = Config::from_str(&text, "block.toml").unwrap_or_else(|e| panic!("{e}"));
    config.output.directory = PathBuf::from(FOLDER);
    (config, source)
}

/// The block with a bound on its volume.
pub(crate) fn constrained() -> (Config, SourceMap) {
    block(&[(
        "[design]",
        "[[constraints]]\nkind = \"volume\"\nregion = \"iron\"\nupper_ratio = 1.02\n\n[design]",
    )])
}

/// The block with steps so cautious that the mesh has several references.
pub(crate) fn with_rounds() -> (Config, SourceMap) {
    block(&[
        ("slide = [", "rounds = 4\ninversion_share = 0.1\nslide = ["),
        ("max_evaluations = 6", "max_evaluations = 12"),
        ("ftol_rel = 0", "ftol_rel = 1e-4"),
        ("verify_refinement = 0", "verify_refinement = 0\nfields = \"improved\""),
    ])
}

/// A shipped configuration.
pub(crate) fn shipped(name: &str) -> (Config, SourceMap) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("configs").join(name);
    let (mut config, source) = Config::from_file(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
    config.output.directory = PathBuf::from(FOLDER);
    (config, source)
}

/// Runs a configuration from its start.
pub(crate) fn run(disk: &Arc<dyn Disk>, (config, source): &(Config, SourceMap)) -> Result<RunResult, Error> {
    let options =
        Options { disk, older_run: OlderRun::Replace, threads: 1, team: None, interrupted: &|| false };
    session::run(config, source, options, &mut Silent)
}

/// Goes on with the run on a disk.
pub(crate) fn resume(disk: &Arc<dyn Disk>, limits: Limits) -> Result<RunResult, Error> {
    let options = Options { disk, older_run: OlderRun::Keep, threads: 1, team: None, interrupted: &|| false };
    session::resume(SavedRun::open(disk, FOLDER.as_ref())?, limits, options, &mut Silent)
}

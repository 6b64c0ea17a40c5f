//! Small devices whose runs take milliseconds.

use std::path::PathBuf;
use std::sync::Arc;

use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::config::{Config, Source};
use fluxmorph_optimizer::observer::Silent;
use fluxmorph_optimizer::output::{Disk, OlderRun, RunResult};
use fluxmorph_optimizer::session::{self, Limits, Options};

/// An iron block over a gap in a uniform field; its lower face moves.
const BLOCK: &str = r#"
title = "Block over a gap"

[mesh]
generator = "boxes"

[mesh.boxes]
box = [["0 mm", "0 mm", "0 mm"], ["30 mm", "30 mm", "40 mm"]]

[[mesh.boxes.regions]]
name = "observation"
box = [["0 mm", "0 mm", "0 mm"], ["10 mm", "10 mm", "10 mm"]]
cells = [1, 1, 1]

[[mesh.boxes.regions]]
name = "gap"
box = [["0 mm", "0 mm", "10 mm"], ["20 mm", "20 mm", "20 mm"]]
cells = [2, 2, 1]

[[mesh.boxes.regions]]
name = "iron"
box = [["0 mm", "0 mm", "20 mm"], ["20 mm", "20 mm", "30 mm"]]
cells = [2, 2, 1]

[[mesh.boxes.surfaces]]
name = "face"
box = [["0 mm", "0 mm", "20 mm"], ["20 mm", "20 mm", "20 mm"]]

[analysis]
frequency = "50 Hz"

[materials.iron]
relative_permeability = 100
conductivity = "1e6 S/m"

[regions.iron]
material = "iron"

[boundaries]
flux_parallel = ["x_min", "y_min"]
flux_normal = ["z_min"]
uniform_field = { surfaces = ["x_max", "y_max", "z_max"], b = [0.0, 0.0, 0.1] }

[objective]
kind = "flux_density_squared"
region = "observation"
weighting = "volume"

[design]
surface = "face"
direction = [0.0, 0.0, -1.0]
lower = "-4 mm"
upper = "4 mm"

[remesh]
region = ["gap", "iron"]
slide = ["x_min", "y_min"]

[optimizer]
algorithm = "mma"
max_evaluations = 6
ftol_rel = 0

[output]
verify_refinement = 0
"#;

/// Where the runs write.
pub(crate) const FOLDER: &str = "/runs/block";

/// The block with some texts replaced.
pub(crate) fn block(changes: &[(&str, &str)]) -> (Config, Source) {
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
pub(crate) fn constrained() -> (Config, Source) {
    block(&[(
        "[design]",
        "[[constraints]]\nkind = \"volume\"\nregion = \"iron\"\nupper_ratio = 1.02\n\n[design]",
    )])
}

/// The block with steps so cautious that the mesh has several references.
pub(crate) fn with_rounds() -> (Config, Source) {
    block(&[
        ("slide = [", "rounds = 4\ninversion_share = 0.1\nslide = ["),
        ("max_evaluations = 6", "max_evaluations = 12"),
        ("ftol_rel = 0", "ftol_rel = 1e-4"),
        ("verify_refinement = 0", "verify_refinement = 0\nfields = \"improved\""),
    ])
}

/// A shipped configuration.
pub(crate) fn shipped(name: &str) -> (Config, Source) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("configs").join(name);
    let (mut config, source) = Config::from_file(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
    config.output.directory = PathBuf::from(FOLDER);
    (config, source)
}

/// Runs a configuration from its start.
pub(crate) fn run(disk: &Arc<dyn Disk>, (config, source): &(Config, Source)) -> Result<RunResult, Error> {
    let options = Options { disk, older_run: OlderRun::Replace, threads: 1, interrupted: &|| false };
    session::run(config, source, options, &mut Silent)
}

/// Goes on with the run on a disk.
pub(crate) fn resume(disk: &Arc<dyn Disk>, limits: Limits) -> Result<RunResult, Error> {
    let options = Options { disk, older_run: OlderRun::Keep, threads: 1, interrupted: &|| false };
    session::resume(FOLDER.as_ref(), limits, options, &mut Silent)
}

//! The program on several ranks as a user starts it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use fluxmorph::files::{RunDirectory, system_disk};
use fluxmorph::run::journal::Journal;
use fluxmorph_optimizer::driver::Record;
use fluxmorph_optimizer::problem::SEARCH_ADJOINT_TOLERANCE;

use crate::support::folder::read_json;
use crate::support::program::{Finished, finish};
use crate::support::{relative_difference, repository};

/// A meshed plate, coarse; a few evaluations with all fields, and no fresh mesh.
pub(crate) const COARSE: [&str; 6] = [
    "mesh.shield.refinement=0.3",
    "mesh.shield.growth=2.5",
    "mesh.shield.skin=[4e-4,1.2e-3,2.5e-3,5e-3]",
    "optimizer.max_evaluations=6",
    "output.verify_refinement=0",
    "output.report=false",
];

/// `mpirun -n RANKS PROGRAM`, ready for the arguments; none for 0 ranks.
pub(crate) fn ranks(count: usize, program: &Path) -> Command {
    let mut command = match count {
        0 => Command::new(program),
        _ => {
            let mut command = Command::new("mpirun");
            command.args(["-n", &count.to_string()]).arg(program);
            command
        }
    };
    // More ranks than cores, and the first user of a container, are not what Open MPI expects.
    command
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMP_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// The program itself on so many ranks.
pub(crate) fn fluxmorph(count: usize) -> Command {
    ranks(count, Path::new(env!("CARGO_BIN_EXE_fluxmorph")))
}

/// `fluxmorph COMMAND configs/NAME --out DIR` with overrides.
pub(crate) fn on(count: usize, command: &str, name: &str, out: &Path, overrides: &[&str]) -> Command {
    let mut program = fluxmorph(count);
    program.arg(command).arg(repository("configs").join(name)).arg("--out").arg(out);
    for setting in overrides {
        program.args(["--set", setting]);
    }
    program
}

/// Lets a command come to the end of its work: converged, done, or at a limit.
#[track_caller]
pub(crate) fn completed(command: &mut Command) -> Finished {
    finish(command).completed()
}

/// The evaluations of a run.
pub(crate) fn records(directory: &Path) -> Vec<Record> {
    let directory = RunDirectory::open(&system_disk(), directory).expect("a run directory");
    Journal::read_records(&directory).expect("it is read")
}

/// `result.json` of a run.
pub(crate) fn result(directory: &Path) -> serde_json::Value {
    read_json(&directory.join("result.json"))
}

/// The objectives of all evaluations agree to 1e-8, their gradients to what the adjoints of a search leave, ten times their residual,
/// and there are as many.
#[track_caller]
pub(crate) fn assert_same(own: &Path, other: &Path) {
    let (own, other) = (records(own), records(other));
    assert_eq!(own.len(), other.len());
    for (a, b) in own.iter().zip(&other) {
        let objective = (a.row.objective / b.row.objective - 1.0).abs();
        let gradient = relative_difference(&a.gradient, &b.gradient);
        let evaluation = a.row.evaluation;
        let is_same = objective < 1e-8 && gradient < 10.0 * SEARCH_ADJOINT_TOLERANCE;
        assert!(is_same, "{evaluation}: {objective:e} and {gradient:e}");
    }
}

/// A file of a run directory.
pub(crate) fn field(directory: &Path, name: &str) -> PathBuf {
    directory.join("fields").join(name)
}

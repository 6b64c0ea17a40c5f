//! `fluxmorph run` and `fluxmorph resume`.

use std::path::Path;

use super::args::{ResumeArgs, RunArgs};
use super::exit::ExitCode;
use super::interrupt::{self, Signal};
use super::{observer, stdout, with_threads};
use crate::error::Error;
use crate::observer::Observer;
use crate::output::{OlderRun, RunResult, StopReason, system_disk};
use crate::session::{self, Limits, Options};

/// Do what the command line says.
///
/// # Errors
/// When the configuration, the files or the numbers fail; the error knows its exit code.
pub(super) fn run(args: &RunArgs) -> Result<ExitCode, Error> {
    let (config, source) = args.load()?;
    let signal = interrupt::watch(interrupt::FINISHES_EVALUATION);
    with_threads(args.common.threads, |threads| {
        let interrupted = || signal.received().is_some();
        let disk = system_disk();
        let older_run = args.common.older_run();
        let options = Options { disk: &disk, older_run, threads, interrupted: &interrupted };
        let mut observer = observer(args.common.quiet);
        let result = session::run(&config, &source, options, &mut *observer);
        concluded(result, &config.output.directory, args.common.json, &signal, &mut *observer)
    })
}

/// Do what the command line says.
///
/// # Errors
/// As [`run`].
pub(super) fn resume(args: &ResumeArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_EVALUATION);
    with_threads(args.threads, |threads| {
        let interrupted = || signal.received().is_some();
        let disk = system_disk();
        let options = Options { disk: &disk, older_run: OlderRun::Keep, threads, interrupted: &interrupted };
        let limits = Limits { max_evaluations: args.max_evaluations, max_time: args.max_time };
        let mut observer = observer(args.quiet);
        let result = session::resume(&args.directory, limits, options, &mut *observer);
        concluded(result, &args.directory, args.json, &signal, &mut *observer)
    })
}

/// Prints the result, and how to go on.
fn concluded(
    result: Result<RunResult, Error>,
    directory: &Path,
    json: bool,
    signal: &Signal,
    observer: &mut dyn Observer,
) -> Result<ExitCode, Error> {
    let result = result.inspect_err(|error| {
        if error.leaves_a_run() && directory.join("journal.bin").exists() {
            observer.warning(&format!("what was computed is kept: {}", how_to_resume(directory)));
        }
    })?;
    if json {
        stdout::print_json(&result)?;
    }
    let interrupted = result.stop_reason == StopReason::Interrupted;
    match result.stop_reason {
        StopReason::Interrupted | StopReason::MaxTime => {
            observer.warning(&format!("all evaluations are saved: {}", how_to_resume(directory)));
        }
        StopReason::MaxEvaluations => observer.note(&format!(
            "to go on from here: {} --max-evaluations {}",
            command(directory),
            2 * result.evaluations
        )),
        _ => {}
    }
    // A signal that came too late to stop anything does not change how the run ended.
    let stopped_by = signal.received().filter(|_| interrupted);
    Ok(stopped_by.unwrap_or_else(|| result.stop_reason.exit_code()))
}

fn how_to_resume(directory: &Path) -> String {
    format!("go on with `{}`", command(directory))
}

/// The command that goes on with a run, as a shell takes it.
fn command(directory: &Path) -> String {
    let path = directory.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:@%".contains(c);
    if path.chars().all(is_plain) {
        format!("fluxmorph resume {path}")
    } else {
        format!("fluxmorph resume '{}'", path.replace('\'', "'\\''"))
    }
}

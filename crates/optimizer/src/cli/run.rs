//! `fluxmorph run` and `fluxmorph resume`.

use std::path::Path;

use super::args::{ResumeArgs, RunArgs};
use super::exit::ExitCode;
use super::interrupt::{self, Signal};
use super::{observer, stdout, with_threads};
use crate::config::OutputNamedBy;
use crate::error::Error;
use crate::memory_limit;
use crate::observer::Observer;
use crate::output::{RunResult, RunStatus, StopReason, resume_command, system_disk};
use crate::session::{self, Limits, Options, SavedRun};

/// Do what the command line says.
///
/// # Errors
/// When the configuration, the files or the numbers fail; the error knows its exit code.
pub(super) fn run(args: &RunArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_EVALUATION);
    let (config, source) = args.load()?;
    let outcome = with_threads(args.common.work.threads, |threads| {
        let interrupted = || signal.received().is_some();
        let disk = system_disk();
        let older_run = args.common.older_run();
        let options = Options { disk: &disk, older_run, threads, interrupted: &interrupted };
        let mut observer = observer(&args.common.work);
        let result = session::run(&config, &source, options, &mut *observer);
        concluded(result, &config.output.directory, args.common.work.json, &signal, &mut *observer)
    });
    signal.ended(outcome)
}

/// Do what the command line says.
///
/// # Errors
/// As [`run`].
pub(super) fn resume(args: &ResumeArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_EVALUATION);
    let outcome = with_threads(args.work.threads, |threads| {
        let interrupted = || signal.received().is_some();
        let disk = system_disk();
        let saved = SavedRun::open(&disk, &args.directory)?;
        let (config, source) = saved.config();
        if !args.work.allow_outside {
            source.confined(OutputNamedBy::User)?;
        }
        if !args.work.force {
            memory_limit::check_mesh(config, source)?;
        }
        let older_run = args.work.older_run();
        let options = Options { disk: &disk, older_run, threads, interrupted: &interrupted };
        let limits = Limits { max_evaluations: args.limits.max_evaluations, max_time: args.limits.max_time };
        let mut observer = observer(&args.work);
        let result = session::resume(saved, limits, options, &mut *observer);
        concluded(result, &args.directory, args.work.json, &signal, &mut *observer)
    });
    signal.ended(outcome)
}

/// Prints the result, and how to go on.
fn concluded(
    result: Result<RunResult, Error>,
    directory: &Path,
    json: bool,
    signal: &Signal,
    observer: &mut dyn Observer,
) -> Result<ExitCode, Error> {
    let result = result?;
    if json {
        stdout::print_json(&result)?;
    }
    // The search may have ended by itself, and the check of its result not.
    let interrupted = result.status == RunStatus::Interrupted;
    match result.stop_reason {
        reason if interrupted || reason == StopReason::MaxTime => {
            observer
                .warning(&format!("all evaluations are saved: go on with `{}`", resume_command(directory)));
        }
        StopReason::MaxEvaluations => observer.note(&format!(
            "to go on from here: {} --max-evaluations {}",
            resume_command(directory),
            2 * result.evaluations
        )),
        _ => {}
    }
    // A signal that came too late to stop anything does not change how the run ended.
    let stopped_by = signal.received().filter(|_| interrupted);
    Ok(stopped_by.unwrap_or_else(|| result.stop_reason.exit_code()))
}

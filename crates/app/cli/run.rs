//! `fluxmorph run` and `fluxmorph resume`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use super::args::{ResumeArgs, RunArgs};
use super::interrupt::{self, Signal};
use super::ranks::on_all;
use super::stdout;
use crate::build::{Mode, memory_limit};
use crate::config::OutputNamedBy;
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{RunDirectory, RunStatus, StopReason, extend_command, resume_command, system_disk};
use crate::run::{self, Concluded, Options, RunLimits, SavedRun};
use crate::show::RunObserver;
use crate::show::report::ReportedRun;

/// Do what the command line says.
pub(super) fn run(args: &RunArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_AND_SAVES);
    let (config, source) = args.load()?;
    let work = &args.common.work;
    let page = |held: &RunDirectory| page_so_far(config.output.report, held);
    on_all((&config, &source, Mode::Optimisation), work, &signal, |options, mut observer| {
        let options = Options { searched: &page, ..options };
        let result = run::run_held(&config, &source, options, &mut *observer);
        let ended =
            Ended { directory: &config.output.directory, report: config.output.report, json: work.json };
        conclude(result, &ended, &signal, &mut *observer)
    })
}

/// Do what the command line says.
pub(super) fn resume(args: &ResumeArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_AND_SAVES);
    let saved = SavedRun::open(&system_disk(), &args.directory)?;
    let (config, source) = saved.config();
    let page = |held: &RunDirectory| page_so_far(config.output.report, held);
    on_all((config, source, Mode::Optimisation), &args.work, &signal, |options, mut observer| {
        if !args.work.allow_outside {
            source.confined(OutputNamedBy::User)?;
        }
        if !args.work.force {
            memory_limit::check_mesh(config, source)?;
        }
        let limits =
            RunLimits { max_evaluations: args.limits.max_evaluations, max_time: args.limits.max_time };
        let options = Options { searched: &page, ..options };
        let result = run::resume_held(&saved, limits, options, &mut *observer);
        let ended = Ended { directory: &args.directory, report: config.output.report, json: args.work.json };
        conclude(result, &ended, &signal, &mut *observer)
    })
}

/// The page about what a directory holds; the panic where there is a bug in it.
fn page(held: RunDirectory) -> std::thread::Result<Result<PathBuf, Error>> {
    catch_unwind(AssertUnwindSafe(|| ReportedRun::of(held)?.write(None)))
}

/// The same before the checks of a run; what is in its way is said at the end.
fn page_so_far(is_wanted: bool, held: &RunDirectory) -> Option<PathBuf> {
    is_wanted.then(|| page(held.clone()).ok()?.ok()).flatten()
}

/// What to do when a run has ended.
struct Ended<'a> {
    directory: &'a Path,
    /// Whether there is to be a report.
    report: bool,
    json: bool,
}

/// Prints the result, writes the report, and says how to continue.
fn conclude(
    concluded: Result<Concluded, Error>,
    ended: &Ended<'_>,
    signal: &Signal,
    observer: &mut dyn RunObserver,
) -> Result<ExitCode, Error> {
    let Concluded { result, directory: held, is_saved } = concluded?;
    let directory = ended.directory;
    // Whoever reads standard output may have no room for it: what belongs into the directory comes there all the same.
    let printed = if ended.json { stdout::print_json(&result) } else { Ok(()) };
    if ended.report {
        // The result is worth more than a page about it: not even a bug in the page changes how the run ends.
        match page(held) {
            Ok(Ok(path)) => observer.note(&format!("report: {}", path.display())),
            Ok(Err(error)) => observer.warning(&format!("the report is not written: {error}")),
            Err(_) => observer.warning("the report is not written: a bug in the program, shown above"),
        }
    }
    // The search may have ended by itself, and the check of its result not.
    let interrupted = result.status == RunStatus::Interrupted;
    match result.stop_reason {
        reason if interrupted || reason == StopReason::MaxTime => {
            let what = if is_saved { "all evaluations are saved: " } else { "" };
            observer.warning(&format!("{what}resume with `{}`", resume_command(directory)));
        }
        StopReason::MaxEvaluations => {
            observer.note(&format!("to continue: {}", extend_command(directory, result.evaluations)))
        }
        _ => {}
    }
    printed?;
    // A signal that came too late to stop anything does not change how the run ended.
    let stopped_by = signal.received().filter(|_| interrupted);
    Ok(stopped_by.unwrap_or_else(|| result.stop_reason.into()))
}

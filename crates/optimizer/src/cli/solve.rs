//! `fluxmorph solve`.

use super::args::SolveArgs;
use super::exit::ExitCode;
use super::{interrupt, observer, stdout, with_threads};
use crate::error::Error;
use crate::output::{read_design, system_disk};
use crate::session::{self, Options};
use crate::setup::variable_count;

/// Do what the command line says.
///
/// # Errors
/// When the configuration, the files or the numbers fail; the error knows its exit code.
pub(super) fn solve(args: &SolveArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_WORK);
    let (config, source) = args.common.load()?;
    let outcome = with_threads(args.common.work.threads, |threads| {
        let interrupted = || signal.received().is_some();
        let design = match &args.design {
            Some(path) => Some(read_design(path, variable_count(&config, &source)?)?),
            None => None,
        };
        let disk = system_disk();
        let older_run = args.common.older_run();
        let options = Options { disk: &disk, older_run, threads, interrupted: &interrupted };
        let result = session::solve(&config, &source, design, options, &mut *observer(&args.common.work))?;
        if args.common.work.json {
            stdout::print_json(&result)?;
        }
        // An analysis that has begun is finished and saved; then the signal decides the exit code.
        Ok(signal.received().unwrap_or_else(|| result.stop_reason.exit_code()))
    });
    signal.ended(outcome)
}

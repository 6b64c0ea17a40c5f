//! `fluxmorph solve`.

use super::args::SolveArgs;
use super::ranks::Ranks;
use super::{interrupt, observer, stdout, with_threads};
use crate::build::{Mode, variable_count};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{read_design, system_disk};
use crate::run::{self, Options};

/// Do what the command line says.
///
/// # Errors
/// When the configuration, the files or the numbers fail; the error knows its exit code.
pub(super) fn solve(args: &SolveArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_WORK);
    let (config, source) = args.common.load()?;
    let ranks = Ranks::join(&config, signal.number())?;
    let outcome = with_threads(ranks.threads(args.common.work.threads), |threads| {
        if let Some(code) = ranks.run_worker(&config, &source, Mode::Analysis) {
            return Ok(code);
        }
        let interrupted = || signal.received().is_some() || ranks.are_signalled(signal.number());
        let design = match &args.design {
            Some(path) => Some(read_design(path, variable_count(&config, &source)?)?),
            None => None,
        };
        let disk = system_disk();
        let overwrite_policy = args.common.overwrite_policy();
        let group = ranks.group();
        let options =
            Options { disk: &disk, overwrite_policy, threads, ranks: group, interrupted: &interrupted };
        let result = run::solve(&config, &source, design, options, &mut *observer(&args.common.work))?;
        if args.common.work.json {
            stdout::print_json(&result)?;
        }
        // An analysis that has begun is finished and saved; then the signal decides the exit code.
        Ok(signal.received().unwrap_or_else(|| result.stop_reason.into()))
    });
    signal.exit_code_of(outcome)
}

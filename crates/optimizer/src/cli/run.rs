//! `fluxmorph run`.

use super::args::RunArgs;
use super::exit::ExitCode;
use super::{interrupt, observer, stdout, with_threads};
use crate::error::Error;
use crate::output::StopReason;
use crate::session::{self, Options};

/// Do what the command line says.
///
/// # Errors
/// When the configuration, the files or the numbers fail; the error knows its exit code.
pub(super) fn run(args: &RunArgs) -> Result<ExitCode, Error> {
    let (config, source) = args.load()?;
    with_threads(args.common.threads, |threads| {
        let signal = interrupt::watch();
        let interrupted = || signal.received().is_some();
        let options = Options { older_run: args.common.older_run(), threads, interrupted: &interrupted };
        let result = session::run(&config, &source, options, &mut *observer(args.common.quiet))?;
        if args.common.json {
            stdout::print_json(&result)?;
        }
        // A signal that came too late to stop anything does not change how the run ended.
        let stopped_by = signal.received().filter(|_| result.stop_reason == StopReason::Interrupted);
        Ok(stopped_by.unwrap_or_else(|| result.stop_reason.exit_code()))
    })
}

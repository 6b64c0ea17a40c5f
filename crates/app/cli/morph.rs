//! `fluxmorph morph`.

use fluxmorph_optimizer::driver::StopReason;

use super::args::MorphArgs;
use super::{interrupt, observer, stdout, with_threads};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::system_disk;
use crate::run::Options;
use crate::run::morph::{self, Parameters};

/// Do what the command line says.
pub(super) fn morph(args: &MorphArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_WORK);
    let (config, source) = args.common.load()?;
    let parameters = if args.tune { Parameters::Tuned } else { Parameters::Given };
    with_threads(args.common.work.threads, |threads| {
        let interrupted = || signal.received().is_some();
        let disk = system_disk();
        let overwrite_policy = args.common.overwrite_policy();
        let options = Options {
            disk: &disk,
            overwrite_policy,
            threads,
            ranks: None,
            interrupted: &interrupted,
            searched: &|_| None,
        };
        let report = morph::morph(&config, &source, parameters, options, &mut *observer(&args.common.work))?;
        if args.common.work.json {
            stdout::print_json(&report)?;
        } else {
            stdout::print(&morph::text(&report))?;
        }
        // A signal that came too late to leave anything out does not change how the command ended.
        let stopped_by = signal.received().filter(|_| report.stop_reason == StopReason::Interrupted);
        Ok(stopped_by.unwrap_or_else(|| report.exit_code()))
    })
}

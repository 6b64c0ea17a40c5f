//! `fluxmorph morph`.

use super::args::MorphArgs;
use super::exit::ExitCode;
use super::{observer, stdout, with_threads};
use crate::error::Error;
use crate::morph::{self, Parameters};

/// Do what the command line says.
///
/// # Errors
/// When the configuration, the files or the numbers fail; a mesh that a motion breaks is a result.
pub(super) fn morph(args: &MorphArgs) -> Result<ExitCode, Error> {
    let (config, source) = args.common.load()?;
    let parameters = if args.tune { Parameters::Tuned } else { Parameters::Given };
    with_threads(args.common.threads, |threads| {
        let target = (args.common.older_run(), threads);
        let report = morph::morph(&config, &source, parameters, target, &mut *observer(args.common.quiet))?;
        if args.common.json {
            stdout::print_json(&report)?;
        } else {
            stdout::print(&morph::text(&report))?;
        }
        Ok(report.exit_code())
    })
}

//! `fluxmorph report`: one HTML page from a run directory.

use super::args::ReportArgs;
use crate::build::memory_limit;
use crate::config::OutputNamedBy;
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::system_disk;
use crate::show::report::ReportedRun;
use crate::show::{Console, Observer};

/// Do what the command line says.
pub(super) fn report(args: &ReportArgs) -> Result<ExitCode, Error> {
    let run = ReportedRun::open(&system_disk(), &args.directory)?;
    let (config, source) = run.config();
    if !args.allow_outside {
        source.confined(OutputNamedBy::User)?;
    }
    if !args.force {
        memory_limit::check_mesh(config, source)?;
    }
    let path = run.write(args.out.as_deref())?;
    if !args.quiet {
        Console::stderr().note(&format!("report: {}", path.display()));
    }
    Ok(ExitCode::Success)
}

//! `fluxmorph report`: one HTML page from a run directory.

use super::args::ReportArgs;
use super::exit::ExitCode;
use crate::error::Error;
use crate::observer::{Console, Observer};
use crate::output::system_disk;
use crate::report;

/// Do what the command line says.
///
/// # Errors
/// When the directory holds no run, its files are damaged, or the page cannot be written.
pub(super) fn report(args: &ReportArgs) -> Result<ExitCode, Error> {
    let path = report::write(&system_disk(), &args.directory, args.out.as_deref())?;
    if !args.quiet {
        Console::stderr().note(&format!("report: {}", path.display()));
    }
    Ok(ExitCode::Success)
}

//! `fluxmorph solve`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::args::SolveArgs;
use super::ranks::Ranks;
use super::{interrupt, observer, stdout, with_threads};
use crate::build::{Mode, variable_count};
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{Manifest, RunDirectory, read_design, system_disk};
use crate::run::{self, Options};

/// The configuration to analyse, and the design file: of the result of a run, its configuration and its design.
///
/// # Errors
/// When the configuration or the run directory cannot be read or is wrong.
fn subject(args: &SolveArgs) -> Result<(Config, SourceMap, Option<PathBuf>), Error> {
    let path = &args.common.config;
    if path.file_name() != Some(OsStr::new("result.json")) {
        let (config, source) = args.common.load()?;
        return Ok((config, source, args.design.clone()));
    }
    // A bare name has an empty folder.
    let folder = std::path::absolute(path).unwrap_or_else(|_| path.clone());
    let folder = folder.parent().unwrap_or(Path::new("."));
    let directory = RunDirectory::open(&system_disk(), folder)?;
    let mut manifest = Manifest::read(&directory)?;
    manifest.overrides.extend(args.common.overrides.iter().cloned());
    let (mut config, source) = run::configuration(&directory, &manifest)?;
    // Not into the run, which would have to be replaced.
    let mut beside = folder.as_os_str().to_owned();
    beside.push("_solved");
    config.output.directory = beside.into();
    let (config, source) = args.common.checked(config, source)?;
    Ok((config, source, Some(args.design.clone().unwrap_or_else(|| path.clone()))))
}

/// Do what the command line says.
///
/// # Errors
/// When the configuration, the files or the numbers fail; the error knows its exit code.
pub(super) fn solve(args: &SolveArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_WORK);
    let (config, source, design) = subject(args)?;
    let ranks = Ranks::join(&config, signal.number())?;
    let outcome = with_threads(ranks.threads(args.common.work.threads), |threads| {
        if let Some(code) = ranks.run_worker(&config, &source, Mode::Analysis) {
            return Ok(code);
        }
        let interrupted = || signal.received().is_some() || ranks.are_signalled(signal.number());
        let design = match &design {
            Some(path) => Some(read_design(path, variable_count(&config, &source)?)?),
            None => None,
        };
        let disk = system_disk();
        let overwrite_policy = args.common.overwrite_policy();
        let group = ranks.group();
        let options =
            Options { disk: &disk, overwrite_policy, threads, ranks: group, interrupted: &interrupted };
        let design = (design, args.refine);
        let result = run::solve(&config, &source, design, options, &mut *observer(&args.common.work))?;
        if args.common.work.json {
            stdout::print_json(&result)?;
        }
        // An analysis that has begun is finished and saved; then the signal decides the exit code.
        Ok(signal.received().unwrap_or_else(|| result.stop_reason.into()))
    });
    signal.exit_code_of(outcome)
}

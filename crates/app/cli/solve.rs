//! `fluxmorph solve`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::args::SolveArgs;
use super::ranks::on_all;
use super::{interrupt, stdout};
use crate::build::{Mode, variable_count};
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{Manifest, RunDirectory, RunOfDesign, read_design, system_disk};
use crate::run;

/// What is analysed.
struct Subject {
    config: Config,
    source: SourceMap,
    /// The file of the design; `None` for the initial one.
    design: Option<PathBuf>,
    /// The run of the configuration; `None` without one.
    of_run: Option<RunOfDesign>,
}

/// The configuration to analyse, and the design file: of the result of a run, its configuration and its design.
fn subject(args: &SolveArgs) -> Result<Subject, Error> {
    let path = &args.common.config;
    if path.file_name() != Some(OsStr::new("result.json")) {
        let (config, source) = args.common.load()?;
        return Ok(Subject { config, source, design: args.design.clone(), of_run: None });
    }
    // A bare name has an empty folder.
    let folder = std::path::absolute(path).unwrap_or_else(|_| path.clone());
    let folder = folder.parent().unwrap_or(Path::new("."));
    let directory = RunDirectory::open(&system_disk(), folder)?;
    let mut manifest = Manifest::read(&directory)?;
    manifest.overrides.extend(args.common.overrides.iter().cloned());
    let (mut config, source) = run::configuration(&directory, &manifest)?;
    let has_its_configuration = run::journal::is_of_run(&directory, &manifest, (&config, &source))?;
    // Not into the run, which would have to be replaced.
    let mut beside = folder.as_os_str().to_owned();
    beside.push("_solved");
    config.output.directory = beside.into();
    let (config, source) = args.common.checked(config, source)?;
    let design = Some(args.design.clone().unwrap_or_else(|| path.clone()));
    let of_run = Some(RunOfDesign { folder: folder.to_owned(), manifest, has_its_configuration });
    Ok(Subject { config, source, design, of_run })
}

/// Do what the command line says.
pub(super) fn solve(args: &SolveArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_WORK);
    let Subject { config, source, design, of_run } = subject(args)?;
    let work = &args.common.work;
    on_all((&config, &source, Mode::Analysis), work, &signal, |options, mut observer| {
        let design = match &design {
            Some(path) => Some(read_design(path, variable_count(&config, &source)?)?.of_run(of_run.clone())),
            None => None,
        };
        let result = run::solve(&config, &source, (design, args.refine), options, &mut *observer)?;
        // No bar may stand where the result goes.
        drop(observer);
        if work.json {
            stdout::print_json(&result)?;
        }
        // An analysis that has begun is finished and saved; then the signal decides the exit code.
        Ok(signal.received().unwrap_or_else(|| result.stop_reason.into()))
    })
}

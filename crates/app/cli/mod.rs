//! The command line: what was typed becomes a call, its outcome an exit code.

pub mod args;
mod check;
mod examples;
mod exit;
mod generate;
mod gradient;
mod init;
mod interrupt;
mod morph;
mod panic;
#[cfg(feature = "petsc")]
mod petsc;
mod ranks;
mod report;
mod run;
mod solve;
pub mod stdout;
mod sweep;
mod template;

use std::io::Write;

use clap::Parser;

use crate::build::locate_error;
use crate::config::ConfigError;
use crate::diagnostics::{self, Style};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::DesignFileError;
use crate::printable::printable;
use crate::run::launcher;
use crate::show::{Amount, Bar, Console, RunObserver};
use args::{Cli, Command, Progress, WorkArgs};

/// Do what the arguments of this process say.
pub fn main() -> std::process::ExitCode {
    interrupt::wait_for_termination();
    interrupt::survive_file_size_limits();
    if let Err(cause) = args::check_environment(|name| std::env::var(name).ok()) {
        let _ = writeln!(std::io::stderr(), "error: {}", printable(&cause));
        return ExitCode::Usage.into();
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return print_usage(&error).into(),
    };
    panic::report_panics(|| run_command(&cli)).into()
}

/// Prints what is wrong with a command line, or help and version, which are asked for and go to standard output.
fn print_usage(error: &clap::Error) -> ExitCode {
    let printed = if ranks::is_worker() { Ok(()) } else { error.print() };
    if error.use_stderr() {
        return ExitCode::Usage;
    }
    stdout::unless_closed(printed).map_or_else(|error| report_error(&error), |()| ExitCode::Success)
}

/// Shows an error on standard error; its exit code.
fn report_error(error: &Error) -> ExitCode {
    let _ = writeln!(std::io::stderr(), "{}", message(error));
    error.exit_code()
}

/// Runs a command; its exit code.
fn run_command(cli: &Cli) -> ExitCode {
    let shared_out = matches!(
        cli.command,
        Command::Run(_) | Command::Resume(_) | Command::Solve(_) | Command::Gradient(_)
    );
    if ranks::is_worker() && !shared_out {
        return ExitCode::Success;
    }
    let outcome = match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Resume(args) => run::resume(args),
        Command::Sweep(args) => sweep::sweep(args),
        Command::Solve(args) => solve::solve(args),
        Command::Morph(args) => morph::morph(args),
        Command::Check(args) => check::check(args),
        Command::Gradient(args) => gradient::gradient(args),
        Command::Report(args) => report::report(args),
        Command::Init(args) => init::init(args),
        Command::Generate(args) => generate::generate(args),
    };
    outcome.unwrap_or_else(|error| {
        // An error of all ranks is reported by the first, an error of one rank by that one.
        if ranks::is_worker() {
            if matches!(error, Error::Ranks { .. } | Error::Threads { .. }) {
                let _ = writeln!(std::io::stderr(), "rank {}: {}", launcher::rank(), message(&error));
            }
            return error.exit_code();
        }
        report_error(&error)
    })
}

/// What is shown for an error on standard error.
fn message(error: &Error) -> String {
    match error {
        Error::Config(ConfigError::Invalid(report)) | Error::Design(DesignFileError::Fault(report)) => {
            diagnostics::render(report, Style::for_stderr())
        }
        other => {
            let keys = locate_error::keys_of_advice(other);
            let keys = keys.map_or_else(String::new, |keys| format!(" ({keys})"));
            printable(&format!("error: {other}{keys}")).into_owned()
        }
    }
}

/// Who shows the progress.
fn observer(args: &WorkArgs) -> Box<dyn RunObserver> {
    match args.progress() {
        Progress::None if args.quiet => Box::new(Console::stderr().with(Amount::Warnings)),
        Progress::None => Box::new(Console::stderr().with(Amount::Results)),
        Progress::Plain => Box::new(Console::stderr()),
        Progress::Auto | Progress::Bar => match Bar::stderr() {
            Some(bar) => Box::new(bar),
            None => Box::new(Console::stderr()),
        },
    }
}

/// Works on as many threads as asked for, or as the machine has; `work` gets their number.
fn with_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce(usize) -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|cause| Error::Threads { threads: threads.unwrap_or(0), cause: cause.to_string() })?;
    pool.install(|| work(rayon::current_num_threads()))
}

//! The command line as typed.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use super::exit;
use crate::config::{Config, Dimension, OutputNamedBy, Source, parse_quantity};
use crate::error::Error;
use crate::memory_limit;
use crate::output::OlderRun;

/// Finds the shape of an electromagnetic device from a TOML file.
#[derive(Debug, Parser)]
#[command(name = "fluxmorph", version, after_help = exit::HELP, subcommand_required = true)]
#[command(arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Optimise, and write everything into the run directory
    Run(RunArgs),
    /// Go on with a run that was interrupted or broken off, as if it had not been
    Resume(ResumeArgs),
    /// One field analysis of the initial design, or of a given one
    Solve(SolveArgs),
    /// Move the mesh as [morph] prescribes, without a field; print the quality before and after
    Morph(MorphArgs),
    /// Read the configuration and build the mesh, without solving; print what they are
    Check(CheckArgs),
    /// Gradient certificate: Taylor remainders and central differences in random directions
    Gradient(GradientArgs),
}

/// Options of every command that reads a configuration.
#[derive(Debug, Args)]
pub struct CommonArgs {
    /// The configuration
    #[arg(value_name = "CONFIG")]
    pub config: PathBuf,

    /// Directory to write into, instead of the configuration's output.directory
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Threads to use [default: all]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,

    /// Show errors and warnings only
    #[arg(long, short)]
    pub quiet: bool,

    /// Print the result as JSON on standard output
    #[arg(long)]
    pub json: bool,

    /// Replace an earlier run in the output directory; go on where the memory seems too small
    #[arg(long)]
    pub force: bool,

    /// Let mesh.file and output.directory lead out of the folder of the configuration
    #[arg(long)]
    pub allow_outside: bool,

    /// Set a key of the configuration, such as analysis.frequency="50 Hz" or coils[0].width="30 mm"; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub overrides: Vec<String>,
}

/// Options of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The common options.
    #[command(flatten)]
    pub common: CommonArgs,

    /// Most evaluations of the objective
    #[arg(long, value_name = "N", value_parser = evaluations)]
    pub max_evaluations: Option<usize>,

    /// Longest time, such as "10 min" or 90 (seconds)
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub max_time: Option<f64>,
}

/// Options of `resume`.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// The run directory
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// Most evaluations of the objective, those of before counted in [default: as the run was started]
    #[arg(long, value_name = "N", value_parser = evaluations)]
    pub max_evaluations: Option<usize>,

    /// Longest time from now, such as "10 min" or 90 (seconds) [default: as the run was started]
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub max_time: Option<f64>,

    /// Threads to use [default: all]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,

    /// Show errors and warnings only
    #[arg(long, short)]
    pub quiet: bool,

    /// Print the result as JSON on standard output
    #[arg(long)]
    pub json: bool,

    /// Let mesh.file lead out of the folder of the configuration
    #[arg(long)]
    pub allow_outside: bool,

    /// Go on where the memory seems too small
    #[arg(long)]
    pub force: bool,
}

/// Options of `solve`.
#[derive(Debug, Args)]
pub struct SolveArgs {
    /// The common options.
    #[command(flatten)]
    pub common: CommonArgs,

    /// Design to analyse: a result.json, or a JSON array of lengths in metres
    #[arg(long, value_name = "FILE")]
    pub design: Option<PathBuf>,
}

/// Options of `morph`.
#[derive(Debug, Args)]
pub struct MorphArgs {
    /// The common options.
    #[command(flatten)]
    pub common: CommonArgs,

    /// Search for the elastic parameters that keep the worst element best, and write them to tuned.toml
    #[arg(long)]
    pub tune: bool,
}

/// Options of `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// The common options.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Options of `gradient`.
#[derive(Debug, Args)]
pub struct GradientArgs {
    /// The common options.
    #[command(flatten)]
    pub common: CommonArgs,

    /// Design at which the gradient is checked: a result.json, or a JSON array of lengths in metres
    #[arg(long, value_name = "FILE")]
    pub design: Option<PathBuf>,
}

impl CommonArgs {
    /// The configuration with `--set` and `--out` applied. A relative `--out` is relative to the working directory.
    ///
    /// # Errors
    /// When the configuration cannot be read, is wrong, or leads out of its folder without `--allow-outside`.
    pub fn load(&self) -> Result<(Config, Source), Error> {
        let (mut config, source) = Config::from_file(&self.config, &self.overrides)?;
        if !self.allow_outside {
            let by = if self.out.is_some() { OutputNamedBy::User } else { OutputNamedBy::Configuration };
            source.confined(by)?;
        }
        if !self.force {
            memory_limit::check_mesh(&config, &source)?;
        }
        if let Some(out) = &self.out {
            config.output.directory = std::path::absolute(out).unwrap_or_else(|_| out.clone());
        }
        Ok((config, source))
    }

    /// What `--force` says about an earlier run.
    pub fn older_run(&self) -> OlderRun {
        if self.force { OlderRun::Replace } else { OlderRun::Keep }
    }
}

impl RunArgs {
    /// The configuration with all options applied.
    ///
    /// # Errors
    /// When the configuration cannot be read or is wrong.
    pub fn load(&self) -> Result<(Config, Source), Error> {
        let (mut config, source) = self.common.load()?;
        if let Some(evaluations) = self.max_evaluations {
            config.optimizer.max_evaluations = evaluations;
        }
        if let Some(seconds) = self.max_time {
            config.optimizer.max_time = Some(seconds);
        }
        Ok((config, source))
    }
}

fn whole_number(text: &str, most: usize) -> Result<usize, String> {
    match text.parse() {
        Ok(number) if (1..=most).contains(&number) => Ok(number),
        _ => Err(format!("must be a whole number from 1 to {most}")),
    }
}

fn threads(text: &str) -> Result<usize, String> {
    whole_number(text, 1024)
}

fn evaluations(text: &str) -> Result<usize, String> {
    whole_number(text, 1_000_000)
}

fn duration(text: &str) -> Result<f64, String> {
    let value = match text.trim().parse::<f64>() {
        Ok(seconds) => seconds,
        Err(_) => parse_quantity(text, Dimension::Duration).map_err(|error| error.to_string())?,
    };
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("must be longer than 0 s".to_owned()) }
}

fn key_value(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((key, _)) if !key.trim().is_empty() && !text.contains(['\n', '\r']) => Ok(text.to_owned()),
        _ => Err("must be KEY=VALUE on one line, such as analysis.frequency=\"50 Hz\"".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn options_are_read() {
        let line = "fluxmorph run a.toml --out o --threads 2 -q --json --force --set a.b=1 --set c=d \
                    --max-evaluations 5 --max-time 90";
        let cli = Cli::try_parse_from(line.split_whitespace()).expect("a good command line");
        let Command::Run(run) = cli.command else { panic!("run") };
        assert_eq!((run.max_evaluations, run.max_time), (Some(5), Some(90.0)));
        assert_eq!(run.common.overrides, ["a.b=1", "c=d"]);
        assert_eq!(run.common.threads, Some(2));
        assert_eq!(run.common.older_run(), OlderRun::Replace);
        assert_eq!(duration("10 min"), Ok(600.0));
    }

    #[test]
    fn wrong_values_are_refused() {
        for line in [
            "fluxmorph",
            "fluxmorph run",
            "fluxmorph walk a.toml",
            "fluxmorph run a.toml --threads 0",
            "fluxmorph run a.toml --threads -1",
            "fluxmorph run a.toml --threads 1.5",
            "fluxmorph run a.toml --max-evaluations 0",
            "fluxmorph run a.toml --max-time 0",
            "fluxmorph run a.toml --max-time nan",
            "fluxmorph run a.toml --max-time 5parsec",
            "fluxmorph run a.toml --set frequency",
            "fluxmorph run a.toml --set =5",
            "fluxmorph check a.toml --max-time 5",
            "fluxmorph run a.toml --quiet=maybe",
        ] {
            assert!(Cli::try_parse_from(line.split_whitespace()).is_err(), "{line}");
        }
    }
}

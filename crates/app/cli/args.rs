//! The command line as typed.

mod sweep;

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueEnum};

use super::template::Template;
use super::{examples, exit};
use crate::build::{memory_limit, steels, with_names};
use crate::config::{
    Config, Dimension, MOST_EVALUATIONS, OutputNamedBy, SourceMap, Steel, parse_quantity,
    without_upward_steps,
};
use crate::error::Error;
use crate::files::OverwritePolicy;

pub use sweep::{Scheduler, SweepArgs};

/// Finds the shape of an electromagnetic device from a TOML file
///
/// A coil, a plate, a pole face: the configuration says what may move, within which bounds, and what is to become small or
/// large. The mesh keeps its topology; it is moved, with the exact gradient of the field's objective.
#[derive(Debug, Parser)]
#[command(name = "fluxmorph", version, subcommand_required = true, arg_required_else_help = true)]
#[command(after_help = examples::FLUXMORPH, after_long_help = overview())]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Optimise, and write everything into the run directory
    #[command(after_help = examples::RUN)]
    Run(RunArgs),
    /// Resume an interrupted run
    #[command(after_help = examples::RESUME)]
    Resume(ResumeArgs),
    /// Optimise once for every combination of some values, and compare the results
    #[command(after_help = examples::SWEEP)]
    Sweep(SweepArgs),
    /// One field analysis of the initial design, or of a given one
    #[command(after_help = examples::SOLVE)]
    Solve(SolveArgs),
    /// Move the mesh as [morph] prescribes, without a field; print the quality before and after
    #[command(after_help = examples::MORPH)]
    Morph(MorphArgs),
    /// Read the configuration and build the mesh, without solving; print what they are
    #[command(after_help = examples::CHECK)]
    Check(CheckArgs),
    /// Gradient certificate: Taylor remainders and central differences in random directions
    #[command(after_help = examples::GRADIENT)]
    Gradient(GradientArgs),
    /// Write one HTML page about a run, to read and to send
    #[command(after_help = examples::REPORT)]
    Report(ReportArgs),
    /// Write a commented starting configuration
    #[command(after_help = examples::INIT)]
    Init(InitArgs),
    /// Print the schema of the configuration, the man page or shell completions
    #[command(after_help = examples::GENERATE)]
    Generate(GenerateArgs),
}

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Progress {
    /// A bar on a terminal, plain lines elsewhere
    #[default]
    Auto,
    /// A bar; plain lines where standard error is no terminal that can show one
    Bar,
    /// One line for each evaluation
    Plain,
    /// Errors and warnings only, as with --quiet
    None,
}

/// Options of every command that computes.
#[derive(Debug, Args)]
pub struct WorkArgs {
    /// Threads to use [default: all]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,

    /// How progress is shown on standard error
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = Progress::Auto)]
    pub progress: Progress,

    /// Show errors and warnings only
    #[arg(long, short)]
    pub quiet: bool,

    /// Print the result as JSON on standard output
    #[arg(long)]
    pub json: bool,

    /// Allow the configuration to name files outside its folder
    #[arg(long)]
    pub allow_outside: bool,

    /// Skip the check that the memory is sufficient, and where a run is begun replace an earlier one in its directory
    #[arg(long)]
    pub force: bool,
}

/// Options of every command that reads a configuration.
#[derive(Debug, Args)]
pub struct CommonArgs {
    /// The configuration
    #[arg(value_name = "CONFIG")]
    pub config: PathBuf,

    /// Directory of the run, instead of the configuration's output.directory
    #[arg(long, value_name = "DIR", alias = "output")]
    pub out: Option<PathBuf>,

    /// Set a key of the configuration; repeatable
    ///
    /// Such as analysis.frequency="50 Hz" or coils[0].width="30 mm". The value is TOML or, when it is not, a text.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub overrides: Vec<String>,

    /// Options shared with `resume`.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// Limits of an optimisation.
#[derive(Debug, Args)]
pub struct LimitArgs {
    /// Most evaluations of the objective; with `resume`, earlier ones count too
    #[arg(long, value_name = "N", value_parser = evaluations, allow_negative_numbers = true)]
    pub max_evaluations: Option<usize>,

    /// Longest time from now, such as "10 min" or 90 (seconds)
    #[arg(long, value_name = "DURATION", value_parser = duration, allow_negative_numbers = true)]
    pub max_time: Option<f64>,
}

/// Options of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The common options.
    #[command(flatten)]
    pub common: CommonArgs,

    /// The limits.
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// Options of `resume`.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// The run directory
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// The limits; those in force when the run was started or last resumed hold where none is given.
    #[command(flatten)]
    pub limits: LimitArgs,

    /// Options shared with `run`.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// Options of `solve`.
#[derive(Debug, Args)]
pub struct SolveArgs {
    /// The common options.
    #[command(flatten)]
    pub common: CommonArgs,

    /// Design to analyse: a result.json, or a JSON array of lengths in metres
    ///
    /// A result.json in place of the configuration stands for the configuration of its run and this option.
    #[arg(long, value_name = "FILE")]
    pub design: Option<PathBuf>,

    /// Halve all edges of the design's mesh N times before it is analysed: eight times the elements each
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=6), allow_negative_numbers = true)]
    pub refine: u32,
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

    /// Solve the field of the initial design, and estimate the error of the objective that comes from the mesh
    #[arg(long)]
    pub estimate: bool,
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

/// Options of `report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The run directory
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// File to write [default: report.html in the run directory]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,

    /// Show errors and warnings only
    #[arg(long, short)]
    pub quiet: bool,

    /// Allow a mesh file outside the folder of the configuration
    #[arg(long)]
    pub allow_outside: bool,

    /// Skip the check that the memory is sufficient
    #[arg(long)]
    pub force: bool,
}

/// Options of `init`.
#[derive(Debug, Args)]
pub struct InitArgs {
    /// Name of the configuration, with or without `.toml`, in a folder or not [default: that of the template]
    #[arg(value_name = "NAME")]
    pub name: Option<PathBuf>,

    /// What to start from [default: the template that is called NAME, or shield]
    #[arg(long, value_name = "TEMPLATE", value_enum)]
    pub template: Option<Template>,

    /// Folder to write into; created if missing
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    pub force: bool,

    /// Show errors and warnings only
    #[arg(long, short)]
    pub quiet: bool,
}

/// Options of `generate`.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    /// What to print.
    #[command(subcommand)]
    pub what: Generated,
}

/// What `generate` prints.
#[derive(Debug, Subcommand)]
pub enum Generated {
    /// The JSON schema of the configuration
    Schema,
    /// The steels that a configuration may name, with their sources
    #[command(after_help = examples::MATERIALS)]
    Materials {
        /// One of them alone, as a file for `bh_file`
        #[arg(value_name = "NAME", value_parser = PossibleValuesParser::new(steels::ALL.map(Steel::name)))]
        name: Option<String>,
    },
    /// The man pages: all in one on standard output, or one for each command into a folder
    #[command(after_help = examples::MAN)]
    Man {
        /// Folder to write one page for each command into; created if missing
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Completions for a shell
    #[command(after_help = examples::COMPLETIONS)]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// The end of the long help: examples and exit codes.
fn overview() -> String {
    format!("{}\n\n{}", examples::FLUXMORPH, exit::HELP)
}

impl CommonArgs {
    /// The configuration with `--set` and `--out` applied. A relative `--out` is relative to the working directory.
    pub fn load(&self) -> Result<(Config, SourceMap), Error> {
        let (config, source) = Config::from_file(&self.config, &self.overrides).map_err(with_names)?;
        self.checked(config, source)
    }

    /// A configuration that leads out of its folder only where that is allowed, and whose mesh fits, with `--out` applied.
    pub fn checked(&self, mut config: Config, source: SourceMap) -> Result<(Config, SourceMap), Error> {
        if !self.work.allow_outside {
            let by = if self.out.is_some() { OutputNamedBy::User } else { OutputNamedBy::Configuration };
            source.confined(by)?;
        }
        if !self.work.force {
            memory_limit::check_mesh(&config, &source)?;
        }
        if let Some(out) = &self.out {
            config.output.directory = without_upward_steps(out);
        }
        Ok((config, source))
    }

    /// What `--force` says about an earlier run.
    pub fn overwrite_policy(&self) -> OverwritePolicy {
        self.work.overwrite_policy()
    }
}

impl WorkArgs {
    /// What `--force` says about an earlier run.
    pub fn overwrite_policy(&self) -> OverwritePolicy {
        if self.force { OverwritePolicy::Replace } else { OverwritePolicy::Keep }
    }

    /// How progress is shown; `--quiet` wins.
    pub fn progress(&self) -> Progress {
        if self.quiet { Progress::None } else { self.progress }
    }
}

impl RunArgs {
    /// The configuration with all options applied.
    pub fn load(&self) -> Result<(Config, SourceMap), Error> {
        let (mut config, source) = self.common.load()?;
        if let Some(evaluations) = self.limits.max_evaluations {
            config.optimizer.max_evaluations = evaluations;
        }
        if let Some(seconds) = self.limits.max_time {
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

/// Most threads of a process.
const MOST_THREADS: usize = 1024;

fn threads(text: &str) -> Result<usize, String> {
    whole_number(text, MOST_THREADS)
}

/// Whether the environment, where the library of threads looks as well, asks for no more of them than `--threads` may.
pub(super) fn check_environment(variable: impl Fn(&str) -> Option<String>) -> Result<(), String> {
    for name in ["RAYON_NUM_THREADS", "RAYON_RS_NUM_CPUS"] {
        // What is no number has no effect.
        let asked = variable(name).and_then(|text| text.parse::<usize>().ok()).unwrap_or(0);
        if asked > MOST_THREADS {
            return Err(format!(
                "{name} asks for {asked} threads: must be at most {MOST_THREADS}; set it lower, or take --threads"
            ));
        }
    }
    Ok(())
}

fn evaluations(text: &str) -> Result<usize, String> {
    whole_number(text, MOST_EVALUATIONS)
}

fn duration(text: &str) -> Result<f64, String> {
    let value = match text.trim().parse::<f64>() {
        Ok(seconds) => seconds,
        Err(_) => parse_quantity(text, Dimension::Duration).map_err(|error| error.to_string())?,
    };
    match value {
        value if value > 0.0 && value.is_finite() => Ok(value),
        value if value <= 0.0 => Err("must be longer than 0 s".to_owned()),
        _ => Err("must be a finite time".to_owned()),
    }
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
    fn the_environment_may_ask_for_as_many_threads_as_the_command_line() {
        let with = |name: &'static str, value: &'static str| {
            check_environment(move |asked| (asked == name).then(|| value.to_owned()))
        };
        for value in ["", "0", "1024", "many", "-1"] {
            assert_eq!(with("RAYON_NUM_THREADS", value), Ok(()), "{value}");
        }
        for name in ["RAYON_NUM_THREADS", "RAYON_RS_NUM_CPUS"] {
            let cause = with(name, "5000").expect_err("too many");
            assert!(cause.contains(name) && cause.contains("at most 1024"), "{cause}");
        }
    }

    #[test]
    fn the_definition_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn options_are_read() {
        let line = "fluxmorph run a.toml --out o --threads 2 -q --json --force --set a.b=1 --set c=d \
                    --max-evaluations 5 --max-time 90 --progress bar";
        let cli = Cli::try_parse_from(line.split_whitespace()).expect("a good command line");
        let Command::Run(run) = cli.command else { panic!("run") };
        assert_eq!((run.limits.max_evaluations, run.limits.max_time), (Some(5), Some(90.0)));
        assert_eq!(run.common.overrides, ["a.b=1", "c=d"]);
        assert_eq!(run.common.work.threads, Some(2));
        assert_eq!(run.common.overwrite_policy(), OverwritePolicy::Replace);
        // Whoever wants quiet has it.
        assert_eq!((run.common.work.progress, run.common.work.progress()), (Progress::Bar, Progress::None));
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
            "fluxmorph run a.toml --progress",
            "fluxmorph run a.toml --progress often",
            "fluxmorph resume runs/a --set a=1",
            "fluxmorph init a --template walk",
            "fluxmorph generate completions ksh",
            "fluxmorph sweep",
            "fluxmorph sweep a.toml --set b",
            "fluxmorph sweep a.toml --jobs 0",
            "fluxmorph sweep a.toml --scheduler slurm",
            "fluxmorph sweep a.toml --script a.sh --only 1",
            "fluxmorph sweep a.toml --script a.sh --json",
        ] {
            assert!(Cli::try_parse_from(line.split_whitespace()).is_err(), "{line}");
        }
    }
}

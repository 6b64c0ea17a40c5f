//! What `fluxmorph sweep` takes.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{LimitArgs, key_value, threads, whole_number};
use crate::files::OverwritePolicy;
use crate::run::RunLimits;
use crate::run::sweep::{Outside, Request};

/// Options of `sweep`.
#[derive(Debug, Args)]
pub struct SweepArgs {
    /// The configuration
    #[arg(value_name = "CONFIG")]
    pub config: PathBuf,

    /// Values of a key, separated by commas; repeatable
    ///
    /// Such as design.upper='10 mm,20 mm'. A comma in quotes, brackets or braces belongs to its value:
    /// design.grid='[7,13],[3,5]'. One value alone is set in all runs. The first key changes slowest.
    #[arg(long = "set", value_name = "KEY=VALUE,…", value_parser = key_value)]
    pub set: Vec<String>,

    /// Directory of the sweep [default: the configuration's output.directory with _sweep appended]
    #[arg(long, value_name = "DIR", alias = "output")]
    pub out: Option<PathBuf>,

    /// Runs at a time [default: 1; in a script: as many as the scheduler allows]
    #[arg(long, short, value_name = "N", value_parser = jobs, allow_negative_numbers = true)]
    pub jobs: Option<usize>,

    /// Threads of each run [default: those of the machine, shared out]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,

    /// The limits of every run.
    #[command(flatten)]
    pub limits: LimitArgs,

    /// Run nothing, and write the sweep as a job array for a scheduler
    #[arg(long, value_name = "FILE")]
    pub script: Option<PathBuf>,

    /// The scheduler that the script is for
    #[arg(long, value_name = "NAME", value_enum, requires = "script", default_value_t = Scheduler::Slurm)]
    pub scheduler: Scheduler,

    /// Run the combination of this number alone, counted from 0, of a sweep that --script has laid out
    #[arg(long, value_name = "INDEX", conflicts_with = "script")]
    pub only: Option<usize>,

    /// Run nothing, and write sweep.csv and sweep.html from what is there
    #[arg(long, conflicts_with_all = ["script", "only"])]
    pub compare: bool,

    /// Show errors and warnings only
    #[arg(long, short)]
    pub quiet: bool,

    /// Print the comparison as JSON on standard output
    #[arg(long, conflicts_with = "script")]
    pub json: bool,

    /// Allow the configuration to name files outside its folder
    #[arg(long)]
    pub allow_outside: bool,

    /// Replace runs in the directory that do not belong to this sweep, and skip the check that the memory is sufficient
    #[arg(long)]
    pub force: bool,
}

/// A scheduler of a cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scheduler {
    /// Slurm, with sbatch
    Slurm,
}

impl SweepArgs {
    /// What is asked for.
    pub fn request(&self) -> Request<'_> {
        Request {
            config: &self.config,
            set: &self.set,
            out: self.out.as_deref(),
            limits: RunLimits {
                max_evaluations: self.limits.max_evaluations,
                max_time: self.limits.max_time,
            },
            outside: if self.allow_outside { Outside::Allowed } else { Outside::Refused },
            overwrite: if self.force { OverwritePolicy::Replace } else { OverwritePolicy::Keep },
        }
    }
}

fn jobs(text: &str) -> Result<usize, String> {
    whole_number(text, 1024)
}

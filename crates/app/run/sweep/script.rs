//! The sweep as a job array for a scheduler: a script with one task for each combination.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::layout::command_text;
use super::{Sweep, SweepError};
use crate::error::Error;
use crate::files::{Disk, OutputError, OverwritePolicy, shell_word, write_whole};

/// The line by which a script is known as ours.
const MARK: &str = "# A sweep of fluxmorph, written by `fluxmorph sweep --script`:";

/// Largest script that is looked at [bytes].
const LARGEST: u64 = 1 << 20;

/// Time that a run has to finish its evaluation and to save, before the scheduler kills it [s].
const NOTICE: u32 = 120;

/// What a script is written for.
#[derive(Clone, Debug)]
pub struct ScriptFile<'a> {
    /// Where it is written.
    pub path: &'a Path,
    /// This program; the variable `FLUXMORPH` names another one.
    pub program: PathBuf,
    /// Tasks at a time; `None`: as many as the scheduler has room for.
    pub jobs: Option<usize>,
    /// Processors of a task; `None`: as many as the scheduler gives it.
    pub threads: Option<usize>,
}

impl ScriptFile<'_> {
    /// Writes the script of a sweep.
    ///
    /// # Errors
    /// [`SweepError::ScriptExists`], or when the operating system refuses.
    pub fn write(&self, disk: &Arc<dyn Disk>, sweep: &Sweep) -> Result<(), Error> {
        let is_ours = match disk.read(self.path, LARGEST) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => true,
            Ok(bytes) => String::from_utf8_lossy(&bytes).lines().any(|line| line == MARK),
            Err(_) => false,
        };
        if !is_ours && sweep.overwrite == OverwritePolicy::Keep {
            return Err(SweepError::ScriptExists { path: self.path.to_owned() }.into());
        }
        let absolute =
            |path: &Path| std::path::absolute(path).map_err(OutputError::io("find the whole path of", path));
        let (config, directory) = (absolute(Path::new(&sweep.config.path))?, absolute(&sweep.directory)?);
        Ok(write_whole(&**disk, self.path, script(self, sweep, &config, &directory).as_bytes())?)
    }
}

/// The text of the script; paths are absolute, since the scheduler chooses the working directory.
pub fn script(file: &ScriptFile<'_>, sweep: &Sweep, config: &Path, directory: &Path) -> String {
    let again = command_text(&arguments(sweep, config, directory));
    let words = again.split_once(' ').map_or("", |(_, words)| words);
    let last = sweep.combinations.len().saturating_sub(1);
    let at_once = file.jobs.map_or(String::new(), |jobs| format!("%{jobs}"));
    let processors = file.threads.map_or(String::new(), |n| format!("#SBATCH --cpus-per-task={n}\n"));
    // The scheduler replaces what follows a percent sign, and splits at blanks.
    let logs = directory.join("logs").display().to_string();
    let is_plain = logs.chars().all(|c| c.is_alphanumeric() || "/._-+,=".contains(c));
    let output = if is_plain { format!("#SBATCH --output={logs}/slurm-%A_%a.out\n") } else { String::new() };
    let threads = file.threads.unwrap_or(1);
    format!(
        "#!/usr/bin/env bash\n\
         {MARK}\n\
         # {count} combinations, one array task each. Submit it with sbatch; add time, memory and partition below or there.\n\
         # A task that is submitted again skips finished runs and resumes interrupted ones.\n\
         #SBATCH --job-name=fluxmorph-sweep\n\
         #SBATCH --array=0-{last}{at_once}\n\
         {processors}\
         {output}\
         # Before its time is over a run finishes its evaluation and saves.\n\
         #SBATCH --signal=B:TERM@{NOTICE}\n\
         set -eu\n\
         fluxmorph=${{FLUXMORPH:-{program}}}\n\
         exec \"$fluxmorph\" {words} \\\n    \
         --threads \"${{SLURM_CPUS_PER_TASK:-{threads}}}\" --only \"${{SLURM_ARRAY_TASK_ID:?give the number of a combination, 0 to {last}}}\"\n\
         # When all tasks have ended, this makes sweep.csv and sweep.html, and runs nothing:\n\
         #   {again} --compare\n",
        count = sweep.combinations.len(),
        program = shell_word(&file.program),
    )
}

/// The arguments of the sweep, for a process with another working directory.
fn arguments(sweep: &Sweep, config: &Path, directory: &Path) -> Vec<String> {
    let mut arguments = vec!["sweep".to_owned(), config.display().to_string()];
    let mut add = |name: &str, value: String| arguments.extend([name.to_owned(), value]);
    for setting in &sweep.settings {
        add("--set", format!("{}={}", setting.key, setting.values.join(",")));
    }
    add("--out", directory.display().to_string());
    arguments.extend(sweep.shared_arguments(sweep.limits.max_evaluations, sweep.limits.max_time));
    if sweep.overwrite == OverwritePolicy::Replace {
        arguments.push("--force".to_owned());
    }
    arguments
}

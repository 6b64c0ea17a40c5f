//! `fluxmorph sweep`: what is run, what is reported about it, and how it ends.

use std::io::Write;
use std::time::{Duration, Instant};

use super::args::SweepArgs;
use super::{interrupt, stdout};
use crate::config::ConfigError;
use crate::diagnostics::{self, Style};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{OutputError, OverwritePolicy, Sharing, shell_word, system_disk};
use crate::printable::printable;
use crate::run::sweep::{
    Comparison, Ending, Event, Layout, Row, ScriptFile, State, States, Sweep, SweepError, Task, Workers,
};
use crate::show::{Console, Observer};

/// What is shown at the first signal.
const FINISHES_RUNS: &str = "no further run is started; running ones finish their evaluation and save; interrupt again to exit at once";

/// How many times as long as writing the comparison the work before must have taken: it is written for a reader, and at the
/// end in any case.
const SHARE: u32 = 10;

/// Longest log in which an error is looked for [bytes].
const LONGEST_LOG: u64 = 1 << 24;

/// Do what the command line says.
pub(super) fn sweep(args: &SweepArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(FINISHES_RUNS);
    let sweep = Sweep::plan(&args.request()).inspect_err(report_faults)?;
    let disk = system_disk();
    if args.compare {
        let layout = Layout::open(&disk, &sweep)?;
        return write_comparison(args, &sweep, &layout, &Comparison::read(&sweep, &layout)?);
    }
    let count = sweep.combinations.len();
    let chosen = match args.only {
        Some(index) if index >= count => return Err(SweepError::NoSuch { index, count }.into()),
        Some(index) => index..index + 1,
        None => 0..count,
    };
    let left = || {
        let mut states = States::new(&disk, &sweep);
        let left = chosen.clone().map(|index| Ok((index, left_to_do(&mut states, &sweep, index)?)));
        left.collect::<Result<Vec<_>, Error>>()
    };
    // What is wrong is found before anything is written, and what is left is looked at again when no other has it.
    left()?;
    let layout = match args.only {
        Some(_) => {
            let mut layout = Layout::open(&disk, &sweep)?;
            layout.acquire(Sharing::Shared)?;
            layout
        }
        None => Layout::create(&disk, &sweep)?,
    };
    let left = left()?;
    if let Some(path) = &args.script {
        let script = ScriptFile { path, program: program()?, jobs: args.jobs, threads: args.threads };
        script.write(&disk, &sweep)?;
        if !args.quiet {
            Console::stderr().note(&format!("script of {count} combinations: sbatch {}", shell_word(path)));
        }
        return write_comparison(args, &sweep, &layout, &Comparison::read(&sweep, &layout)?);
    }
    Session::new(args, &sweep, &layout)?.run(&left, &|| signal.received())
}

/// What is left to do of a combination: a task, or its state.
enum Left {
    Task(Task),
    Finished(ExitCode),
    InUse,
}

/// # Errors
/// [`SweepError::OtherRun`] without `--force`, or files that cannot be read.
fn left_to_do(states: &mut States<'_>, sweep: &Sweep, index: usize) -> Result<Left, Error> {
    let planned = &sweep.combinations[index];
    Ok(match states.of(planned)? {
        // One that has nothing to keep is replaced without force: with it, so would be one that another process has begun.
        State::Missing | State::Unstarted => Left::Task(Task::Begin(OverwritePolicy::Keep)),
        State::Resumable => Left::Task(Task::Resume),
        State::Finished(reason) => Left::Finished(reason.into()),
        State::InUse => Left::InUse,
        State::Other(_) if sweep.overwrite == OverwritePolicy::Replace => {
            Left::Task(Task::Begin(OverwritePolicy::Replace))
        }
        State::Other(cause) => {
            return Err(SweepError::OtherRun { path: sweep.run_directory(planned), cause }.into());
        }
    })
}

/// This program.
fn program() -> Result<std::path::PathBuf, SweepError> {
    std::env::current_exe().map_err(|source| SweepError::Program { source })
}

/// Shows the faults of configurations with their places; the error counts them.
fn report_faults(error: &Error) {
    let Error::Sweep(SweepError::Faults { reports, .. }) = error else { return };
    let mut stderr = std::io::stderr();
    for (name, fault) in reports {
        let _ = writeln!(stderr, "combination `{}`:\n{}\n", printable(name), render(fault));
    }
}

fn render(fault: &ConfigError) -> String {
    match fault {
        ConfigError::Invalid(report) => diagnostics::render(report, Style::for_stderr()),
        other => printable(&other.to_string()).into_owned(),
    }
}

/// Writes the comparison and prints it where that is asked for.
fn write_comparison(
    args: &SweepArgs,
    sweep: &Sweep,
    layout: &Layout,
    comparison: &Comparison,
) -> Result<ExitCode, Error> {
    comparison.write(sweep, layout)?;
    for (row, difference) in comparison.differences() {
        Console::stderr().warning(&format!("`{}` is not compared: {difference}", row.directory));
    }
    if args.json {
        stdout::print_json(comparison)?;
    }
    if !args.quiet {
        Console::stderr().note(&format!("comparison: {}", layout.path().join("sweep.html").display()));
    }
    Ok(ExitCode::Success)
}

/// The runs of one command.
struct Session<'a> {
    args: &'a SweepArgs,
    sweep: &'a Sweep,
    layout: &'a Layout,
    workers: Workers,
    /// `None` with `--only`: other processes work on the same sweep, and the last would have the say.
    comparison: Option<Comparison>,
    /// When the comparison was written, and how long that took.
    written: (Instant, Duration),
    begun: Vec<Option<Instant>>,
    codes: Vec<ExitCode>,
}

impl<'a> Session<'a> {
    fn new(args: &'a SweepArgs, sweep: &'a Sweep, layout: &'a Layout) -> Result<Self, Error> {
        let jobs = args.jobs.unwrap_or(1);
        let threads = args.threads.unwrap_or_else(|| Workers::threads_each(jobs));
        let comparison = match args.only {
            Some(_) => None,
            None => Some(Comparison::read(sweep, layout)?),
        };
        Ok(Self {
            args,
            sweep,
            layout,
            workers: Workers { program: program()?, jobs, threads },
            comparison,
            written: (Instant::now(), Duration::ZERO),
            begun: vec![None; sweep.combinations.len()],
            codes: Vec::new(),
        })
    }

    /// Does what is left; the exit code is the worst of all runs.
    fn run(
        mut self,
        left: &[(usize, Left)],
        interrupted: &dyn Fn() -> Option<ExitCode>,
    ) -> Result<ExitCode, Error> {
        let mut tasks = Vec::new();
        for (index, left) in left {
            match left {
                Left::Task(task) => tasks.push((*index, *task)),
                Left::Finished(code) => {
                    self.codes.push(*code);
                    self.note(*index, &format!("skipped, {}", self.row(*index)?.describe()));
                }
                Left::InUse => {
                    self.codes.push(ExitCode::Files);
                    self.warning(*index, "another process is working on it");
                }
            }
        }
        let (workers, sweep, layout) = (self.workers.clone(), self.sweep, self.layout);
        workers.work(sweep, layout, &tasks, interrupted, &mut |event| self.take(event))?;
        let is_cut_short = self.codes.len() < left.len()
            || self.codes.iter().any(|code| matches!(code, ExitCode::Interrupted | ExitCode::Terminated));
        if let Some(comparison) = &mut self.comparison
            && comparison.differences().next().is_some()
        {
            // One that ended before the run that it was held against was replaced may be like all others now.
            *comparison = Comparison::read(sweep, layout)?;
            self.codes.extend(comparison.differences().next().map(|_| ExitCode::Files));
        }
        let code = self.codes.iter().copied().max_by_key(|code| severity(*code));
        if let Some(comparison) = &self.comparison {
            write_comparison(self.args, sweep, layout, comparison)?;
        } else if self.args.json {
            let rows = left.iter().map(|(index, _)| self.row(*index)).collect::<Result<Vec<_>, _>>()?;
            stdout::print_json(&rows)?;
        }
        // A signal that came too late to stop anything does not change how the sweep ended.
        let signal = interrupted().filter(|_| is_cut_short);
        if signal.is_some() {
            Console::stderr().warning("the sweep is not finished: resume with the same command");
        }
        Ok(signal.or(code).unwrap_or(ExitCode::Success))
    }

    fn take(&mut self, event: Event) -> Result<(), Error> {
        match event {
            Event::Begun(index, task) => {
                self.begun[index] = Some(Instant::now());
                self.note(index, if task == Task::Resume { "resumed" } else { "begun" });
            }
            Event::Ended(index, ending) => {
                self.codes.push(ending.code());
                if let Some(comparison) = &mut self.comparison {
                    comparison.update(self.sweep, self.layout, index)?;
                }
                self.report_end(index, &ending)?;
                let (at, cost) = self.written;
                if let Some(comparison) = &self.comparison
                    && at.elapsed() >= SHARE * cost
                {
                    let clock = Instant::now();
                    comparison.write(self.sweep, self.layout)?;
                    self.written = (Instant::now(), clock.elapsed());
                }
            }
        }
        Ok(())
    }

    fn report_end(&self, index: usize, ending: &Ending) -> Result<(), Error> {
        let seconds = self.begun[index].map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        let log = self.layout.log(&self.sweep.combinations[index]);
        let broken = |how: &str| {
            let error = self.last_error(&log).map_or(String::new(), |error| format!(", {error}"));
            self.warning(index, &format!("{how}{error}; see {}", log.display()));
        };
        match ending {
            Ending::NotStarted(why) => self.warning(index, &format!("not started: {why}")),
            Ending::Failed(how) => broken(&format!("failed: {how}")),
            Ending::Code(ExitCode::Interrupted | ExitCode::Terminated) => {
                let outcome = match self.row(index)?.evaluations {
                    Some(count) => format!("interrupted, {count} evaluations are saved, {seconds:.1} s"),
                    None => "interrupted before there was anything to keep".to_owned(),
                };
                self.note(index, &outcome);
            }
            Ending::Code(ExitCode::Success | ExitCode::Stopped) => {
                let row = self.row(index)?;
                let ratio =
                    row.ratio.map_or(String::new(), |ratio| format!(", F/F0 {}", crate::show::ratio(ratio)));
                let evaluations = row.evaluations.unwrap_or(0);
                let outcome = row.describe();
                self.note(index, &format!("{outcome}{ratio}, {evaluations} evaluations, {seconds:.1} s"));
            }
            Ending::Code(code) => broken(&format!("failed with exit code {}", *code as u8)),
        }
        Ok(())
    }

    /// The last error in the log of a run.
    fn last_error(&self, log: &std::path::Path) -> Option<String> {
        let bytes = self.layout.disk().read(log, LONGEST_LOG).ok()?;
        let text = String::from_utf8_lossy(&bytes);
        text.lines().rfind(|line| line.starts_with("error")).map(str::to_owned)
    }

    fn row(&self, index: usize) -> Result<Row, OutputError> {
        match &self.comparison {
            Some(comparison) => Ok(comparison.combinations[index].clone()),
            None => Row::read(self.sweep, self.layout, &self.sweep.combinations[index]),
        }
    }

    fn about(&self, index: usize, text: &str) -> String {
        let combinations = &self.sweep.combinations;
        format!("[{}/{}] {}: {text}", index + 1, combinations.len(), combinations[index].combination.name)
    }

    fn note(&self, index: usize, text: &str) {
        if !self.args.quiet {
            Console::stderr().note(&self.about(index, text));
        }
    }

    fn warning(&self, index: usize, text: &str) {
        Console::stderr().warning(&self.about(index, text));
    }
}

/// Which of two exit codes says more about what is to be done.
fn severity(code: ExitCode) -> u8 {
    match code {
        ExitCode::Success => 0,
        ExitCode::Stopped => 1,
        ExitCode::Interrupted => 2,
        ExitCode::Terminated => 3,
        ExitCode::Usage | ExitCode::Configuration => 4,
        ExitCode::Files => 5,
        ExitCode::Numerical => 6,
    }
}

//! Child processes of this program that run the combinations, so many at a time.
//!
//! Every child leads a process group of its own: Ctrl-C on a terminal reaches the sweep alone, which forwards it once, so
//! that no child takes one signal for two and leaves its evaluation unfinished.
//!
//! Every child holds the reading end of a pipe as its standard input, and the sweep the other one: when the sweep ends,
//! however it does, the pipe ends too, which a child takes for SIGTERM ([`ENDS_WITH_STDIN`]). A sweep that is killed so takes
//! its runs with it, which save what they have; a second signal, which ends the sweep at once, ends them at once too, for they
//! have had the first.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use super::{Layout, Planned, Sweep, Task};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::OutputError;
use crate::run::launcher;

/// The variable that tells a run to take the end of its standard input for SIGTERM.
pub(crate) const ENDS_WITH_STDIN: &str = "FLUXMORPH_ENDS_WITH_STDIN";

/// Time between two polls of the children: far shorter than a run, and no load.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Who runs the combinations.
#[derive(Clone, Debug)]
pub struct Workers {
    /// This program.
    pub program: PathBuf,
    /// Processes at a time, at least 1.
    pub jobs: usize,
    /// Threads of each.
    pub threads: usize,
}

/// How the process of a combination ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// By itself, with a code of the documentation.
    Code(ExitCode),
    /// It did not begin: its log cannot be written, or the program not be started.
    NotStarted(String),
    /// In another way, described in words.
    Failed(String),
}

/// What happens to a combination, by its number.
#[derive(Clone, Debug)]
pub enum Event {
    /// Its process has begun.
    Begun(usize, Task),
    /// Its process has ended.
    Ended(usize, Ending),
}

struct Running {
    index: usize,
    child: Child,
}

impl Workers {
    /// Threads for each of so many processes on this machine.
    pub fn threads_each(jobs: usize) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        (cores / jobs.max(1)).max(1)
    }

    /// Does tasks in their order. Once `interrupted` gives a signal no further one is started, and the signal is sent to those
    /// running, which save and end.
    ///
    /// A process that cannot be started, or fails, does not end the others.
    ///
    /// # Errors
    /// What `report` fails with, after the running processes have ended.
    pub fn work(
        &self,
        sweep: &Sweep,
        layout: &Layout,
        tasks: &[(usize, Task)],
        interrupted: &dyn Fn() -> Option<ExitCode>,
        report: &mut dyn FnMut(Event) -> Result<(), Error>,
    ) -> Result<(), Error> {
        // The log of a combination that is begun anew says nothing of it any more.
        for (index, _) in tasks.iter().filter(|(_, task)| matches!(task, Task::Begin(_))) {
            let _ = std::fs::remove_file(layout.log(&sweep.combinations[*index]));
        }
        let mut waiting = tasks.iter().copied();
        let mut running: Vec<Running> = Vec::new();
        let mut is_interrupted = false;
        let mut outcome = Ok(());
        let mut deliver = |event| {
            let answer = report(event);
            if outcome.is_ok() {
                outcome = answer;
            }
            outcome.is_ok()
        };
        let mut continues = true;
        loop {
            if let Some(signal) = interrupted()
                && !is_interrupted
            {
                is_interrupted = true;
                forward(signal, &running);
            }
            while continues && !is_interrupted && running.len() < self.jobs {
                let Some((index, task)) = waiting.next() else { break };
                continues &= deliver(Event::Begun(index, task));
                match self.start(sweep, layout, &sweep.combinations[index], task) {
                    Ok(child) => running.push(Running { index, child }),
                    Err(error) => {
                        continues &= deliver(Event::Ended(index, Ending::NotStarted(error.to_string())));
                    }
                }
            }
            let mut still = Vec::with_capacity(running.len());
            for mut one in running {
                match one.child.try_wait() {
                    Ok(None) => still.push(one),
                    Ok(Some(status)) => continues &= deliver(Event::Ended(one.index, Ending::of(status))),
                    Err(error) => {
                        continues &= deliver(Event::Ended(one.index, Ending::Failed(error.to_string())))
                    }
                }
            }
            running = still;
            if running.is_empty() && (is_interrupted || !continues || waiting.len() == 0) {
                break;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        outcome
    }

    fn start(
        &self,
        sweep: &Sweep,
        layout: &Layout,
        planned: &Planned,
        task: Task,
    ) -> Result<Child, OutputError> {
        let path = layout.log(planned);
        let log = log(&path, task).map_err(OutputError::io("write", &path))?;
        let mut command = Command::new(&self.program);
        command.args(sweep.arguments(planned, task)).args(["--progress", "plain", "--threads"]);
        command
            .env(ENDS_WITH_STDIN, "1")
            .arg(self.threads.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(log);
        // A sweep that a launcher has started is no rank, and neither are its runs.
        launcher::variables().for_each(|name| {
            command.env_remove(name);
        });
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        command.spawn().map_err(OutputError::io("start", &self.program))
    }
}

/// The log of a process: a resumed run appends to the log of the earlier process.
fn log(path: &Path, task: Task) -> io::Result<File> {
    let is_plain = std::fs::symlink_metadata(path).map(|entry| entry.is_file());
    match (task, is_plain) {
        (Task::Resume, Ok(true)) => OpenOptions::new().append(true).open(path),
        (_, Err(error)) if error.kind() == io::ErrorKind::NotFound => File::create_new(path),
        // A link in its place leads elsewhere.
        _ => {
            std::fs::remove_file(path)?;
            File::create_new(path)
        }
    }
}

/// Sends children the signal that the sweep has got. The standard library sends none but the one that kills.
fn forward(signal: ExitCode, running: &[Running]) {
    let name = if signal == ExitCode::Interrupted { "INT" } else { "TERM" };
    let ids: String = running.iter().map(|one| format!(" {}", one.child.id())).collect();
    if cfg!(unix) && !ids.is_empty() {
        // Without a shell they come to their end by themselves. One that has just ended is no reason for a message.
        let kill = format!("kill -s {name}{ids}");
        let _ = Command::new("sh").args(["-c", &kill]).stdin(Stdio::null()).stderr(Stdio::null()).status();
    }
}

impl Ending {
    fn of(status: ExitStatus) -> Self {
        use ExitCode::*;
        let codes = [Success, Stopped, Usage, Configuration, Numerical, Files, Interrupted, Terminated];
        let code = codes.into_iter().find(|code| status.code() == Some(*code as i32));
        code.map_or_else(|| Self::Failed(status.to_string()), Self::Code)
    }

    /// The code it stands for: what ended in no known way counts as a failure.
    pub fn code(&self) -> ExitCode {
        match self {
            Self::Code(code) => *code,
            Self::NotStarted(_) => ExitCode::Files,
            Self::Failed(_) => ExitCode::Numerical,
        }
    }
}

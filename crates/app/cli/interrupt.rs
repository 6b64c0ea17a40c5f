//! Signals: the first asks the command to end after the current work, the second ends the process at once.
//!
//! METIS replaces the handler of SIGTERM during its calls by one of its own, which jumps to where the thread that called METIS began,
//! whichever thread it runs in. So no thread takes SIGTERM: all block it, and one waits for it. Where a library has started threads
//! before `main`, as OpenBLAS of builds with PETSc does, the program begins once more: what is blocked stays so. The threads that
//! wait have nothing else to do, so that the second signal needs no help of one that may be busy. The files of a run bear
//! its end at any moment.

use std::ffi::{CString, OsString};
use std::io::Write;
use std::os::unix::ffi::OsStringExt;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use fluxmorph_optimizer::Error as OptimizerError;
use nix::sys::signal::{SigSet, Signal as Number};
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::iterator::Signals;
use signal_hook::{flag, low_level};

use super::ranks::is_worker;
use super::{ExitCode, launcher};
use crate::error::Error;
use crate::printable::printable;
use crate::run::sweep::ENDS_WITH_STDIN;
use crate::show;

/// What is shown at the first signal of a run.
pub(super) const FINISHES_AND_SAVES: &str =
    "finishing the current work, then saving; interrupt again to exit at once";

/// What is shown at the first signal of other commands.
pub(super) const FINISHES_WORK: &str = "finishing the current work; interrupt again to exit at once";

/// Whether and which signal has come.
pub(super) struct Signal {
    number: Arc<AtomicUsize>,
}

impl Signal {
    /// What a signal sets: its number; zero before.
    pub(super) fn number(&self) -> &Arc<AtomicUsize> {
        &self.number
    }

    /// The exit code of the signal received, if any.
    pub(super) fn received(&self) -> Option<ExitCode> {
        let number = i32::try_from(self.number.load(Ordering::SeqCst)).unwrap_or_default();
        (number != 0).then(|| exit_code(number))
    }

    /// The exit code of an outcome: where a signal ended the command before it had a result, that of the signal, with a
    /// message.
    pub(super) fn exit_code_of(&self, outcome: Result<ExitCode, Error>) -> Result<ExitCode, Error> {
        match (outcome, self.received()) {
            (
                Err(error @ Error::Optimizer(OptimizerError::Interrupted | OptimizerError::InterruptedRun)),
                Some(code),
            ) => {
                let _ = writeln!(std::io::stderr(), "{}", printable(&error.to_string()));
                Ok(code)
            }
            (outcome, _) => outcome,
        }
    }
}

/// The name of the thread that waits for SIGTERM.
const WAITING: &str = "signals";

/// A command that ends by itself after a signal.
struct Watched {
    number: Arc<AtomicUsize>,
    message: &'static str,
}

/// The command of this process, from when it watches for signals.
static WATCHED: OnceLock<Watched> = OnceLock::new();

/// Has a thread wait for SIGTERM, which this thread and all that it starts block; the first thing that a process does. Until a
/// command watches for signals it ends the process. Where the system refuses, its default (ending at once) stays.
pub(super) fn wait_for_termination() {
    let termination: SigSet = [Number::SIGTERM].into_iter().collect();
    let was_blocked = SigSet::thread_get_mask().is_ok_and(|mask| mask.contains(Number::SIGTERM));
    if termination.thread_block().is_err() {
        return;
    }
    if !was_blocked && has_other_threads() {
        begin_once_more();
    }
    let waiting = std::thread::Builder::new().name(WAITING.to_owned()).spawn(move || {
        while termination.wait().is_ok() {
            arrive(SIGTERM);
        }
    });
    if waiting.is_err() {
        let _ = termination.thread_unblock();
    }
}

/// Whether there are threads beside this one, as far as the system says.
fn has_other_threads() -> bool {
    std::fs::read_dir("/proc/self/task").is_ok_and(|threads| threads.count() > 1)
}

/// Takes the place of this process by another one of the same program and arguments, which has its signal mask; returns where that
/// cannot be.
fn begin_once_more() {
    let text = |text: OsString| CString::new(text.into_vec()).ok();
    let program = std::env::current_exe().ok().and_then(|path| text(path.into_os_string()));
    let arguments: Option<Vec<CString>> = std::env::args_os().map(text).collect();
    if let (Some(program), Some(arguments)) = (program, arguments) {
        let _ = nix::unistd::execv(&program, &arguments);
    }
}

/// What a signal does.
fn arrive(signal: i32) {
    let first = |watched: &&Watched| {
        watched.number.compare_exchange(0, signal as usize, Ordering::SeqCst, Ordering::SeqCst).is_ok()
    };
    let Some(watched) = WATCHED.get().filter(first) else {
        // Where it stands, without what is to be done at an ordinary end: the other threads are at work.
        low_level::exit(exit_code(signal) as i32);
    };
    // Of several ranks one speaks. Standard error may take nothing for long, and the next signal has to be seen.
    if !is_worker() && signal != SIGUSR1 {
        let message = watched.message;
        let _ = std::thread::Builder::new().spawn(move || {
            // A second signal ends the process where it stands: from here on nothing is left to tidy up.
            show::clear();
            let _ = writeln!(std::io::stderr(), "{message}");
        });
    }
}

fn exit_code(signal: i32) -> ExitCode {
    if signal == SIGINT { ExitCode::Interrupted } else { ExitCode::Terminated }
}

/// Has the first signal set a number instead of ending the process; `message` is shown then.
pub(super) fn watch(message: &'static str) -> Signal {
    let number = Arc::new(AtomicUsize::new(0));
    let watched = WATCHED.get_or_init(|| Watched { number, message });
    // `mpirun` hands SIGUSR1 on to its ranks, and kills them soon after anything else.
    let of_launcher = launcher::is_launched().then_some(SIGUSR1);
    // SIGTERM for threads that do not block it, where the system does not show or replace them.
    if let Ok(mut signals) = Signals::new([SIGINT, SIGTERM].into_iter().chain(of_launcher)) {
        std::thread::spawn(move || signals.forever().for_each(arrive));
    }
    if std::env::var_os(ENDS_WITH_STDIN).is_some() {
        std::thread::spawn(|| {
            // Whoever started this process holds the other end and writes nothing: it has ended.
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            arrive(SIGTERM);
        });
    }
    Signal { number: Arc::clone(&watched.number) }
}

/// Lets a write beyond the limit on the size of files fail like any other, with the file named; by default the system ends
/// the process.
pub(super) fn survive_file_size_limits() {
    let _ = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

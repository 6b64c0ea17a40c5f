//! Signals: the first asks the command to end after the current work, the second ends the process at once.
//!
//! The second needs no help of a thread that may be busy: the handler itself ends the process. The files of a run bear
//! that at any moment.

use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use fluxmorph_optimizer::Error as OptimizerError;
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use signal_hook::flag;
use signal_hook::iterator::Signals;

use super::ranks::is_worker;
use super::{ExitCode, launcher};
use crate::error::Error;
use crate::printable::printable;
use crate::run::sweep::ENDS_WITH_STDIN;
use crate::show;

/// What is shown at the first signal of a run.
pub(super) const FINISHES_EVALUATION: &str =
    "finishing the current evaluation, then saving; interrupt again to exit at once";

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
        match i32::try_from(self.number.load(Ordering::SeqCst)) {
            Ok(SIGINT) => Some(ExitCode::Interrupted),
            Ok(SIGTERM | SIGUSR1) => Some(ExitCode::Terminated),
            _ => None,
        }
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

/// Watches for Ctrl-C and SIGTERM; `message` is shown when the first comes. Where the system refuses a handler, its default
/// (ending at once) stays.
pub(super) fn watch(message: &'static str) -> Signal {
    let number = Arc::new(AtomicUsize::new(0));
    let again = Arc::new(AtomicBool::new(false));
    // `mpirun` hands SIGUSR1 on to its ranks, and kills them soon after anything else.
    let of_launcher = launcher::is_launched().then_some((SIGUSR1, ExitCode::Terminated));
    let signals = [(SIGINT, ExitCode::Interrupted), (SIGTERM, ExitCode::Terminated)];
    for (signal, code) in signals.into_iter().chain(of_launcher) {
        // Order matters: the shutdown looks at what an earlier signal has set.
        let _ = flag::register_conditional_shutdown(signal, code as i32, Arc::clone(&again))
            .and_then(|_| flag::register_usize(signal, Arc::clone(&number), signal as usize))
            .and_then(|_| flag::register(signal, Arc::clone(&again)));
    }
    // A handler must not write; a thread of its own does, while the others compute.
    if let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) {
        // Of several ranks one speaks.
        let speaks = !is_worker();
        std::thread::spawn(move || {
            if signals.forever().next().is_some() && speaks {
                // A second signal ends the process where it stands: from here on nothing is left to tidy up.
                show::clear();
                let _ = writeln!(std::io::stderr(), "{message}");
            }
        });
    }
    if std::env::var_os(ENDS_WITH_STDIN).is_some() {
        std::thread::spawn(|| {
            // Whoever started this process holds the other end and writes nothing: it has ended.
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            let _ = signal_hook::low_level::raise(SIGTERM);
        });
    }
    Signal { number }
}

/// Lets a write beyond the limit on the size of files fail like any other, with the file named; by default the system ends
/// the process.
pub(super) fn survive_file_size_limits() {
    #[cfg(unix)]
    let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

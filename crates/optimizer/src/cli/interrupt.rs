//! Signals: the first asks the run to end after the evaluation in hand, the second ends the process at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::ExitCode;

/// Whether and which signal has come.
pub(super) struct Signal {
    number: Arc<AtomicUsize>,
}

impl Signal {
    /// The exit code of the signal received, if any.
    pub(super) fn received(&self) -> Option<ExitCode> {
        match i32::try_from(self.number.load(Ordering::SeqCst)) {
            Ok(SIGINT) => Some(ExitCode::Interrupted),
            Ok(SIGTERM) => Some(ExitCode::Terminated),
            _ => None,
        }
    }
}

/// Watches for Ctrl-C and SIGTERM. Where the system refuses a handler, its default (ending at once) stays.
pub(super) fn watch() -> Signal {
    let number = Arc::new(AtomicUsize::new(0));
    let again = Arc::new(AtomicBool::new(false));
    for (signal, code) in [(SIGINT, ExitCode::Interrupted), (SIGTERM, ExitCode::Terminated)] {
        // Order matters: the shutdown looks at what an earlier signal has set.
        let _ = flag::register_conditional_shutdown(signal, code as i32, Arc::clone(&again))
            .and_then(|_| flag::register_usize(signal, Arc::clone(&number), signal as usize))
            .and_then(|_| flag::register(signal, Arc::clone(&again)));
    }
    Signal { number }
}

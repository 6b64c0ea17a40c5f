//! A bug that panics: one message in place of a trace, and an exit code that scripts know.
//!
//! A panic inside NLopt's callback and one on a worker thread come out on the thread of the command
//! ([`fluxmorph_optimizer::nlopt`]); the session marks its manifest as failed on the way
//! ([`crate::run`]). Here it ends.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::Write;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::exit_code::ExitCode;
use crate::printable::printable;
use crate::show;

/// Does the work; a panic is reported once, and ends as a numerical failure.
pub(super) fn report_panics(work: impl FnOnce() -> ExitCode) -> ExitCode {
    // Threads that panic because another did are not reported.
    let reported = AtomicBool::new(false);
    set_hook(Box::new(move |info| {
        if reported.swap(true, Ordering::SeqCst) {
            return;
        }
        show::clear();
        let backtrace = Backtrace::capture();
        let mut stderr = std::io::stderr();
        let _ = writeln!(stderr, "{}", printable(&message(info)));
        if backtrace.status() == BacktraceStatus::Captured {
            let _ = writeln!(stderr, "{backtrace}");
        }
    }));
    catch_unwind(AssertUnwindSafe(work)).unwrap_or(ExitCode::Numerical)
}

/// What the user reads.
fn message(info: &PanicHookInfo<'_>) -> String {
    let payload = info.payload();
    let text = payload.downcast_ref::<&str>().copied();
    let cause = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message");
    let place = info.location().map_or_else(|| "unknown place".to_owned(), ToString::to_string);
    let version = env!("CARGO_PKG_VERSION");
    format!(
        "error: a fault of the program itself: {cause} ({place}, fluxmorph {version})\n\
         please report this message with the command and the configuration; files under their final names are whole, and a \
         run that has a journal can be resumed"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The hook is the process': the test runs itself again as another one.
    #[test]
    fn a_panic_is_reported_once_and_ends_with_the_code_of_a_numerical_failure() {
        const INNER: &str = "FLUXMORPH_TEST_PANIC";
        if std::env::var_os(INNER).is_some() {
            let code = report_panics(|| {
                // On a worker thread, as most would be.
                rayon::join(|| (), || panic!("the {} was lost", "pivot"));
                ExitCode::Success
            });
            std::process::exit(code as i32);
        }
        let program = std::env::current_exe().expect("a test has a program");
        let output = std::process::Command::new(program)
            .args([
                "--exact",
                "--nocapture",
                "cli::panic::tests::a_panic_is_reported_once_and_ends_with_the_code_of_a_numerical_failure",
            ])
            .env(INNER, "1")
            .env_remove("RUST_BACKTRACE")
            .output()
            .expect("it starts");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{stderr}");
        assert_eq!(stderr.matches("error: ").count(), 1, "{stderr}");
        for part in ["the pivot was lost", "panic.rs:", "please report", env!("CARGO_PKG_VERSION")] {
            assert!(stderr.contains(part), "{part}: {stderr}");
        }
        assert!(!stderr.contains("panicked at") && !stderr.contains("RUST_BACKTRACE"), "{stderr}");
    }
}

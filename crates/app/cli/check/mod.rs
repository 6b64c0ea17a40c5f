//! `fluxmorph check`: what a configuration means, without solving unless it is asked how exact the
//! objective is.
//!
//! `summary` finds it, `estimate` solves, `text` puts it into words, `table` aligns columns.

mod advice;
mod estimate;
mod reach;
mod summary;
mod text;

use std::io::Write;

use super::args::{CheckArgs, Progress};
use super::{stdout, with_threads};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::show::{Bar, Observer, Silent, Styles};

/// Set the problem up and print what it is, as a table or JSON.
pub(super) fn check(args: &CheckArgs) -> Result<ExitCode, Error> {
    let (config, source) = args.common.load()?;
    let work = &args.common.work;
    with_threads(work.threads, |_| {
        // A mesh of a million elements takes some seconds; lines of progress would only hide the table.
        let bar = match work.progress() {
            Progress::Auto | Progress::Bar => Bar::stderr(),
            Progress::Plain | Progress::None => None,
        };
        let mut observer: Box<dyn Observer> = match bar {
            Some(bar) => Box::new(bar),
            None => Box::new(Silent),
        };
        let progress = &mut |stage| observer.stage(stage);
        let mut summary = summary::summary(&config, &source, work.overwrite_policy(), progress)?;
        if args.estimate {
            summary.estimate = Some(estimate::of_initial_design(&config, &source, &mut *observer)?);
        }
        drop(observer);
        if work.json {
            stdout::print_json(&summary)?;
        } else {
            stdout::print(&text::text(&summary, &args.common.config))?;
            let styles = Styles::for_stderr();
            for warning in &summary.warnings {
                let _ = writeln!(std::io::stderr(), "{}", styles.warning_line(warning));
            }
        }
        Ok(ExitCode::Success)
    })
}

//! Shows no progress: the warnings alone, or these and the results.

use std::io::Write;

use super::lines::Lines;
use super::table::Columns;
use super::{Observer, RunObserver, Started, Styles, show};
use crate::files::RunResult;

/// Shows the warnings alone.
#[derive(Debug)]
pub struct Quiet<W> {
    writer: W,
    styles: Styles,
}

impl Quiet<std::io::Stderr> {
    /// On standard error.
    pub fn stderr() -> Self {
        Self { writer: std::io::stderr(), styles: Styles::for_stderr() }
    }
}

impl<W: Write> Observer for Quiet<W> {
    fn warning(&mut self, message: &str) {
        show(&mut self.writer, &self.styles.warning_line(message));
    }
}

impl<W: Write> RunObserver for Quiet<W> {}

/// Shows the warnings and, in the end, the results.
#[derive(Debug)]
pub struct Results<W> {
    writer: W,
    lines: Lines,
}

impl Results<std::io::Stderr> {
    /// On standard error.
    pub fn stderr() -> Self {
        Self { writer: std::io::stderr(), lines: Lines::new(Styles::for_stderr(), Columns::All) }
    }
}

impl<W: Write> Observer for Results<W> {
    fn warning(&mut self, message: &str) {
        show(&mut self.writer, &self.lines.warning(message));
    }
}

impl<W: Write> RunObserver for Results<W> {
    fn started(&mut self, started: &Started<'_>) {
        // The results name the objective.
        self.lines.started(started);
    }

    fn finished(&mut self, result: &RunResult) {
        self.lines.finished(result).iter().for_each(|line| show(&mut self.writer, line));
    }
}

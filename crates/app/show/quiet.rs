//! Shows the warnings alone.

use std::io::Write;

use super::{Observer, RunObserver, Styles, show};

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

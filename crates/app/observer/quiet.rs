//! Shows the warnings alone.

use std::io::Write;

use super::{Observer, Paint, RunObserver, show};

/// Shows the warnings alone.
#[derive(Debug)]
pub struct Quiet<W> {
    writer: W,
    paint: Paint,
}

impl Quiet<std::io::Stderr> {
    /// On standard error.
    pub fn stderr() -> Self {
        Self { writer: std::io::stderr(), paint: Paint::for_stderr() }
    }
}

impl<W: Write> Observer for Quiet<W> {
    fn warning(&mut self, message: &str) {
        show(&mut self.writer, &self.paint.warning(message));
    }
}

impl<W: Write> RunObserver for Quiet<W> {}

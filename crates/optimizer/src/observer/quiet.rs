//! Shows the warnings alone.

use std::io::Write;

use super::{Observer, Paint, show};

/// Shows the warnings alone.
#[derive(Debug)]
pub struct Quiet<W>(pub W);

impl<W: Write> Observer for Quiet<W> {
    fn warning(&mut self, message: &str) {
        show(&mut self.0, &Paint::for_stderr().warning(message));
    }
}

//! Standard output, for data only.

use std::io::{ErrorKind, Write};

use serde::Serialize;

use crate::error::Error;
use crate::files::{OutputError, STDOUT};
use crate::printable::{printable, printable_json};

/// Print a text; letters in it that would act on a terminal are written out.
pub fn print(text: &str) -> Result<(), Error> {
    write(&printable(text))
}

fn write(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    unless_closed(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

/// An error of standard output. A reader that has closed its end, such as `head`, has what it wanted: that is none.
pub(super) fn unless_closed(written: std::io::Result<()>) -> Result<(), Error> {
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(OutputError::io("write to", STDOUT)(error).into())
        }
        _ => Ok(()),
    }
}

/// Print a value as indented JSON.
pub fn print_json(value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).expect("structs of numbers and text have a JSON form");
    write(&format!("{}\n", printable_json(&text)))
}

//! What is wrong where a text is no TOML: the parser's own words at its own place, one fault a line.
//!
//! Three slips get advice of their own, since everybody makes them: a quote that is not closed, a number with a unit and
//! without quotes, and a key or table that is there twice.

use std::ops::Range;

use super::diagnostic::{Diagnostic, Span};
use super::tree::shown;
use crate::config::value::quantity::is_number_with_unit;

/// Most lines whose errors are kept: more are not shown, and a hostile text may have as many as it has bytes.
const MOST_LINES: usize = 40;

/// The faults of a text that is no TOML, at least one.
pub(super) fn diagnostics(document: usize, text: &str, errors: &[toml::de::Error]) -> Vec<Diagnostic> {
    let mut errors: Vec<(Range<usize>, &str)> =
        errors.iter().map(|error| (error.span().unwrap_or(0..0), error.message().trim())).collect();
    errors.sort_by_key(|(range, _)| range.start);
    errors.dedup_by_key(|(range, _)| start_of_line(text, range.start));
    let diagnostic = |(range, message): (Range<usize>, &str)| {
        let said = format!("not valid TOML: {}", shown(&message.replace('\n', ", ")));
        let diagnostic = Diagnostic::new("", Span { document, range: range.clone() }, said);
        advise(diagnostic, text, range, message)
    };
    errors.into_iter().take(MOST_LINES).map(diagnostic).collect()
}

/// The fault with advice on the slip that it comes from.
fn advise(diagnostic: Diagnostic, text: &str, range: Range<usize>, message: &str) -> Diagnostic {
    let line = text[start_of_line(text, range.start)..].lines().next().unwrap_or_default();
    let value = line.split_once('=').map_or("", |(_, value)| value.split('#').next().unwrap_or_default().trim());
    if message.starts_with("duplicate key") {
        let document = diagnostic.span.document;
        let diagnostic = diagnostic.help("take one of the two out, or write their keys together");
        return match first_of(text, &range) {
            Some(range) => diagnostic.secondary(Span { document, range }, "it stands here first"),
            None => diagnostic,
        };
    }
    if is_number_with_unit(value) && !value.contains('"') {
        return diagnostic.help(format!("put quotes around it: \"{}\"", shown(value)));
    }
    if line.matches('"').count() % 2 == 1 && !line.contains("\"\"\"") {
        return diagnostic.help("a text needs a quote at each of its ends");
    }
    diagnostic
}

/// Where the key, or the header, at a place stands first.
fn first_of(text: &str, range: &Range<usize>) -> Option<Range<usize>> {
    let name = text.get(range.clone())?;
    let own = start_of_line(text, range.start);
    let is_header = text[own..].trim_start().starts_with('[');
    let mut first = None;
    let mut start = 0;
    for line in text[..own].split_inclusive('\n') {
        let trimmed = line.trim_start();
        let found = trimmed.trim_start_matches('[').trim_start().strip_prefix(name);
        let ends = |rest: &str| rest.trim_start().starts_with(if is_header { ']' } else { '=' });
        if trimmed.starts_with('[') && !is_header {
            // Another table begins.
            first = None;
        } else if first.is_none() && found.is_some_and(ends) {
            let lead = line.find(name)?;
            first = Some(start + lead..start + lead + name.len());
        }
        start += line.len();
    }
    first
}

/// The first byte of the line that holds a byte.
fn start_of_line(text: &str, byte: usize) -> usize {
    let before = text.as_bytes().get(..byte).unwrap_or(text.as_bytes());
    before.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1)
}

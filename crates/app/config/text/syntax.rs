//! What is wrong where a text is no TOML: the parser's own words at its own place, one fault a line.
//!
//! Slips that everybody makes get advice: a quote or a list that is not closed, a number with a unit and without quotes, a key or
//! table that is there twice, and characters that a text processor put in the place of others.

use std::ops::Range;

use toml::de::DeTable;

use super::diagnostic::{Diagnostic, Span};
use super::message::shown;
use super::quantity::is_number_with_unit;

/// Most lines whose errors are kept: more are not shown, and a hostile text may have as many as it has bytes.
const MOST_LINES: usize = 40;

/// The faults of a text that is no TOML, at least one.
pub(super) fn diagnostics(document: usize, text: &str, errors: &[toml::de::Error]) -> Vec<Diagnostic> {
    let mut errors: Vec<(Range<usize>, &str)> =
        errors.iter().map(|error| (error.span().unwrap_or(0..0), error.message().trim())).collect();
    errors.sort_by_key(|(range, _)| range.start);
    errors.dedup_by_key(|(range, _)| line_of(text, range.start).start);
    let mut found = Vec::new();
    for (range, message) in errors.into_iter().take(MOST_LINES) {
        let line = &text[line_of(text, range.start)];
        let is_duplicate = message.starts_with("duplicate key");
        // Where a line is sound by itself, something above it is not closed.
        let follows = !is_duplicate && DeTable::parse(line).is_ok();
        if follows && !found.is_empty() {
            break;
        }
        let said = message.replace('\n', ", ").replace(char::is_control, " ");
        let diagnostic =
            Diagnostic::new("", Span { document, range: range.clone() }, format!("not valid TOML: {said}"));
        found.push(match advice(text, &range, line) {
            _ if is_duplicate => duplicate(diagnostic, text, range),
            _ if message.starts_with("invalid multi-line") && range.start >= text.trim_end().len() => {
                unclosed_lines(diagnostic, text, message)
            }
            Some(advice) => diagnostic.help(advice),
            None if follows => diagnostic.help("a list or a table above this line is not closed"),
            None => diagnostic,
        });
        // Under a header that is there twice all keys are there twice.
        if follows || is_duplicate && line.trim_start().starts_with('[') {
            break;
        }
    }
    found
}

/// What to do about a text or a quantity without its quotes, and about characters that no one types.
fn advice(text: &str, range: &Range<usize>, line: &str) -> Option<String> {
    let value = text.get(range.clone()).unwrap_or_default();
    let first = text.get(range.start..).and_then(|rest| rest.chars().next());
    if let Some(advice) = first.into_iter().chain(value.chars()).find_map(foreign) {
        return Some(advice);
    }
    if is_number_with_unit(value) {
        return Some(format!("put quotes around it: \"{}\"", shown(value)));
    }
    let is_open = line.matches('"').count() % 2 == 1 && !line.contains("\"\"\"");
    is_open.then(|| "a text needs a quote at each of its ends".to_owned())
}

/// What to do about a character that stands for another one, or that is not seen.
fn foreign(character: char) -> Option<String> {
    match character {
        '\u{2018}'..='\u{201F}' | '\u{AB}' | '\u{BB}' => {
            Some(format!("{character} is no quote of TOML: type \" or '"))
        }
        '\u{2010}'..='\u{2015}' | '\u{2212}' => Some(format!("{character} is no sign of TOML: type -")),
        _ if !character.is_ascii() && character.is_whitespace() => {
            Some(format!("this blank is the character U+{:04X}: type a plain one", u32::from(character)))
        }
        '\u{AD}' | '\u{200B}'..='\u{200F}' | '\u{2060}' | '\u{FEFF}' => {
            Some(format!("here is a character that is not seen, U+{:04X}: take it out", u32::from(character)))
        }
        _ => None,
    }
}

/// A text of several lines that is not closed, with the place where it begins.
fn unclosed_lines(diagnostic: Diagnostic, text: &str, message: &str) -> Diagnostic {
    let document = diagnostic.span.document;
    let quotes = if message.contains("literal") { "'''" } else { "\"\"\"" };
    let Some(start) = text.rfind(quotes) else { return diagnostic };
    diagnostic
        .help(format!("a text that begins with {quotes} ends with {quotes}"))
        .secondary(Span { document, range: start..start + quotes.len() }, "it begins here")
}

/// A key or a header that is there twice, with the first place.
fn duplicate(diagnostic: Diagnostic, text: &str, range: Range<usize>) -> Diagnostic {
    let document = diagnostic.span.document;
    let diagnostic = diagnostic.help("take one of the two out, or write their keys together");
    match first_of(text, &range) {
        Some(range) => diagnostic.secondary(Span { document, range }, "it stands here first"),
        None => diagnostic,
    }
}

/// Where the key, or the header, at a place stands first.
fn first_of(text: &str, range: &Range<usize>) -> Option<Range<usize>> {
    let name = text.get(range.clone())?;
    let own = line_of(text, range.start).start;
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

/// The line that holds a byte, without its end.
fn line_of(text: &str, byte: usize) -> Range<usize> {
    let byte = byte.min(text.len());
    let start = text.as_bytes()[..byte].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    start..text[start..].find('\n').map_or(text.len(), |length| start + length)
}

//! What is wrong where a text is no TOML, in words that say what to do.
//!
//! The parser knows where it stopped, which is often behind the mistake, and goes on after it: of its errors the first on
//! each line is taken, and none behind a bracket or quote that is never closed. The place is widened to the key, value or
//! header that has to be changed.

use std::ops::Range;

use super::fault::{Fault, Place};
use super::tree::shown;
use lines::Line;

mod headers;
mod lines;
mod values;

/// Most lines whose errors are put into words: more are not shown, and a hostile text may have as many as it has bytes.
const MOST_EXPLAINED: usize = 40;

/// The faults of a text that is no TOML, at least one.
pub(super) fn faults(document: usize, text: &str, errors: &[toml::de::Error]) -> Vec<Fault> {
    let starts: Vec<usize> =
        std::iter::once(0).chain(text.match_indices('\n').map(|(end, _)| end + 1)).collect();
    let line_of = |byte: usize| starts.partition_point(|start| *start <= byte);
    let mut errors: Vec<(usize, Range<usize>, &str)> = errors
        .iter()
        .map(|error| (error.span().unwrap_or(0..0), error.message().trim()))
        .map(|(span, message)| (line_of(span.start), span, message))
        .collect();
    errors.sort_by_key(|(line, span, message)| (*line, rank(message), span.start));
    // One error for each line.
    errors.dedup_by_key(|(line, _, _)| *line);
    let mut found: Vec<Fault> = Vec::new();
    // Under the header of a table that is there twice all keys are there twice.
    let mut repeated = 0..0;
    for (_, span, message) in errors {
        let place = |span| Place { document, span };
        if found.len() >= MOST_EXPLAINED {
            found.push(Fault::new("", place(span), format!("not valid TOML: {}", plain(message))));
            continue;
        }
        let is_duplicate = message.starts_with("duplicate key");
        if is_duplicate && repeated.contains(&span.start) {
            continue;
        }
        let line = Line::at(text, span.start);
        if is_duplicate && line.is_header() {
            let next = Line::all(text).find(|next| next.range.start > line.range.start && next.is_header());
            repeated = line.range.end..next.map_or(text.len(), |next| next.range.start);
        }
        let Explained { span, message, expected, help, other, swallows } =
            explain(text, &span, &line, message);
        found.push(Fault {
            expected,
            help,
            other: other.map(|(span, label)| (place(span), label)),
            ..Fault::new("", place(span), format!("not valid TOML: {message}"))
        });
        if swallows {
            break;
        }
    }
    found
}

/// Of several errors on one line the one that says most comes first.
fn rank(message: &str) -> usize {
    let telling = ["recursion", "string values must be quoted", "invalid unquoted key", "invalid"];
    telling.iter().position(|word| message.contains(word)).unwrap_or(telling.len())
}

/// The parser's own words.
fn plain(message: &str) -> String {
    shown(&message.replace('\n', ", "))
}

/// An error in words.
struct Explained {
    span: Range<usize>,
    message: String,
    expected: Option<String>,
    help: Option<String>,
    other: Option<(Range<usize>, String)>,
    /// Nothing behind it can be trusted.
    swallows: bool,
}

impl Explained {
    fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { span, message: message.into(), expected: None, help: None, other: None, swallows: false }
    }

    fn expected(self, expected: impl Into<String>) -> Self {
        Self { expected: Some(expected.into()), ..self }
    }

    fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    fn other(self, span: Range<usize>, label: impl Into<String>) -> Self {
        Self { other: Some((span, label.into())), ..self }
    }

    fn swallowing(self) -> Self {
        Self { swallows: true, ..self }
    }
}

fn explain(text: &str, span: &Range<usize>, line: &Line<'_>, message: &str) -> Explained {
    let starts = |start: &str| message.starts_with(start);
    if message.contains("recursion") {
        return Explained::new(span.clone(), plain(message))
            .help("lists and tables lie within each other too deeply: take some levels out")
            .swallowing();
    }
    if let Some(open) = line.open_quote() {
        return values::open_quote(text, line, open);
    }
    if let Some(explained) = values::open_list(text, line) {
        return explained;
    }
    if starts("invalid multi-line") {
        return values::open_text(text, span);
    }
    if starts("unclosed table") || starts("unclosed array table") {
        return headers::unclosed(line);
    }
    if message.contains("array") || message.contains("inline table") || message.contains("key-value pairs") {
        return values::in_brackets(text, span, line);
    }
    if starts("duplicate key") {
        return headers::duplicate(text, span, line);
    }
    if line.is_header() {
        return headers::other(line, span, message);
    }
    if starts("key with no value")
        || starts("invalid unquoted key")
        || starts("unquoted keys")
        || starts("missing table open")
    {
        return headers::key(line, span);
    }
    if starts("unexpected key or value") {
        return values::behind(line, span);
    }
    if starts("missing escaped value") || starts("invalid unicode") || starts("too few unicode") {
        return values::escape(text, span);
    }
    match values::value(line, span, message) {
        Some(explained) => explained,
        None => Explained::new(span.clone(), plain(message)),
    }
}

//! Shows faults with the file, the line, the excerpt underlined, and what would be right.
//!
//! The only module that names annotate-snippets.

use std::fmt;
use std::io::IsTerminal;
use std::ops::Range;

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Renderer, Snippet};

use super::error::DiagnosticReport;
use super::text::diagnostic::{Diagnostic, Span};
use super::text::document::Document;
use crate::printable::{masked, printable};

/// Most faults shown at once: a screen or two, and later ones often follow from earlier ones.
const MOST_SHOWN: usize = 20;

/// With or without colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Text only.
    Plain,
    /// ANSI colours.
    Coloured,
}

impl Style {
    /// Colours on a terminal, unless `NO_COLOR` is set to something.
    pub fn for_stderr() -> Self {
        let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|value| value == "dumb");
        if refused || dumb || !std::io::stderr().is_terminal() { Self::Plain } else { Self::Coloured }
    }
}

/// Longest text beside an underlined place [characters]; a longer one stands on a line of its own.
const LONGEST_LABEL: usize = 90;

/// Most characters that are underlined: of a longer place the start is enough.
const LONGEST_UNDERLINED: usize = 100;

/// Most bytes of a line that are handed on; what lies farther from the place is cut off anyway.
const LONGEST_LINE: usize = 20_000;

/// All faults of a report as text, without a line break at the end.
pub fn render(report: &DiagnosticReport, style: Style) -> String {
    let renderer = match style {
        Style::Plain => Renderer::plain(),
        Style::Coloured => Renderer::styled(),
    };
    let mut blocks: Vec<_> = report
        .diagnostics
        .iter()
        .take(MOST_SHOWN)
        .map(|diagnostic| render_one(report, diagnostic, &renderer))
        .collect();
    let name = report.source.documents().first().map_or("", |document| &document.name);
    let count = report.diagnostics.len();
    let faults = if count == 1 { "1 fault".to_owned() } else { format!("{count} faults") };
    let rest = count.saturating_sub(MOST_SHOWN);
    let not_shown = if rest > 0 { format!(", {rest} of them not shown") } else { String::new() };
    blocks.push(format!("{faults} in the {} `{}`{not_shown}", report.of.name(), printable(name)));
    blocks.join("\n\n")
}

impl fmt::Display for DiagnosticReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&render(self, Style::Plain))
    }
}

fn render_one(report: &DiagnosticReport, diagnostic: &Diagnostic, renderer: &Renderer) -> String {
    let mut group: Group<'_> = Group::with_title(Level::ERROR.primary_title(printable(&diagnostic.message)));
    let expected = printable(diagnostic.expected.as_deref().unwrap_or(""));
    let documents = report.source.documents();
    let excerpt =
        |span: &Span| documents.get(span.document).map(|document| (document, excerpt(document, span)));
    let mut shown = false;
    if let Some((document, (snippet, underlined))) = excerpt(&diagnostic.span) {
        let is_label = expected.chars().count() <= LONGEST_LABEL;
        shown = is_label;
        let primary = AnnotationKind::Primary.span(underlined);
        let primary =
            if is_label && !expected.is_empty() { primary.label(expected.clone()) } else { primary };
        let mut snippet = snippet.path(printable(&document.name)).annotation(primary);
        let mut further = None;
        if let Some((span, label)) = &diagnostic.secondary
            && let Some((other_document, (other, underlined))) = excerpt(span)
        {
            let context = AnnotationKind::Context.span(underlined).label(printable(label));
            if span.document == diagnostic.span.document && document.text.len() <= LONGEST_LINE {
                snippet = snippet.annotation(context);
            } else {
                further = Some(other.path(printable(&other_document.name)).annotation(context));
            }
        }
        group = group.element(snippet).elements(further);
    }
    if !shown && !expected.is_empty() {
        group = group.element(Level::NOTE.message(expected));
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(printable(help)));
    }
    // What is shown leaves no blanks at the ends of lines.
    let text = renderer.render(&[group]);
    text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// The part of a text around a place, and the place in it.
fn excerpt<'d>(document: &'d Document, place: &Span) -> (Snippet<'d, Annotation<'d>>, Range<usize>) {
    let text = &document.text;
    let span = visible(text, &place.range);
    if text.len() <= LONGEST_LINE {
        return (Snippet::source(masked(text)).line_start(document.first_line), span);
    }
    // Of a long text the lines around the place, so that a report of many faults costs no more than its excerpts.
    let start = text[..span.start].rfind('\n').map_or(0, |end| end + 1);
    let end = text[span.end..].find('\n').map_or(text.len(), |length| span.end + length);
    let line = document.first_line + text[..start].matches('\n').count();
    (Snippet::source(masked(&text[start..end])).line_start(line), span.start - start..span.end - start)
}

/// A range that lies in the text, on character boundaries, and ends on the line where it starts.
fn visible(text: &str, span: &Range<usize>) -> Range<usize> {
    let floor = |mut index: usize| {
        index = index.min(text.len());
        while !text.is_char_boundary(index) {
            index -= 1;
        }
        index
    };
    let start = floor(span.start);
    let line_end = text[start..].find('\n').map_or(text.len(), |length| start + length);
    let far = text[start..].char_indices().nth(LONGEST_UNDERLINED).map_or(text.len(), |(end, _)| start + end);
    start..floor(span.end).clamp(start, line_end.min(far).max(start))
}

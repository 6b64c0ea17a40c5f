//! Shows faults with the file, the line, the excerpt underlined, and what would be right.
//!
//! The only module that names annotate-snippets.

use std::io::IsTerminal;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use crate::config::{Fault, FaultReport};

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

/// All faults of a report as text, without a line break at the end.
pub fn render(report: &FaultReport, style: Style) -> String {
    let renderer = match style {
        Style::Plain => Renderer::plain(),
        Style::Coloured => Renderer::styled(),
    };
    let mut blocks: Vec<_> =
        report.faults.iter().take(MOST_SHOWN).map(|fault| render_fault(report, fault, &renderer)).collect();
    let name = report.source.documents().first().map_or("", |document| &document.name);
    let count = report.faults.len();
    let faults = if count == 1 { "1 fault".to_owned() } else { format!("{count} faults") };
    let rest = count.saturating_sub(MOST_SHOWN);
    let not_shown = if rest > 0 { format!(", {rest} of them not shown") } else { String::new() };
    blocks.push(format!("{faults} in the configuration `{name}`{not_shown}"));
    blocks.join("\n\n")
}

fn render_fault(report: &FaultReport, fault: &Fault, renderer: &Renderer) -> String {
    let mut group: Group<'_> = Group::with_title(Level::ERROR.primary_title(&*fault.message));
    let label = fault.expected.as_deref().unwrap_or("");
    let mut footer = None;
    if let Some(document) = report.source.documents().get(fault.place.document) {
        let span = visible(&document.text, &fault.place.span);
        let mut annotation = AnnotationKind::Primary.span(span);
        if !label.is_empty() {
            annotation = annotation.label(label);
        }
        group = group.element(Snippet::source(&*document.text).path(&*document.name).annotation(annotation));
    } else if !label.is_empty() {
        footer = Some(Level::NOTE.message(label));
    }
    group = group.elements(footer);
    if let Some(help) = &fault.help {
        group = group.element(Level::HELP.message(&**help));
    }
    renderer.render(&[group])
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
    start..floor(span.end).clamp(start, line_end.max(start))
}

/// Line and column of a byte of a text, both counted from 1; columns are characters.
pub fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before: String = text.char_indices().take_while(|(index, _)| *index < byte).map(|(_, c)| c).collect();
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |last| last.chars().count()) + 1;
    (line, column)
}

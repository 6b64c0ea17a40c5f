//! Values that are no TOML.

use std::ops::Range;

use super::super::quantity::is_number_with_unit;
use super::super::tree::shown;
use super::Explained;
use super::lines::Line;

/// A text whose quote is not closed on its line.
pub(super) fn open_quote(text: &str, line: &Line<'_>, open: usize) -> Explained {
    let written = line.text[open..].trim_end();
    if let Some(value) = line.value()
        && let Some(lead) = line.text.get(value.start..open)
        && written.len() == 1
        && !lead.is_empty()
        && !lead.contains(['"', '\'', '[', '{'])
    {
        return Explained::new(line.span(value.start..open + 1), "the text has a quote at its end only")
            .expected(format!("`{written}` at its start"))
            .help(format!("write {written}{}{written}", shown(lead)));
    }
    let quote = &line.text[open..open + 1];
    // In a list the text ends before the next comma or bracket.
    let inner = written[1..].trim_end_matches([']', '}', ',']).trim_end();
    let explained = Explained::new(line.span(open..open + written.len()), "the text is not closed")
        .expected(format!("`{quote}` at its end"))
        .help(format!("write {quote}{}{quote}", shown(inner)));
    // The quote hides the bracket that closes the list.
    match open_bracket(&text[..line.range.start + open]) {
        Some(_) => explained.swallowing(),
        None => explained,
    }
}

/// A list that is open where the next key or table starts.
pub(super) fn open_list(text: &str, line: &Line<'_>) -> Option<Explained> {
    let open = open_bracket(&text[..line.range.start]).filter(|open| text[*open..].starts_with('['))?;
    let content = &line.text[line.content()];
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    let key = &line.text[line.key()];
    let is_key = line.equals().is_some() && !key.is_empty() && key.chars().all(is_name);
    let header = content.trim_matches(['[', ']']);
    let is_header = line.is_header()
        && header.starts_with(|c: char| c.is_ascii_alphabetic())
        && header.chars().all(is_name);
    (is_key || is_header).then(|| not_closed(text, open))
}

/// A list or a table in braces that is not closed.
fn not_closed(text: &str, open: usize) -> Explained {
    let opening = Line::at(text, open);
    let start = open - opening.range.start;
    let (what, close) = if text[open..].starts_with('{') { ("table in braces", "}") } else { ("list", "]") };
    Explained::new(
        opening.span(start..opening.content().end.max(start + 1)),
        format!("the {what} is not closed"),
    )
    .expected(format!("`{close}` at its end"))
    .help(format!("close it with `{close}` before the next key"))
    .swallowing()
}

/// A text of several lines that is not closed.
pub(super) fn open_text(text: &str, span: &Range<usize>) -> Explained {
    let before = text.get(..span.start).unwrap_or(text);
    let open = before.rfind("\"\"\"").max(before.rfind("'''")).unwrap_or(span.start);
    Explained::new(open..(open + 3).min(text.len()), "the text of several lines is not closed")
        .expected("the same three quotes at its end")
        .help("a text of one line needs one quote at each end")
        .swallowing()
}

/// A list or a table in braces that is not closed, or without a comma between its items.
pub(super) fn in_brackets(text: &str, span: &Range<usize>, line: &Line<'_>) -> Explained {
    let before = text.get(..span.start).unwrap_or(text);
    let open = open_bracket(before);
    let inside = text.get(span.start..line.range.end).unwrap_or_default();
    let is_new_line = line
        .text
        .get(..span.start.saturating_sub(line.range.start))
        .is_none_or(|lead| lead.trim().is_empty());
    let goes_on = inside.is_empty() || is_new_line && (line.equals().is_some() || line.is_header());
    if let (Some(open), true) = (open, goes_on) {
        return not_closed(text, open);
    }
    let end = inside.find([',', ']', '}', '#']).map_or(inside.len(), |end| end.max(1));
    let item = inside[..end].trim_end();
    Explained::new(
        span.start..span.start + item.len().max(1).min(text.len() - span.start),
        "a comma is missing",
    )
    .expected("`,` before this")
    .help("write a comma between two items: [1, 2]")
    .swallowing()
}

/// The last bracket or brace that is not closed.
fn open_bracket(text: &str) -> Option<usize> {
    let mut open = Vec::new();
    for line in Line::all(text) {
        // A header is closed on its line, or is another fault.
        if line.is_header() && open.is_empty() {
            continue;
        }
        for (at, letter) in line.outside_quotes() {
            match letter {
                '#' => break,
                '[' | '{' => open.push(line.range.start + at),
                ']' | '}' => {
                    open.pop();
                }
                _ => {}
            }
        }
    }
    open.first().copied()
}

/// Something behind a value.
pub(super) fn behind(line: &Line<'_>, span: &Range<usize>) -> Explained {
    let content = line.content();
    let from = span.start.saturating_sub(line.range.start);
    let value = line.value();
    if let Some(value) = value.clone()
        && line
            .text
            .get(value.start..from)
            .is_some_and(|lead| lead.bytes().all(|b| b.is_ascii_digit() || b == b'-'))
        && line.text.get(from..from + 1) == Some(",")
        && from > value.start
    {
        let text = &line.text[value.clone()];
        return Explained::new(line.span(value), format!("`{}` is no number", shown(text)))
            .expected("a decimal point")
            .help(format!("write {}", shown(&text.replacen(',', ".", 1))));
    }
    let rest = from..content.end.max(from + 1).min(line.text.len());
    let text = line.text.get(rest.clone()).unwrap_or_default().to_owned();
    let help = if text.starts_with([']', '}']) {
        "take the bracket out, or open it before".to_owned()
    } else if text.contains('=') {
        "write every key on a line of its own".to_owned()
    } else {
        "put quotes around all of the value, or `#` before a comment".to_owned()
    };
    Explained::new(line.span(rest), format!("`{}` stands behind the value", shown(&text)))
        .expected("the end of the line")
        .help(help)
}

/// A backslash that starts nothing.
pub(super) fn escape(text: &str, span: &Range<usize>) -> Explained {
    let before = text.get(..span.start).unwrap_or(text);
    let start = before.rfind('\\').unwrap_or(span.start);
    let end = text[start..].char_indices().nth(2).map_or(text.len(), |(end, _)| start + end);
    Explained::new(start..end, format!("`{}` means nothing in a text", shown(&text[start..end])))
        .help("write paths with `/`, or the text in single quotes: 'a\\b'")
}

/// A value that is neither a text in quotes, nor a number, `true`, `false`, a list or a table.
pub(super) fn value(line: &Line<'_>, span: &Range<usize>, message: &str) -> Option<Explained> {
    let value = line.value()?;
    if value.is_empty() {
        let key = line.key();
        let name = &line.text[key.clone()];
        return Some(
            Explained::new(line.span(key.clone()), format!("`{}` has no value", shown(name)))
                .expected("a value behind `=`")
                .help(format!("write {} = and a value, or take the line out", shown(name))),
        );
    }
    let value =
        if line.text[value.clone()].starts_with(['[', '{']) { item(line, span, value) } else { value };
    let text = line.text[value.clone()].to_owned();
    let span = line.span(value);
    let wrong = |what: &str| Explained::new(span.clone(), format!("`{}` {what}", shown(&text)));
    let quoted = format!("put quotes around it: \"{}\"", shown(&text));
    Some(match text.to_ascii_lowercase().as_str() {
        "true" | "false" => wrong("is no truth value").help(format!("write {}", text.to_ascii_lowercase())),
        "yes" | "on" => wrong("is a text without quotes").help("write true"),
        "no" | "off" => wrong("is a text without quotes").help("write false"),
        "none" | "null" | "nil" => {
            wrong("is no value").help("take the line out: every key may be left out or has a value")
        }
        _ if text.contains(" = ") => wrong("holds a second key").help("write every key on a line of its own"),
        _ if text.starts_with('(') => wrong("is no list").help("a list stands in square brackets: [1, 2]"),
        _ if text.starts_with(['\u{201c}', '\u{201d}', '\u{201e}', '\u{2018}', '\u{2019}', '\u{ab}']) => {
            let inner = text.trim_matches(|c: char| !c.is_ascii() || c == '\'');
            wrong("has quotes of a word processor")
                .help(format!("write straight quotes: \"{}\"", shown(inner)))
        }
        _ if is_number_with_unit(&text) => wrong("is a text without quotes").help(quoted),
        _ if text.split_whitespace().count() > 1
            && text.split_whitespace().all(|word| word.parse::<f64>().is_ok()) =>
        {
            let list = text.split_whitespace().collect::<Vec<_>>().join(", ");
            wrong("has no comma between its numbers").help(format!("write {}", shown(&list)))
        }
        _ if number(&text).is_some() => {
            wrong("is no number in TOML").help(format!("write {}", number(&text).unwrap_or_default()))
        }
        _ if message.starts_with("invalid")
            && text.starts_with(|c: char| c.is_ascii_digit() || ".+-".contains(c)) =>
        {
            wrong("is no number").help("a number looks like 1.0, -5 or 7e6; a text needs quotes")
        }
        _ => wrong("is a text without quotes").help(quoted),
    })
}

/// A number that lacks the digits that TOML wants on both sides of the point, or has a zero in front.
fn number(text: &str) -> Option<String> {
    if let Ok(number) = text.parse::<i64>() {
        return Some(number.to_string());
    }
    let number: f64 = text.parse().ok().filter(|number: &f64| number.is_finite())?;
    Some(format!("{number:?}"))
}

/// The item of a list in which a byte lies.
fn item(line: &Line<'_>, span: &Range<usize>, value: Range<usize>) -> Range<usize> {
    let at = (span.start.saturating_sub(line.range.start)).clamp(value.start, value.end);
    let ends = |c: char| matches!(c, ',' | '[' | ']' | '{' | '}');
    let marks: Vec<usize> = line.outside_quotes().filter(|(_, c)| ends(*c)).map(|(at, _)| at).collect();
    let start = marks.iter().copied().filter(|mark| *mark < at).max().map_or(value.start, |mark| mark + 1);
    let end = marks.iter().copied().find(|mark| *mark >= at.max(start)).unwrap_or(value.end).min(value.end);
    let inner = &line.text[start..end.max(start)];
    let lead = inner.len() - inner.trim_start().len();
    // In braces an item is `key = value`.
    let key = inner.find('=').map_or(lead, |equals| {
        let rest = &inner[equals + 1..];
        equals + 1 + rest.len() - rest.trim_start().len()
    });
    start + key..(start + inner.trim_end().len()).max(start + key)
}

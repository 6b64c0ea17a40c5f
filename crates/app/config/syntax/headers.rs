//! Keys and headers that are no TOML.

use std::ops::Range;

use super::super::keys;
use super::super::tree::shown;
use super::Explained;
use super::lines::Line;

/// `[mesh` or `[[coils]`.
pub(super) fn unclosed(line: &Line<'_>) -> Explained {
    let content = line.content();
    let text = &line.text[content.clone()];
    let name = text.trim_matches(['[', ']']).trim();
    let brackets = text.len() - text.trim_start_matches('[').len();
    if text.len() - text.trim_end_matches(']').len() == brackets {
        return other(line, &line.span(content), "a header holds one name");
    }
    let (left, right) = if brackets > 1 { ("[[", "]]") } else { ("[", "]") };
    Explained::new(line.span(content), "the header of a table is not closed")
        .expected(format!("`{right}` at its end"))
        .help(format!("write {left}{}{right}", shown(name)))
}

/// Anything else that is wrong with a header.
pub(super) fn other(line: &Line<'_>, span: &Range<usize>, message: &str) -> Explained {
    let content = line.content();
    let text = &line.text[content.clone()];
    let name = text.trim_matches(['[', ']']).trim();
    if name.is_empty() {
        return Explained::new(line.span(content), "a table without a name")
            .help("write the name between the brackets: [mesh]");
    }
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if text.ends_with("]]") && !text.starts_with("[[") {
        return Explained::new(
            line.span(content),
            "the header has more brackets at its end than at its start",
        )
        .help(format!("write [[{0}]] for one of several, or [{0}]", shown(name)));
    }
    if !name.chars().all(is_name) {
        let quoted: Vec<String> = name.split('.').map(part).collect();
        return Explained::new(line.span(content), format!("the name `{}` needs quotes", shown(name)))
            .expected("letters, digits, `_` and `-`, or quotes around the name")
            .help(format!("write [{}]", shown(&quoted.join("."))));
    }
    Explained::new(span.clone(), shown(&message.replace('\n', ", ")))
        .help("a header stands alone on its line: [mesh]")
}

/// A part of a dotted name, in quotes where it needs them.
fn part(name: &str) -> String {
    let name = name.trim();
    let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
    if plain || name.starts_with('"') { name.to_owned() } else { format!("'{name}'") }
}

/// A line that is no `key = value`, for want of a key or of `=`.
pub(super) fn key(line: &Line<'_>, span: &Range<usize>) -> Explained {
    let content = line.content();
    let text = &line.text[content.clone()];
    let whole = line.span(content.clone());
    if let Some(start) = ["//", ";", "--", "%", "/*"].into_iter().find(|start| text.starts_with(start)) {
        let at = content.start..content.start + start.len();
        return Explained::new(line.span(at), format!("`{start}` does not start a comment"))
            .help("a comment starts with `#`");
    }
    let key = line.key();
    let name = line.text[key.clone()].to_owned();
    if let (Some(colon), None) = (text.find(':'), line.equals()) {
        let (name, value) = (text[..colon].trim(), text[colon + 1..].trim());
        return Explained::new(
            line.span(content.start + colon..content.start + colon + 1),
            "`:` behind a key",
        )
        .expected("`=`")
        .help(format!("write {} = {}", shown(name), shown(value)));
    }
    if line.equals().is_none() {
        if text.starts_with(']') {
            return Explained::new(whole, "a bracket closes what was not opened").help("take it out");
        }
        return Explained::new(whole, format!("`{}` has no value", shown(text)))
            .expected("`key = value`")
            .help(format!("write {} = and a value, or put `#` before it", shown(text)));
    }
    if name.is_empty() {
        return Explained::new(whole, "there is no key before `=`")
            .expected("`key = value`")
            .help("write the name of the key before `=`");
    }
    let joined = name.split_whitespace().collect::<Vec<_>>().join("_");
    let advice =
        if joined != name { format!("write {} =", shown(&joined)) } else { "put it in quotes".to_owned() };
    let at = if name.chars().all(|c| !c.is_control()) { line.span(key) } else { span.clone() };
    Explained::new(at, format!("`{}` cannot be a key", shown(&name)))
        .expected("letters, digits, `_` and `-`")
        .help(advice)
}

/// A key or table that is there twice.
pub(super) fn duplicate(text: &str, span: &Range<usize>, line: &Line<'_>) -> Explained {
    let content = line.content();
    let own = &line.text[content.clone()];
    if !line.is_header() {
        let name = text.get(span.clone()).unwrap_or_default();
        let explained = Explained::new(span.clone(), format!("the key `{}` is there twice", shown(name)))
            .help("take one of the two out");
        return match first_key(text, line, name) {
            Some(first) => explained.other(first, "it stands here first"),
            None => explained,
        };
    }
    let name = own.trim_matches(['[', ']']).trim();
    let whole = line.span(content.clone());
    let of_name = |other: &Line<'_>| {
        let part = other.content();
        other.is_header() && other.text[part].trim_matches(['[', ']']).trim() == name
    };
    let first = Line::all(text).take_while(|other| other.range.start < line.range.start).find(of_name);
    let explained = Explained::new(whole, format!("the table `{}` is there twice", shown(name)));
    let Some(first) = first else {
        let is_key = |other: &Line<'_>| &other.text[other.key()] == name;
        let key = Line::all(text).take_while(|other| other.range.start < line.range.start).find(is_key);
        let explained = explained.help("its name is that of a key above: give one of them another name");
        return match key {
            Some(key) => explained.other(key.span(key.key()), "the key stands here"),
            None => explained,
        };
    };
    let help = match keys::header(name) {
        Some(header) if header.starts_with("[[") => format!("write {header} for each of several"),
        _ => "write its keys together under one header".to_owned(),
    };
    explained.help(help).other(first.span(first.content()), "it stands here first")
}

/// The line of the same table on which a key stands first.
fn first_key(text: &str, line: &Line<'_>, name: &str) -> Option<Range<usize>> {
    let before: Vec<Line<'_>> =
        Line::all(text).take_while(|other| other.range.start < line.range.start).collect();
    let of_table = before.into_iter().rev().take_while(|other| !other.is_header());
    let of_name = |other: Line<'_>| {
        let key = other.key();
        let same =
            &other.text[key.clone()] == name || other.text[key.clone()].split('.').next() == Some(name);
        (same && other.equals().is_some()).then(|| other.span(key))
    };
    of_table.filter_map(of_name).last()
}

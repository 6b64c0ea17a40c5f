//! The parsed text of a configuration: values with their places, and overrides laid over them.

use std::collections::BTreeMap;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::diagnostic::{Diagnostic, Span};
use super::message::shown;
use super::syntax;

/// Longest path of a key [bytes]. The place of every value is kept by its path: without a limit one long name of a table
/// would be repeated for all that stands in it.
const LONGEST_PATH: usize = 512;

/// Keys and values of one table, sorted by key.
pub(in crate::config) type Table = BTreeMap<String, Node>;

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(in crate::config) struct Node {
    /// The value.
    pub(in crate::config) content: Content,
    /// Where the value stands; the header for a table under `[header]`.
    pub(in crate::config) span: Span,
    /// Where the key stands, or the value in an array.
    pub(in crate::config) key_span: Span,
}

/// A TOML value.
#[derive(Debug, Clone)]
pub(in crate::config) enum Content {
    Text(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Date,
    Array(Vec<Node>),
    Table(Table),
}

impl Content {
    /// What the value is and, where it is short, the value itself.
    pub(in crate::config) fn describe(&self) -> String {
        match self {
            Self::Text(text) => format!("the text \"{}\"", shown(text)),
            Self::Integer(value) => format!("the whole number {value}"),
            Self::Float(value) => format!("the number {value}"),
            Self::Boolean(value) => format!("`{value}`"),
            Self::Date => "a date".to_owned(),
            Self::Array(items) => format!("a list of {}", items.len()),
            Self::Table(_) => "a table".to_owned(),
        }
    }

    /// The text, where it is one.
    pub(in crate::config) fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    /// The items, where it is a list.
    pub(in crate::config) fn list(&self) -> Option<&[Node]> {
        if let Self::Array(items) = self { Some(items) } else { None }
    }

    /// The table, where it is one.
    pub(in crate::config) fn table(&self) -> Option<&Table> {
        if let Self::Table(table) = self { Some(table) } else { None }
    }

    /// The advice to write a text that is a number as one.
    pub(in crate::config) fn as_number(&self) -> Option<String> {
        let Self::Text(text) = self else { return None };
        let number: f64 = text.trim().parse().ok()?;
        number.is_finite().then(|| format!("write {} without quotes", text.trim()))
    }

    /// The advice to write a number or a truth value as a text.
    pub(in crate::config) fn as_text(&self) -> Option<String> {
        match self {
            Self::Integer(value) => Some(format!("write \"{value}\"")),
            Self::Float(value) => Some(format!("write \"{value}\"")),
            Self::Boolean(value) => Some(format!("write \"{value}\"")),
            _ => None,
        }
    }
}

/// Parse one text.
///
/// # Errors
/// All syntax errors, each with its place; or the first key whose path is too long.
pub(in crate::config) fn parse(document: usize, text: &str) -> Result<Table, Vec<Diagnostic>> {
    let (table, errors) = DeTable::parse_recoverable(text);
    if errors.is_empty() {
        let table = convert_table(document, table.get_ref());
        return match first_long_path(&table, 0) {
            None => Ok(table),
            Some(place) => {
                let message =
                    format!("the key and the tables around it have names of more than {LONGEST_PATH} bytes");
                Err(vec![Diagnostic::new("", place.clone(), message).expected("shorter names")])
            }
        };
    }
    Err(syntax::diagnostics(document, text, &errors))
}

/// The place of the first key whose path is too long, in a table whose own path has `length` bytes.
fn first_long_path(table: &Table, length: usize) -> Option<&Span> {
    table.iter().find_map(|(key, node)| {
        let length = length + 1 + key.len();
        if length > LONGEST_PATH { Some(&node.key_span) } else { first_long_path_in(node, length) }
    })
}

fn first_long_path_in(node: &Node, length: usize) -> Option<&Span> {
    match &node.content {
        Content::Table(inner) => first_long_path(inner, length),
        Content::Array(items) => items.iter().find_map(|item| first_long_path_in(item, length)),
        _ => None,
    }
}

/// Number of values in a table, those in tables and lists of it included.
pub(in crate::config) fn value_count(table: &Table) -> usize {
    table.values().map(value_count_of).sum()
}

fn value_count_of(node: &Node) -> usize {
    match &node.content {
        Content::Table(inner) => 1 + value_count(inner),
        Content::Array(items) => 1 + items.iter().map(value_count_of).sum::<usize>(),
        _ => 1,
    }
}

fn convert_table(document: usize, table: &DeTable<'_>) -> Table {
    let entry = |(key, value): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
        let key_span = Span { document, range: key.span() };
        let name: &std::borrow::Cow<'_, str> = key.get_ref();
        (name.to_string(), convert(document, value, Some(key_span)))
    };
    table.iter().map(entry).collect()
}

fn convert(document: usize, node: &Spanned<DeValue<'_>>, key_span: Option<Span>) -> Node {
    let content = match node.get_ref() {
        DeValue::String(text) => Content::Text(text.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) => Content::Integer(value),
            // Beyond 64 bits: as a real number it is still finite, and the range of the key decides.
            Err(_) => Content::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        },
        DeValue::Float(number) => Content::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => Content::Boolean(*value),
        DeValue::Datetime(_) => Content::Date,
        DeValue::Array(items) => {
            Content::Array(items.iter().map(|item| convert(document, item, None)).collect())
        }
        DeValue::Table(table) => Content::Table(convert_table(document, table)),
    };
    let span = Span { document, range: node.span() };
    let key_span = key_span.unwrap_or_else(|| span.clone());
    // Tables made by dotted keys have no text of their own.
    let span = if span.range.is_empty() { key_span.clone() } else { span };
    Node { content, span, key_span }
}

/// The values of a table as TOML, for writing them out again; dates, which no key takes, are left out.
pub(in crate::config) fn to_toml(table: &Table) -> toml::Table {
    let entry = |(key, node): (&String, &Node)| Some((key.clone(), to_value(&node.content)?));
    table.iter().filter_map(entry).collect()
}

fn to_value(value: &Content) -> Option<toml::Value> {
    Some(match value {
        Content::Text(text) => toml::Value::String(text.clone()),
        Content::Integer(value) => toml::Value::Integer(*value),
        Content::Float(value) => toml::Value::Float(*value),
        Content::Boolean(value) => toml::Value::Boolean(*value),
        Content::Date => return None,
        Content::Array(items) => {
            toml::Value::Array(items.iter().filter_map(|item| to_value(&item.content)).collect())
        }
        Content::Table(table) => toml::Value::Table(to_toml(table)),
    })
}

/// The place of every value, by key path.
pub(in crate::config) fn spans(table: &Table) -> BTreeMap<String, Span> {
    let mut spans = BTreeMap::new();
    collect_spans("", table, &mut spans);
    spans
}

fn collect_spans(path: &str, table: &Table, spans: &mut BTreeMap<String, Span>) {
    for (key, node) in table {
        collect_node(join(path, key), node, spans);
    }
}

fn collect_node(path: String, node: &Node, spans: &mut BTreeMap<String, Span>) {
    match &node.content {
        Content::Table(inner) => collect_spans(&path, inner, spans),
        Content::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                collect_node(format!("{path}[{index}]"), item, spans);
            }
        }
        _ => {}
    }
    spans.insert(path, node.span.clone());
}

/// `path.key`, or `key` at the top.
pub(in crate::config) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

/// Lay an override over the tree: tables are merged, an index replaces or enters one item of a list, and all else is replaced,
/// so that a value may be of another form than the one it takes the place of.
///
/// # Errors
/// When the override goes past the end of a list.
pub(in crate::config) fn overlay(base: &mut Table, over: Table, path: &str) -> Result<(), Box<Diagnostic>> {
    for (key, node) in over {
        let path = join(path, &key);
        match base.get_mut(&key) {
            Some(existing) => overlay_node(existing, node, &path)?,
            None => {
                base.insert(key, node);
            }
        }
    }
    Ok(())
}

fn overlay_node(existing: &mut Node, node: Node, path: &str) -> Result<(), Box<Diagnostic>> {
    match (&mut existing.content, node.content) {
        (Content::Table(table), Content::Table(over)) => overlay(table, over, path),
        (Content::Array(items), Content::Table(over)) => overlay_items(items, over, path),
        (_, content) => {
            *existing = Node { content, ..node };
            Ok(())
        }
    }
}

fn overlay_items(items: &mut [Node], over: Table, path: &str) -> Result<(), Box<Diagnostic>> {
    let count = items.len();
    for (key, node) in over {
        let Some(item) = key.parse::<usize>().ok().and_then(|index| items.get_mut(index)) else {
            let message = format!("`{key}` is not the number of an item of `{path}`");
            let help = format!("`{path}` has {count} items, counted from 0: write {path}[0]");
            return Err(Box::new(Diagnostic::new(path, node.key_span, message).help(help)));
        };
        overlay_node(item, node, &format!("{path}[{key}]"))?;
    }
    Ok(())
}

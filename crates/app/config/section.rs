//! Reads one table: each method takes one key, checks it, and records what is wrong.
//!
//! Every reader returns `None` both for a key that is absent and for one that is faulty; a required key then
//! takes a [`Placeholder`] and reading goes on. A configuration with a fault is never handed out, so a
//! placeholder never reaches a caller; that of numbers is NaN, with which no later comparison holds.

mod lists;
mod unknown;

use std::cell::RefCell;
use std::collections::HashMap;

use super::choice::Choice;
use super::fault::{Fault, Faults, MISSING_KEY, Place};
use super::quantity::{Dimension, parse_quantity};
use super::range::Range;
use super::source::suggest;
use super::tree::{Node, Table, Value, join, shown};

/// Longest list that is read: far beyond any use, and small enough to keep messages and memory bounded.
pub(crate) const LONGEST_LIST: usize = 100_000;

/// Longest length and farthest coordinate of a device [m]: far beyond any use, and its powers stay far from overflow.
pub(crate) const LONGEST_LENGTH: f64 = 1e6;

/// What stands in for a required value that is missing or faulty.
pub(super) trait Placeholder {
    /// The value.
    fn placeholder() -> Self;
}

impl Placeholder for f64 {
    fn placeholder() -> Self {
        f64::NAN
    }
}

impl<T: Placeholder, const N: usize> Placeholder for [T; N] {
    fn placeholder() -> Self {
        std::array::from_fn(|_| T::placeholder())
    }
}

impl Placeholder for String {
    fn placeholder() -> Self {
        Self::new()
    }
}

impl<T> Placeholder for Vec<T> {
    fn placeholder() -> Self {
        Self::new()
    }
}

/// One table being read.
pub(super) struct Section<'a> {
    path: String,
    table: &'a Table,
    place: Place,
    faults: &'a Faults,
    asked: RefCell<Vec<&'static str>>,
}

impl<'a> Section<'a> {
    /// A table at a key path.
    pub(super) fn new(path: String, table: &'a Table, place: Place, faults: &'a Faults) -> Self {
        Self { path, table, place, faults, asked: RefCell::default() }
    }

    /// Key path of the table.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Whether the key is written, right or wrong.
    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Whether a key is written that is known but not read here.
    pub(super) fn skip(&self, key: &'static str) -> bool {
        self.get(key).is_some()
    }

    /// Whether the key is written with a list.
    pub(super) fn is_list(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(|node| matches!(node.value, Value::Array(_)))
    }

    /// Whether the key is written with a table.
    pub(super) fn is_table(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(|node| matches!(node.value, Value::Table(_)))
    }

    /// Whether another table, which was read before, has a fault.
    pub(super) fn is_faulty(&self, table: &str) -> bool {
        self.faults.any_below(table)
    }

    /// Whether there are so many faults that looking for more would only take time.
    pub(super) fn is_crowded(&self) -> bool {
        self.faults.are_many()
    }

    /// Record a fault at a key that is known and not read.
    pub(super) fn refuse(&self, key: &'static str, message: impl Into<String>, expected: impl Into<String>) {
        self.asked.borrow_mut().push(key);
        self.wrong(key, message, expected);
    }

    /// Whether the key is written as a text.
    pub(super) fn is_text(&self, key: &str) -> bool {
        matches!(self.table.get(key).map(|node| &node.value), Some(Value::Text(_)))
    }

    fn get(&self, key: &'static str) -> Option<&'a Node> {
        self.asked.borrow_mut().push(key);
        self.table.get(key)
    }

    /// Record a fault at a key of this table, or at the table when the key is not written. The key may lead on into lists and
    /// tables: `terminals[1]`, `coils[1].name`.
    pub(super) fn fault(&self, key: &str, fill: impl FnOnce(Fault) -> Fault) {
        let path = if key.is_empty() { self.path.clone() } else { join(&self.path, key) };
        self.faults.push(fill(Fault::new(path, self.place_of(key), String::new())));
    }

    /// The place of a key as for [`Self::fault`].
    fn place_of(&self, key: &str) -> Place {
        let mut place = self.place.clone();
        let mut table = Some(self.table);
        for part in key.split('.') {
            let mut steps = part.split('[');
            let Some(mut node) = table.and_then(|table| table.get(steps.next()?)) else { return place };
            for step in steps {
                let index = step.trim_end_matches(']').parse::<usize>().ok();
                let Value::Array(items) = &node.value else { return node.place.clone() };
                let Some(item) = index.and_then(|index| items.get(index)) else { return node.place.clone() };
                node = item;
            }
            place = node.place.clone();
            table = if let Value::Table(inner) = &node.value { Some(inner) } else { None };
        }
        place
    }

    /// Record a fault about two keys that do not go together: at the second, with the first as the other place.
    pub(super) fn clash(&self, [first, second]: [&str; 2], message: impl Into<String>, expected: &str) {
        let place = self.place_of(first);
        let label = format!("`{first}` stands here");
        self.fault(second, |fault| {
            Fault { message: message.into(), ..fault }.expected(expected).other(place, label)
        });
    }

    /// Record that two items of a list of tables have one name.
    pub(super) fn named_twice(&self, key: &str, names: &[String], what: &str, expected: &str) {
        let Some([first, second]) = first_duplicate(names) else { return };
        let message = format!("two {what} are named `{}`", shown(&names[second]));
        let place = self.place_of(&format!("{key}[{first}].name"));
        self.fault(&format!("{key}[{second}].name"), |fault| {
            Fault { message, ..fault }.expected(expected).other(place, "the name stands here first")
        });
    }

    /// Record a fault with a message and what is expected instead.
    pub(super) fn wrong(&self, key: &str, message: impl Into<String>, expected: impl Into<String>) {
        self.fault(key, |fault| Fault { message: message.into(), ..fault }.expected(expected));
    }

    fn wrong_at(&self, node: &Node, path: &str, message: String, expected: &str, help: Option<String>) {
        let expected = (!expected.is_empty()).then(|| expected.to_owned());
        self.faults.push(Fault { expected, help, ..Fault::new(path, node.place.clone(), message) });
    }

    /// The value, or a placeholder with a fault when the key is missing; `example` is a value to write.
    pub(super) fn need<T: Placeholder>(&self, key: &'static str, value: Option<T>, example: &str) -> T {
        if value.is_none() && !self.has(key) {
            self.missing(key, &format!("{key} = {example}"));
        }
        value.unwrap_or_else(T::placeholder)
    }

    /// Record that a key is missing; `example` is a line that would do.
    pub(super) fn missing(&self, key: &str, example: &str) {
        let table = if self.path.is_empty() { String::new() } else { format!(" in `{}`", self.path) };
        self.fault(key, |fault| {
            Fault { message: format!("{MISSING_KEY}`{key}`{table}"), ..fault }
                .help(format!("add a line like: {example}"))
        });
    }

    /// A number without unit.
    pub(super) fn number(&self, key: &'static str, range: Range) -> Option<f64> {
        let node = self.get(key)?;
        self.number_of(node, &join(&self.path, key), range)
    }

    fn number_of(&self, node: &Node, path: &str, range: Range) -> Option<f64> {
        let value = match node.value {
            Value::Integer(value) => value as f64,
            Value::Float(value) => value,
            ref other => {
                let message = format!("`{path}` is {}, not a number", other.describe());
                self.wrong_at(node, path, message, "a number without quotes and unit", other.as_number());
                return None;
            }
        };
        self.in_range(node, path, value, range, "")
    }

    /// A quantity: text with a unit, or a bare number in SI.
    pub(super) fn quantity(&self, key: &'static str, dimension: Dimension, range: Range) -> Option<f64> {
        let node = self.get(key)?;
        self.quantity_of(node, &join(&self.path, key), dimension, range)
    }

    fn quantity_of(&self, node: &Node, path: &str, dimension: Dimension, range: Range) -> Option<f64> {
        let value = match &node.value {
            Value::Integer(value) => *value as f64,
            Value::Float(value) => *value,
            Value::Text(text) => match parse_quantity(text, dimension) {
                Ok(value) => value,
                Err(error) => {
                    let message = format!("`{path}`: {}", error.message);
                    let expected = format!("expected {}", dimension.name());
                    self.wrong_at(node, path, message, &expected, Some(error.help));
                    return None;
                }
            },
            other => {
                let message = format!("`{path}` is {}, not {}", other.describe(), dimension.name());
                let expected = format!(
                    "a text like \"{}\", or a number in {}",
                    dimension.example(),
                    dimension.si_unit()
                );
                self.wrong_at(node, path, message, &expected, None);
                return None;
            }
        };
        if dimension == Dimension::Length && value.is_finite() && value.abs() > LONGEST_LENGTH {
            let message = format!("`{path}` is {value:e} m, which is out of range");
            self.wrong_at(node, path, message, &format!("at most {LONGEST_LENGTH} m"), None);
            return None;
        }
        self.in_range(node, path, value, range, dimension.si_unit())
    }

    fn in_range(&self, node: &Node, path: &str, value: f64, range: Range, unit: &str) -> Option<f64> {
        if range.contains(value) {
            return Some(value);
        }
        let unit_text = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let message = if value.is_finite() {
            format!("`{path}` is {value}{unit_text}, which is out of range")
        } else {
            format!("`{path}` is {value}, not a finite number")
        };
        self.wrong_at(node, path, message, &format!("must be {}", range.describe(unit)), None);
        None
    }

    /// A whole number from `least` to `most`.
    pub(super) fn integer(&self, key: &'static str, least: usize, most: usize) -> Option<usize> {
        let node = self.get(key)?;
        self.integer_of(node, &join(&self.path, key), least, most)
    }

    fn integer_of(&self, node: &Node, path: &str, least: usize, most: usize) -> Option<usize> {
        let expected = format!("must be a whole number from {least} to {most}");
        match node.value {
            Value::Integer(value) => match usize::try_from(value) {
                Ok(value) if (least..=most).contains(&value) => return Some(value),
                _ => {
                    let message = format!("`{path}` is {value}, which is out of range");
                    self.wrong_at(node, path, message, &expected, None);
                }
            },
            ref other => {
                let message = format!("`{path}` is {}, not a whole number", other.describe());
                self.wrong_at(node, path, message, &expected, other.as_number());
            }
        }
        None
    }

    /// A text that is not empty.
    pub(super) fn text(&self, key: &'static str) -> Option<String> {
        let node = self.get(key)?;
        self.text_of(node, &join(&self.path, key))
    }

    fn text_of(&self, node: &Node, path: &str) -> Option<String> {
        match &node.value {
            Value::Text(text) if text.trim().is_empty() => {
                self.wrong_at(node, path, format!("`{path}` is empty"), "a text in quotes", None)
            }
            Value::Text(text) if text.chars().any(char::is_control) => {
                let message = format!("`{path}` is \"{}\", with a control character", shown(text));
                self.wrong_at(node, path, message, "a text on one line without control characters", None);
            }
            Value::Text(text) => return Some(text.clone()),
            other => {
                let message = format!("`{path}` is {}, not a text", other.describe());
                self.wrong_at(node, path, message, "a text in quotes", other.as_text());
            }
        }
        None
    }

    /// `true` or `false`.
    pub(super) fn boolean(&self, key: &'static str) -> Option<bool> {
        let node = self.get(key)?;
        if let Value::Boolean(value) = node.value {
            return Some(value);
        }
        let path = join(&self.path, key);
        let message = format!("`{path}` is {}, not true or false", node.value.describe());
        let help = match &node.value {
            Value::Text(text) if matches!(text.as_str(), "true" | "false") => Some(format!("write {text}")),
            _ => None,
        };
        self.wrong_at(node, &path, message, "true or false, without quotes", help);
        None
    }

    /// One of a few words.
    pub(super) fn choice<T: Choice>(&self, key: &'static str) -> Option<T> {
        let text = self.text(key)?;
        if let Some((_, choice)) = T::CHOICES.iter().find(|(name, _)| *name == text) {
            return Some(*choice);
        }
        let names: Vec<_> = T::CHOICES.iter().map(|(name, _)| *name).collect();
        let path = join(&self.path, key);
        self.fault(key, |fault| {
            let message = format!("`{path}` cannot be `{}`", shown(&text));
            suggest(Fault { message, ..fault }, &text, &names)
        });
        None
    }

    /// A table under a key.
    pub(super) fn table(&self, key: &'static str) -> Option<Section<'a>> {
        let node = self.get(key)?;
        self.section_of(node, join(&self.path, key))
    }

    fn section_of(&self, node: &'a Node, path: String) -> Option<Section<'a>> {
        match &node.value {
            Value::Table(table) => Some(Section::new(path, table, node.place.clone(), self.faults)),
            other => {
                let message = format!("`{path}` is {}, not a table", other.describe());
                let help = match other {
                    Value::Array(_) => Some(format!("write [{path}] with single brackets, once")),
                    _ => None,
                };
                self.wrong_at(node, &path, message, &format!("a table: [{path}]"), help);
                None
            }
        }
    }

    /// The tables of `[[key]]`.
    pub(super) fn tables(&self, key: &'static str) -> Vec<Section<'a>> {
        let path = join(&self.path, key);
        let Some(node) = self.get(key) else { return Vec::new() };
        let Value::Array(items) = &node.value else {
            let message = format!("`{path}` is {}, not a list of tables", node.value.describe());
            let help = match &node.value {
                Value::Table(_) => Some(format!("write [[{path}]] with double brackets, once for each")),
                _ => None,
            };
            self.wrong_at(node, &path, message, &format!("a list of tables: [[{path}]]"), help);
            return Vec::new();
        };
        let section = |(index, item)| self.section_of(item, format!("{path}[{index}]"));
        items.iter().enumerate().filter_map(section).collect()
    }

    /// The tables of `[key.NAME]` with their names.
    pub(super) fn named_tables(&self, key: &'static str) -> Vec<(String, Section<'a>)> {
        let Some(section) = self.table(key) else { return Vec::new() };
        let named = |(name, node): (&'a String, &'a Node)| {
            if name.trim().is_empty() || name.chars().any(char::is_control) {
                let message = format!("`{}` cannot be the name of a table in `{key}`", shown(name));
                let expected = "a name without control characters";
                self.wrong_at(node, &join(&section.path, name), message, expected, None);
                return None;
            }
            let inner = section.section_of(node, join(&section.path, name))?;
            Some((name.clone(), inner))
        };
        section.table.iter().filter_map(named).collect()
    }
}

/// Positions of a name and of the place where it comes a second time; empty names are left out.
pub(super) fn first_duplicate(names: &[String]) -> Option<[usize; 2]> {
    let mut known = HashMap::with_capacity(names.len());
    let named = names.iter().enumerate().filter(|(_, name)| !name.is_empty());
    named.into_iter().find_map(|(i, name)| known.insert(name.as_str(), i).map(|first| [first, i]))
}

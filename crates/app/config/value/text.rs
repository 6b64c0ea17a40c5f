//! Texts, names, words and truth values.

use std::collections::HashMap;
use std::path::PathBuf;

use serde_json::{Map, Value as Json, json};

use super::choice::Choice;
use super::definitions::{Definitions, Keywords, described, list_of};
use super::entry::Entry;
use super::kind::{Kind, Single, Value};
use super::limits::LONGEST_LIST;
use super::list::NotEmpty;
use crate::config::text::diagnostic::Diagnostic;
use crate::config::text::message::shown;
use crate::config::text::tree::Content;

/// A text that is not empty.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Text;

impl Single for Text {}
impl Kind for Text {}

impl Value<Text> for String {
    fn plural(_: &Text) -> &'static str {
        "names"
    }

    fn read(_: &Text, entry: &Entry<'_>) -> Option<Self> {
        let path = &entry.path;
        match &entry.node.content {
            Content::Text(text) if text.trim().is_empty() => {
                entry.wrong(format!("`{path}` is empty"), "a text that is not empty", None);
            }
            Content::Text(text) if text.chars().any(char::is_control) => {
                let message = format!("`{path}` is \"{}\", with a control character", shown(text));
                entry.wrong(message, "a text on one line without control characters", None);
            }
            Content::Text(text) => return Some(text.clone()),
            other => {
                let message = format!("`{path}` is {}, not a text", other.describe());
                entry.wrong(message, "a text in quotes", other.as_text());
            }
        }
        None
    }

    fn schema(_: &Text, definitions: &mut Definitions) -> Keywords {
        definitions.text()
    }
}

/// The path of a file or folder.
impl Value<Text> for PathBuf {
    fn read(_: &Text, entry: &Entry<'_>) -> Option<Self> {
        String::read(&Text, entry).map(Self::from)
    }

    fn schema(_: &Text, definitions: &mut Definitions) -> Keywords {
        definitions.text()
    }
}

/// A text that can stand in the header of a table: letters, digits, `_` and `-`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Column;

impl Kind for Column {}

impl Column {
    /// A name with `_` in place of all else.
    pub(in crate::config) fn of(name: &str) -> String {
        name.chars().map(|c| if c.is_alphanumeric() || c == '_' || c == '-' { c } else { '_' }).collect()
    }
}

impl Value<Column> for String {
    fn read(_: &Column, entry: &Entry<'_>) -> Option<Self> {
        let name = Self::read(&Text, entry)?;
        if name != Column::of(&name) {
            let message = format!("`{}` is `{}`", entry.path, name.escape_debug());
            entry.wrong(message, "letters, digits, `_` and `-`: it is a column of the history", None);
        }
        Some(name)
    }

    fn schema(_: &Column, _: &mut Definitions) -> Keywords {
        // Letters of other scripts are letters too; the pattern lets every character beyond ASCII pass but spaces.
        let pattern = "^(?:[A-Za-z0-9_-]|[^\\u0000-\\u007f\\s])+$";
        Map::from_iter([("type".to_owned(), "string".into()), ("pattern".to_owned(), pattern.into())])
    }
}

/// A list of different names.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Names {
    /// What a list of fixed length is expected to be.
    pub(in crate::config) expected: Option<&'static str>,
}

impl Kind for Names {}

impl Value<Names> for Vec<String> {
    fn read(_: &Names, entry: &Entry<'_>) -> Option<Self> {
        let names = Self::read(&Text, entry)?;
        let Some([first, second]) = first_duplicate(&names) else { return Some(names) };
        let message = format!("`{}` names `{}` twice", entry.path, shown(&names[second]));
        let items = entry.items("names")?;
        let diagnostic = Diagnostic::new(&*items[second].path, items[second].node.span.clone(), message)
            .expected("each name once")
            .secondary(items[first].node.span.clone(), "it stands here first");
        entry.context.sink.push(diagnostic);
        None
    }

    fn schema(_: &Names, definitions: &mut Definitions) -> Keywords {
        let mut list = list_of(definitions.text());
        list.extend([("maxItems".to_owned(), LONGEST_LIST.into()), ("uniqueItems".to_owned(), true.into())]);
        list
    }
}

impl<const N: usize> Value<Names> for [String; N] {
    fn read(kind: &Names, entry: &Entry<'_>) -> Option<Self> {
        let names = Vec::read(kind, entry)?;
        let count = names.len();
        let array = names.try_into().ok();
        if array.is_none() {
            entry.wrong(
                format!("`{}` has {count} items", entry.path),
                kind.expected.unwrap_or_default(),
                None,
            );
        }
        array
    }

    fn schema(_: &Names, definitions: &mut Definitions) -> Keywords {
        let mut list = list_of(definitions.text());
        let count = [("minItems".to_owned(), N.into()), ("maxItems".to_owned(), N.into())];
        list.extend(count);
        list.insert("uniqueItems".into(), true.into());
        list
    }
}

/// Positions of a name and of the place where it comes a second time; empty names are left out.
pub(in crate::config) fn first_duplicate(names: &[String]) -> Option<[usize; 2]> {
    let mut known = HashMap::with_capacity(names.len());
    let named = names.iter().enumerate().filter(|(_, name)| !name.is_empty());
    named.into_iter().find_map(|(i, name)| known.insert(name.as_str(), i).map(|first| [first, i]))
}

/// One name, or a list of different names that is not empty.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct NameOrNames;

impl Kind for NameOrNames {}

impl Value<NameOrNames> for Vec<String> {
    fn read(_: &NameOrNames, entry: &Entry<'_>) -> Option<Self> {
        match &entry.node.content {
            Content::Array(_) => Self::read(&NotEmpty(Names { expected: None }), entry),
            _ => String::read(&Text, entry).map(|name| vec![name]),
        }
    }

    fn schema(_: &NameOrNames, definitions: &mut Definitions) -> Keywords {
        definitions.names()
    }
}

/// One of the words of a [`Choice`].
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Word;

impl Kind for Word {}

impl<T: Choice> Value<Word> for T {
    fn read(_: &Word, entry: &Entry<'_>) -> Option<Self> {
        let word = String::read(&Text, entry)?;
        let found = choice_named(&word);
        if let Some((former, now)) = former::<T>(&word) {
            entry.former(former, now);
        }
        if found.is_none() {
            let is_axis = entry.path.ends_with("direction") && matches!(&*word, "x" | "y" | "z");
            let hint = if is_axis { ", an axis is a vector such as [0, 0, 1]" } else { "" };
            let message = format!("`{}` cannot be `{}`{hint}", entry.path, shown(&word));
            entry.unknown(message, &word, &words::<T>());
        }
        found
    }

    fn schema(_: &Word, definitions: &mut Definitions) -> Keywords {
        let words = || {
            let word = |(word, _, meaning): (&str, T, &[&str])| json!({ "description": described(meaning), "type": "string", "const": word });
            let former = |(former, word): &(&str, &str)| {
                let meaning = format!("What `{word}` was called before.");
                json!({ "description": meaning, "type": "string", "const": former, "deprecated": true })
            };
            let words = T::choices().into_iter().map(word);
            let words: Vec<Json> = words.chain(T::FORMER.iter().map(former)).collect();
            json!({ "description": described(T::ABOUT), "oneOf": words })
        };
        definitions.reference(T::NAME, |_| words())
    }
}

/// A list of different words.
impl<T: Choice> Value<Word> for Vec<T> {
    fn read(_: &Word, entry: &Entry<'_>) -> Option<Self> {
        let names = Vec::read(&Names { expected: None }, entry)?;
        let items = entry.items("names")?;
        let found = items.iter().zip(&names).map(|(item, name)| {
            let found = choice_named(name);
            if found.is_none() {
                let message = format!("`{}` cannot hold `{}`", entry.path, shown(name));
                item.unknown(message, name, &words::<T>());
            }
            found
        });
        let found: Vec<Option<T>> = found.collect();
        found.into_iter().collect()
    }

    fn schema(kind: &Word, definitions: &mut Definitions) -> Keywords {
        let mut list = list_of(T::schema(kind, definitions));
        list.insert("uniqueItems".into(), true.into());
        list
    }
}

/// The choice that a word stands for.
pub(in crate::config) fn choice_named<T: Choice>(word: &str) -> Option<T> {
    let word = former::<T>(word).map_or(word, |(_, now)| now);
    T::choices().into_iter().find(|(name, ..)| *name == word).map(|(_, choice, _)| choice)
}

/// A word of earlier versions, with the one that took its place.
fn former<T: Choice>(word: &str) -> Option<(&'static str, &'static str)> {
    T::FORMER.iter().find(|(former, _)| *former == word).copied()
}

fn words<T: Choice>() -> Vec<&'static str> {
    T::choices().into_iter().map(|(word, ..)| word).collect()
}

/// `true` or `false`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Flag;

impl Kind for Flag {}

impl Value<Flag> for bool {
    fn read(_: &Flag, entry: &Entry<'_>) -> Option<Self> {
        let help = match &entry.node.content {
            Content::Boolean(value) => return Some(*value),
            Content::Text(text) if matches!(text.as_str(), "true" | "false") => Some(format!("write {text}")),
            _ => None,
        };
        let message = format!("`{}` is {}, not true or false", entry.path, entry.node.content.describe());
        entry.wrong(message, "true or false, without quotes", help);
        None
    }

    fn schema(_: &Flag, _: &mut Definitions) -> Keywords {
        Map::from_iter([("type".to_owned(), "boolean".into())])
    }
}

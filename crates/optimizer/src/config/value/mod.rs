//! What a key of the configuration may hold.
//!
//! A *kind* says how a value is written: its unit, its range, its words. A Rust type says how many of them there are. Both
//! together read the value, with a diagnostic where it is wrong, and describe it for the schema: see [`Value`]. `kinds` is
//! the vocabulary that the declarations of the tables use.

pub(in crate::config) mod choice;
mod entry;
pub(in crate::config) mod kinds;
pub(in crate::config) mod nearest;
mod nested;
mod number;
pub(in crate::config) mod quantity;
pub(in crate::config) mod range;
mod text;

use serde_json::{Map, Value as Json};

use super::schema::definitions::Definitions;
use choice::Choice;
pub(in crate::config) use entry::Entry;
pub(in crate::config) use nested::{
    Also, Field, Group, Keys, NamedTables, OneOf, Plain, SomeQuantity, SubTable, Tables, Unread, overlay,
    unread,
};
pub(in crate::config) use number::{LONGEST_LENGTH, Number, PerAxis, Whole, ZeroOr};
use quantity::Dimension;
pub(in crate::config) use text::{Column, Flag, NameOrNames, Names, Text, Word, first_duplicate};

/// Longest list that is read: far beyond any use, and small enough to keep messages and memory bounded.
pub(in crate::config) const LONGEST_LIST: usize = 100_000;

/// Keywords of a JSON schema.
pub(in crate::config) type Keywords = Map<String, Json>;

/// A type that holds a value written as the kind `K` says.
pub(in crate::config) trait Value<K>: Sized {
    /// What several are called in messages, such as `lengths`.
    fn plural(_kind: &K) -> &'static str {
        "values"
    }

    /// The value; `None`, with a diagnostic, where it is wrong.
    fn read(kind: &K, entry: &Entry<'_>) -> Option<Self>;

    /// How the value is written.
    fn schema(kind: &K, definitions: &mut Definitions) -> Keywords;
}

/// How a value is written.
pub(in crate::config) trait Kind {
    /// What it measures.
    fn dimension(&self) -> Option<Dimension> {
        None
    }

    /// A line that writes the key; `example` is a value, or the line itself for a table.
    fn line(&self, key: &str, example: &str) -> String {
        format!("{key} = {example}")
    }
}

/// A kind of single values, of which there may be lists.
pub(in crate::config) trait Single: Kind {}

/// What stands in for a required value that is missing or faulty. A configuration with a fault is never handed out, so no
/// caller ever sees one; that of numbers is NaN, with which no later comparison holds.
pub(in crate::config) trait Placeholder {
    /// The value.
    fn placeholder() -> Self;
}

impl Placeholder for usize {
    fn placeholder() -> Self {
        0
    }
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

impl<T: Choice> Placeholder for T {
    fn placeholder() -> Self {
        Self::CHOICES[0].1
    }
}

impl<T> Placeholder for Vec<T> {
    fn placeholder() -> Self {
        Self::new()
    }
}

/// A list of any length.
impl<K: Single, T: Value<K>> Value<K> for Vec<T> {
    fn read(kind: &K, entry: &Entry<'_>) -> Option<Self> {
        let items = entry.items(T::plural(kind))?;
        let values: Self = items.iter().filter_map(|item| T::read(kind, item)).collect();
        (values.len() == items.len()).then_some(values)
    }

    fn schema(kind: &K, definitions: &mut Definitions) -> Keywords {
        let mut list = list_of(T::schema(kind, definitions));
        list.insert("maxItems".into(), LONGEST_LIST.into());
        list
    }
}

/// A list of `N`.
impl<K: Single, T: Value<K>, const N: usize> Value<K> for [T; N] {
    fn plural(_: &K) -> &'static str {
        "points"
    }

    fn read(kind: &K, entry: &Entry<'_>) -> Option<Self> {
        let values = Vec::<T>::read(kind, entry)?;
        let count = values.len();
        let array = values.try_into().ok();
        if array.is_none() {
            let expected = format!("exactly {N} {}", T::plural(kind));
            entry.wrong(format!("`{}` has {count} items", entry.path), &expected, None);
        }
        array
    }

    fn schema(kind: &K, definitions: &mut Definitions) -> Keywords {
        let mut list = list_of(T::schema(kind, definitions));
        list.insert("minItems".into(), N.into());
        list.insert("maxItems".into(), N.into());
        list
    }
}

/// The schema of a list.
pub(in crate::config) fn list_of(items: Keywords) -> Keywords {
    Map::from_iter([("type".to_owned(), "array".into()), ("items".to_owned(), items.into())])
}

/// The schema of a value of several forms.
pub(in crate::config) fn any_of<T: Into<Json>>(forms: Vec<T>) -> Keywords {
    Map::from_iter([("anyOf".to_owned(), forms.into_iter().map(Into::into).collect())])
}

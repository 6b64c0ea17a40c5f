//! What a kind is, and what a type must do to be read as one.

use super::definitions::{Definitions, Keywords};
use super::entry::Entry;
use crate::config::text::dimension::Dimension;

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

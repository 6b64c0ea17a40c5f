//! Tables within a table, groups of keys, and keys that are read elsewhere.

use std::collections::BTreeMap;
use std::marker::PhantomData;

use serde::Serialize;
use serde_json::{Map, json};

use super::{Entry, Keywords, Kind, Value, list_of};
use crate::config::schema::definitions::Definitions;
use crate::config::schema::description::Description;
use crate::config::schema::overlay;
use crate::config::section::Section;
use crate::config::table::Table;
use crate::config::text::tree::{Content, join, shown};

/// A table `[key]`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct SubTable;

impl Kind for SubTable {
    fn line(&self, _: &str, example: &str) -> String {
        example.to_owned()
    }
}

impl<G: Group> Value<SubTable> for G {
    fn read(_: &SubTable, entry: &Entry<'_>) -> Option<Self> {
        let section = entry.section()?;
        let table = G::of(G::Written::read_keys(&section), &section);
        section.finish();
        Some(table)
    }

    fn schema(_: &SubTable, definitions: &mut Definitions) -> Keywords {
        definitions.reference(G::Written::NAME, |definitions| {
            Description::of::<G::Written>(definitions).into_schema(G::Written::ABOUT)
        })
    }
}

impl<'a> Entry<'a> {
    /// The section of a table.
    pub(in crate::config) fn section(&self) -> Option<Section<'a>> {
        let path = &self.path;
        let Content::Table(table) = &self.node.content else {
            let message = format!("`{path}` is {}, not a table", self.node.content.describe());
            let help = matches!(self.node.content, Content::Array(_))
                .then(|| format!("write [{path}] with single brackets, once"));
            self.wrong(message, &format!("a table: [{path}]"), help);
            return None;
        };
        Some(Section::new(path.clone(), table, self.node.span.clone(), self.context))
    }
}

/// Tables `[[key]]`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Tables;

impl Kind for Tables {}

impl<T: Group> Value<Tables> for Vec<T> {
    fn read(_: &Tables, entry: &Entry<'_>) -> Option<Self> {
        let path = &entry.path;
        if !matches!(entry.node.content, Content::Array(_)) {
            let message = format!("`{path}` is {}, not a list of tables", entry.node.content.describe());
            let help = matches!(entry.node.content, Content::Table(_))
                .then(|| format!("write [[{path}]] with double brackets, once for each"));
            entry.wrong(message, &format!("a list of tables: [[{path}]]"), help);
            return None;
        }
        let items = entry.items("tables")?;
        // Each is read, so that all is said of all.
        let tables: Vec<Option<T>> = items.iter().map(|item| T::read(&SubTable, item)).collect();
        tables.into_iter().collect()
    }

    fn schema(_: &Tables, definitions: &mut Definitions) -> Keywords {
        list_of(<T as Value<SubTable>>::schema(&SubTable, definitions))
    }
}

/// Tables `[key.NAME]`, each with a name of the user's.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct NamedTables;

impl Kind for NamedTables {}

impl<T: Group> Value<NamedTables> for BTreeMap<String, T> {
    fn read(_: &NamedTables, entry: &Entry<'_>) -> Option<Self> {
        entry.section()?;
        let Content::Table(tables) = &entry.node.content else { return None };
        let named = |(name, node): (&String, _)| {
            let item = Entry { node, path: join(&entry.path, name), context: entry.context };
            if name.trim().is_empty() || name.chars().any(char::is_control) {
                let message = format!("`{}` cannot be the name of a table in `{}`", shown(name), entry.path);
                item.wrong(message, "a name without control characters", None);
                return None;
            }
            Some((name.clone(), T::read(&SubTable, &item)?))
        };
        Some(tables.iter().filter_map(named).collect())
    }

    fn schema(_: &NamedTables, definitions: &mut Definitions) -> Keywords {
        let table = <T as Value<SubTable>>::schema(&SubTable, definitions);
        let keywords = [
            ("type", "object".into()),
            ("additionalProperties", table.into()),
            ("propertyNames", definitions.text().into()),
        ];
        keywords.map(|(keyword, value)| (keyword.to_owned(), value)).into_iter().collect()
    }
}

/// Keys of the table around it that belong together: a [`Group`].
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Keys;

impl Kind for Keys {}

/// What is made from the keys of a table: the table itself, one of several forms, or keys that tables share.
pub(in crate::config) trait Group: Sized {
    /// The declaration of the keys.
    type Written: Table;

    /// Makes the value of the keys as they are written, and says what is wrong with them together.
    fn of(written: Self::Written, section: &Section<'_>) -> Self;
}

impl<T: Table> Group for T {
    type Written = Self;

    fn of(written: Self, _: &Section<'_>) -> Self {
        written
    }
}

/// A field that is declared without default: an optional key, or a group of keys.
pub(in crate::config) trait Plain<K> {
    /// Reads the field.
    fn read_from(section: &Section<'_>, key: &'static str, kind: &K) -> Self;

    /// Describes it.
    fn describe(kind: &K, field: Field<'_>, description: &mut Description, definitions: &mut Definitions);
}

/// A key of a table with what is said of it.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Field<'a> {
    /// As it is written.
    pub(in crate::config) key: &'a str,
    /// Lines that say what it does.
    pub(in crate::config) meaning: &'a [&'a str],
    /// What holds beside its kind.
    pub(in crate::config) also: &'a [Also],
}

/// What holds for a value beside its kind, for the schema; the check of the table says it in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(non_camel_case_types, reason = "they are written as words of a declaration")]
pub(in crate::config) enum Also {
    /// At least one item.
    not_empty,
    /// No item twice.
    each_once,
    /// Not 0.
    not_zero,
    /// A component that is not 0.
    not_all_zero,
}

impl<K: Kind, T: Value<K>> Plain<K> for Option<T> {
    fn read_from(section: &Section<'_>, key: &'static str, kind: &K) -> Self {
        section.read(key, kind)
    }

    fn describe(kind: &K, field: Field<'_>, description: &mut Description, definitions: &mut Definitions) {
        description.key::<T, K>(kind, field, None, definitions);
    }
}

impl<G: Group> Plain<Keys> for G {
    fn read_from(section: &Section<'_>, _: &'static str, _: &Keys) -> Self {
        G::of(G::Written::read_keys(section), section)
    }

    fn describe(_: &Keys, _: Field<'_>, description: &mut Description, definitions: &mut Definitions) {
        G::Written::describe_keys(description, definitions);
    }
}

/// One of the forms of a `one_of!`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct OneOf;

impl Kind for OneOf {}

/// A quantity whose dimension another key decides.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct SomeQuantity;

impl Kind for SomeQuantity {}

/// A key that is written, and read elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(in crate::config) struct Unread;

impl Value<SomeQuantity> for Unread {
    fn read(_: &SomeQuantity, _: &Entry<'_>) -> Option<Self> {
        Some(Self)
    }

    fn schema(_: &SomeQuantity, _: &mut Definitions) -> Keywords {
        Map::from_iter([("type".to_owned(), json!(["string", "number"]))])
    }
}

/// A value as the kind says, read elsewhere.
#[derive(Debug)]
pub(in crate::config) struct ReadElsewhere<T, K>(K, PhantomData<T>);

impl<T, K: Kind> Kind for ReadElsewhere<T, K> {}

/// A value of a type, read elsewhere.
pub(in crate::config) const fn unread<T: Value<K>, K>(kind: K) -> ReadElsewhere<T, K> {
    ReadElsewhere(kind, PhantomData)
}

impl<T: Value<K>, K> Value<ReadElsewhere<T, K>> for Unread {
    fn read(_: &ReadElsewhere<T, K>, _: &Entry<'_>) -> Option<Self> {
        Some(Self)
    }

    fn schema(kind: &ReadElsewhere<T, K>, definitions: &mut Definitions) -> Keywords {
        T::schema(&kind.0, definitions)
    }
}

/// A table of which every key may be left out: it is laid over one that is complete, and read then.
#[derive(Debug)]
pub(in crate::config) struct Overlay<T>(PhantomData<T>);

impl<T> Kind for Overlay<T> {}

/// A table laid over another.
pub(in crate::config) const fn overlay<T: Group>() -> Overlay<T> {
    Overlay(PhantomData)
}

impl<T: Group> Value<Overlay<T>> for Unread {
    fn read(_: &Overlay<T>, _: &Entry<'_>) -> Option<Self> {
        Some(Self)
    }

    fn schema(_: &Overlay<T>, definitions: &mut Definitions) -> Keywords {
        <T as Value<SubTable>>::schema(&SubTable, definitions);
        overlay::reference(definitions, T::Written::NAME)
    }
}

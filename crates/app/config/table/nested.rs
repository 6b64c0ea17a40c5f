//! Tables within a table, and groups of keys.

use std::collections::BTreeMap;

use super::declaration::{Table, describe};
use super::description::Description;
use super::field::Field;
use crate::config::section::Section;
use crate::config::text::dimension::Dimension;
use crate::config::text::message::shown;
use crate::config::text::tree::{Content, join};
use crate::config::value::definitions::{Definitions, Keywords, list_of};
use crate::config::value::{Entry, Kind, Value};

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
            describe::<G::Written>(definitions).into_schema(G::Written::ABOUT).into()
        })
    }
}

/// A table `key = { … }`, described where it stands.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct InlineTable;

impl Kind for InlineTable {}

impl<G: Group> Value<InlineTable> for G {
    fn read(_: &InlineTable, entry: &Entry<'_>) -> Option<Self> {
        Self::read(&SubTable, entry)
    }

    fn schema(_: &InlineTable, definitions: &mut Definitions) -> Keywords {
        describe::<G::Written>(definitions).into_schema(G::Written::ABOUT)
    }
}

impl<'a> Entry<'a> {
    /// The section of a table.
    pub(in crate::config) fn section(&self) -> Option<Section<'a>> {
        let path = &self.path;
        let Content::Table(table) = &self.node.content else {
            let (header, single) = match path.strip_suffix(']').and_then(|path| path.rsplit_once('[')) {
                Some((list, _)) => (format!("[[{list}]]"), format!("[[{list}]] once for each")),
                None => (format!("[{path}]"), format!("[{path}] with single brackets, once")),
            };
            self.not_a_table(&format!("a table: {header}"), &single);
            return None;
        };
        Some(Section::new(path.clone(), table, self.node.span.clone(), self.context))
    }

    /// Faults a value that is no table, with what to write in place of a list of tables.
    fn not_a_table(&self, expected: &str, single: &str) {
        let message = format!("`{}` is {}, not a table", self.path, self.node.content.describe());
        let help = matches!(self.node.content, Content::Array(_)).then(|| format!("write {single}"));
        self.wrong(message, expected, help);
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

/// Values by names of the user's: tables `[key.NAME]`, or `key = { NAME = value }`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct ByName<K>(pub(in crate::config) K);

impl<K: Kind> Kind for ByName<K> {
    fn dimension(&self) -> Option<Dimension> {
        self.0.dimension()
    }
}

impl<K: Kind, T: Value<K>> Value<ByName<K>> for BTreeMap<String, T> {
    fn read(ByName(kind): &ByName<K>, entry: &Entry<'_>) -> Option<Self> {
        let named_table = format!("[{}.NAME]", entry.path);
        // Values with a dimension stand behind their names, all others are tables.
        let (expected, is_of_tables) = match kind.dimension() {
            Some(dimension) => {
                (format!("names with values: {{ NAME = \"{}\" }}", dimension.example()), false)
            }
            None => (format!("a table for each name: {named_table}"), true),
        };
        let single = format!("{named_table} with single brackets, once for each");
        let Content::Table(tables) = &entry.node.content else {
            entry.not_a_table(&expected, &single);
            return None;
        };
        let named = |(name, node): (&String, _)| {
            let item = Entry { node, path: join(&entry.path, name), context: entry.context };
            if name.trim().is_empty() || name.chars().any(char::is_control) {
                let message = format!("`{}` cannot be the name of a table in `{}`", shown(name), entry.path);
                item.wrong(message, "a name that is not empty, without control characters", None);
                return None;
            }
            if is_of_tables && !matches!(item.node.content, Content::Table(_)) {
                item.not_a_table(&expected, &single);
                return None;
            }
            Some((name.clone(), T::read(kind, &item)?))
        };
        Some(tables.iter().filter_map(named).collect())
    }

    fn schema(ByName(kind): &ByName<K>, definitions: &mut Definitions) -> Keywords {
        let value = T::schema(kind, definitions);
        let keywords = [
            ("type", "object".into()),
            ("additionalProperties", value.into()),
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

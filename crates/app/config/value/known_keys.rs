//! The keys of all tables, for advice on one that is not known where it stands.

use crate::config::text::nearest::nearest_two;

/// Most tables that advice names.
const MOST_OWNERS: usize = 3;

/// The headers of all tables with their keys. A header has `NAME` for a name of the user's.
#[derive(Debug, Default)]
pub(in crate::config) struct KnownKeys(Vec<(String, Vec<String>)>);

impl KnownKeys {
    /// No table.
    pub(super) const NONE: Self = Self(Vec::new());

    /// Enters a table.
    pub(in crate::config) fn enter<'k>(&mut self, header: &str, keys: impl Iterator<Item = &'k String>) {
        self.0.push((header.to_owned(), keys.cloned().collect()));
    }

    /// The header and the keys of the table at a key path, such as `coils[0]`.
    pub(in crate::config) fn table(&self, path: &str) -> Option<(&str, &[String])> {
        let plain = without_numbers(path);
        let is_it = |header: &str| match bare(header).strip_suffix(".NAME") {
            Some(table) => plain.split_once('.').is_some_and(|(first, _)| first == table),
            None => bare(header) == plain,
        };
        self.0
            .iter()
            .find(|(header, _)| is_it(header))
            .map(|(header, keys)| (header.as_str(), keys.as_slice()))
    }

    /// The headers of the tables that have a key, but for the one at a key path.
    pub(in crate::config) fn owners(&self, key: &str, path: &str) -> Vec<&str> {
        let own = self.table(path).map(|(header, _)| header);
        let has = |(header, keys): &&(String, Vec<String>)| {
            Some(header.as_str()) != own && keys.iter().any(|known| known == key)
        };
        self.0.iter().filter(has).map(|(header, _)| header.as_str()).take(MOST_OWNERS).collect()
    }

    /// The key of another table that a misspelt one may stand for.
    pub(in crate::config) fn elsewhere(&self, key: &str) -> Option<String> {
        let all =
            || self.0.iter().flat_map(|(header, keys)| keys.iter().map(move |key| (header, key.as_str())));
        let near = nearest_two(key, all().map(|(_, key)| key)).first().copied()?;
        let (header, _) = all().find(|(_, key)| *key == near)?;
        Some(format!("did you mean `{near}`? it belongs to {header}"))
    }
}

/// A header without brackets.
fn bare(header: &str) -> &str {
    header.trim_matches(['[', ']'])
}

/// A key path without numbers of items.
fn without_numbers(path: &str) -> String {
    let parts = path.split('[').enumerate();
    parts
        .map(|(i, part)| if i == 0 { part } else { part.split_once(']').map_or("", |(_, rest)| rest) })
        .collect()
}

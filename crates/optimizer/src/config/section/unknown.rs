//! What is said of a key that its table does not know.

use super::Section;
use crate::config::text::diagnostic::Diagnostic;
use crate::config::text::source::listed;
use crate::config::text::tree::{Content, Node, join, shown};
use crate::config::value::nearest::nearest_two;

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
    fn table(&self, path: &str) -> Option<(&str, &[String])> {
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
    fn owners(&self, key: &str, path: &str) -> Vec<&str> {
        let own = self.table(path).map(|(header, _)| header);
        let has = |(header, keys): &&(String, Vec<String>)| {
            Some(header.as_str()) != own && keys.iter().any(|known| known == key)
        };
        self.0.iter().filter(has).map(|(header, _)| header.as_str()).take(MOST_OWNERS).collect()
    }

    /// The key of another table that a misspelt one may stand for.
    fn elsewhere(&self, key: &str) -> Option<String> {
        let all =
            || self.0.iter().flat_map(|(header, keys)| keys.iter().map(move |key| (header, key.as_str())));
        let near = nearest_two(key, all().map(|(_, key)| key)).first().copied()?;
        let (header, _) = all().find(|(_, key)| *key == near)?;
        Some(format!("did you mean `{near}`? it belongs to {header}"))
    }
}

/// A header without brackets.
pub(in crate::config) fn bare(header: &str) -> &str {
    header.trim_matches(['[', ']'])
}

/// A key path without numbers of items.
fn without_numbers(path: &str) -> String {
    let parts = path.split('[').enumerate();
    parts
        .map(|(i, part)| if i == 0 { part } else { part.split_once(']').map_or("", |(_, rest)| rest) })
        .collect()
}

impl Section<'_> {
    /// Report every key that nobody asked for.
    pub(in crate::config) fn finish(self) {
        if self.silent.get() {
            return;
        }
        let mut known: Vec<&str> = self.asked.borrow().clone();
        known.sort_unstable();
        known.dedup();
        for (key, node) in self.written().filter(|(key, _)| !known.contains(key)) {
            let diagnostic = self.unknown(key, node, &known);
            self.context.sink.push(diagnostic);
        }
    }

    fn unknown(&self, key: &str, node: &Node, known: &[&str]) -> Diagnostic {
        let table = if self.path.is_empty() { String::new() } else { format!(" in `{}`", self.path) };
        let message = format!("unknown key `{}`{table}", shown(key));
        let diagnostic =
            Diagnostic::new(join(&self.path, key), node.key_span.clone(), message).expected(listed(known));
        if self.is_crowded() {
            return diagnostic;
        }
        if self.hidden.borrow().contains(&key) {
            return diagnostic.help(format!(
                "`{key}` has a use beside other values of this table only, such as another shape or kind: take it out, or \
                 change these"
            ));
        }
        let keys = (self.context.keys)();
        let owners = keys.owners(key, &self.path);
        let own = keys.table(&self.path).map_or(&[][..], |(_, keys)| keys);
        let near = self.meant(key, known.iter().copied().chain(own.iter().map(String::as_str)));
        for name in &near {
            self.context.sink.retract_missing(&self.path, name);
        }
        let belongs = format!("`{key}` belongs to {}", owners.join(", "));
        let mut help = match (near.as_slice(), owners.is_empty()) {
            ([], true) => match keys.elsewhere(key) {
                Some(advice) => advice,
                None => return diagnostic,
            },
            ([], false) => format!("{belongs}: write it there"),
            ([near, rest @ ..], no_owner) => {
                let or = rest.iter().map(|other| format!(" or `{other}`")).collect::<String>();
                let moved = if no_owner { String::new() } else { format!(" or, {belongs}") };
                format!("did you mean `{near}`{or}?{moved}")
            }
        };
        let header =
            near.first().and_then(|near| keys.table(&join(&self.path, near))).map(|(header, _)| header);
        if let (Content::Table(_) | Content::Array(_), Some(header)) = (&node.content, header)
            && matches!(node.content, Content::Table(_)) == header.starts_with("[[")
        {
            help += &format!(" write {header}");
        }
        diagnostic.help(help)
    }

    /// The keys of this table that may be meant: of several that are equally near, one that is missing comes alone, and one
    /// that is there already is out.
    fn meant<'k>(&self, key: &str, keys: impl Iterator<Item = &'k str>) -> Vec<&'k str> {
        let near = nearest_two(key, keys);
        let absent: Vec<&str> = near.iter().copied().filter(|near| !self.has(near)).collect();
        if near.len() > 1 && absent.len() == 1 { absent } else { near }
    }
}

#[cfg(test)]
mod tests {
    use crate::config::schema::keys::known_keys;

    #[test]
    fn tables_are_found_by_key_path() {
        let keys = known_keys();
        let has = |path: &str, key: &str| {
            keys.table(path).is_some_and(|(_, keys)| keys.iter().any(|own| own == key))
        };
        assert!(has("coils[3]", "half_window"));
        assert!(has("materials.soft steel", "density"));
        assert!(has("morph.motion[0].rotation", "angle"));
        assert!(keys.table("nothing").is_none());
        assert_eq!(keys.table("coils").map(|(header, _)| header), Some("[[coils]]"));
    }

    #[test]
    fn the_tables_of_a_key_are_named_without_its_own() {
        let keys = known_keys();
        assert_eq!(keys.owners("frequency", "mesh")[0], "[analysis]");
        assert_eq!(keys.owners("algorithm", "design"), ["[optimizer]"]);
        assert_eq!(keys.owners("angle", "morph.motion[1].rotation"), [""; 0]);
        assert_eq!(keys.owners("nothing", ""), [""; 0]);
    }
}

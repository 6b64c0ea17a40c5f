//! What is said of a key that nobody asked for.

use super::super::fault::Fault;
use super::super::keys;
use super::super::nearest::nearest_two;
use super::super::source::listed;
use super::super::tree::{Node, Value, join, shown};
use super::Section;

impl Section<'_> {
    /// Report every key that nobody asked for.
    pub(in crate::config) fn finish(self) {
        let asked = self.asked.take();
        let mut known: Vec<&str> = asked.clone();
        known.sort_unstable();
        known.dedup();
        for (key, node) in self.table.iter().filter(|(key, _)| !asked.contains(&key.as_str())) {
            let fault = self.unknown(key, node, &known);
            self.faults.push(fault);
        }
    }

    fn unknown(&self, key: &str, node: &Node, known: &[&str]) -> Fault {
        let table = if self.path.is_empty() { String::new() } else { format!(" in `{}`", self.path) };
        let fault = |message: String| Fault {
            expected: Some(listed(known)),
            ..Fault::new(join(&self.path, key), node.key_place.clone(), message)
        };
        let own = keys::keys_at(&self.path);
        let fault = fault(format!("unknown key `{}`{table}", shown(key)));
        if self.faults.are_many() {
            return fault;
        }
        if own.contains(&key) {
            return fault.help(format!(
                "`{key}` has a use beside other values of this table only, such as another shape or kind: take it out, or \
                 change these"
            ));
        }
        let owners = keys::owners(key, &self.path);
        let near = self.meant(key, known.iter().chain(own).copied());
        for name in &near {
            self.retract_missing(name);
        }
        let belongs = |owners: &[&str]| match owners {
            [one] => format!("`{key}` belongs to {one}"),
            several => format!("`{key}` belongs to {}", several.join(", ")),
        };
        let mut help = match (near.as_slice(), owners.as_slice()) {
            ([], []) => match elsewhere(key) {
                Some(advice) => advice,
                None => return fault,
            },
            ([], owners) => format!("{}: write it there", belongs(owners)),
            ([near, rest @ ..], owners) => {
                let or = rest.iter().map(|other| format!(" or `{other}`")).collect::<String>();
                let moved =
                    if owners.is_empty() { String::new() } else { format!(" or, {}", belongs(owners)) };
                format!("did you mean `{near}`{or}?{moved}")
            }
        };
        if let (Value::Table(_) | Value::Array(_), Some(header)) =
            (&node.value, near.first().and_then(|near| keys::header(&join(&self.path, near))))
            && matches!(node.value, Value::Table(_)) == header.starts_with("[[")
        {
            help += &format!(" write {header}");
        }
        fault.help(help)
    }

    /// The keys of this table that may be meant: of several that are equally near, one that is missing comes alone, and one
    /// that is there already is out.
    fn meant<'k>(&self, key: &str, keys: impl Iterator<Item = &'k str>) -> Vec<&'k str> {
        let near = nearest_two(key, keys);
        let absent: Vec<&str> = near.iter().copied().filter(|near| !self.has(near)).collect();
        if near.len() > 1 && absent.len() == 1 { absent } else { near }
    }

    /// A key that is missing, alone or as one of several that would do, is there, misspelt.
    fn retract_missing(&self, key: &str) {
        self.faults.retract_missing(&self.path, key);
    }
}

/// The key of another table that a misspelt one may stand for.
fn elsewhere(key: &str) -> Option<String> {
    let near = nearest_two(key, keys::all().map(|(_, key)| key)).first().copied()?;
    let (header, _) = keys::all().find(|(_, key)| *key == near)?;
    Some(format!("did you mean `{near}`? it belongs to {header}"))
}

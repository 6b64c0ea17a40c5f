//! What is said of a key that its table does not know.

use super::Section;
use crate::config::text::diagnostic::Diagnostic;
use crate::config::text::message::{listed, shown};
use crate::config::text::nearest::nearest_two;
use crate::config::text::tree::{Content, Node, join};

impl Section<'_> {
    /// Report every key that nobody asked for.
    pub(in crate::config) fn finish(self) {
        if self.silent.get() {
            return;
        }
        let mut known: Vec<&str> = self.asked.borrow().clone();
        known.sort_unstable();
        known.dedup();
        let excused = self.excused.borrow();
        for (key, node) in self.written().filter(|(key, _)| !known.contains(key) && !excused.contains(key)) {
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

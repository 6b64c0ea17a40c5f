//! One value being read.

use super::context::Context;
use super::limits::LONGEST_LIST;
use crate::config::text::diagnostic::{Diagnostic, suggest};
use crate::config::text::tree::{Content, Node};

/// A value in the text, its key path, and where to say what is wrong with it.
pub(in crate::config) struct Entry<'a> {
    pub(in crate::config) node: &'a Node,
    pub(in crate::config) path: String,
    pub(in crate::config) context: &'a Context,
}

impl<'a> Entry<'a> {
    /// Record that the value is wrong, what is expected and, where that is known, what to do.
    pub(in crate::config) fn wrong(&self, message: String, expected: &str, help: Option<String>) {
        let expected = (!expected.is_empty()).then(|| expected.to_owned());
        let diagnostic = Diagnostic::new(&*self.path, self.node.span.clone(), message);
        self.context.sink.push(Diagnostic { expected, help, ..diagnostic });
    }

    /// Record that a word is none of the known ones.
    pub(in crate::config) fn unknown(&self, message: String, word: &str, known: &[&str]) {
        let diagnostic = Diagnostic::new(&*self.path, self.node.span.clone(), message);
        self.context.sink.push(suggest(diagnostic, word, known));
    }

    /// Record that a word of earlier versions stands where another one does now.
    pub(in crate::config) fn former(&self, former: &str, word: &str) {
        let notice =
            format!("`{}` = \"{former}\" is called \"{word}\" now; the old word is still read", self.path);
        self.context.notices.borrow_mut().push(notice);
    }

    /// The items of a list of `what`.
    pub(in crate::config) fn items(&self, what: &str) -> Option<Vec<Entry<'a>>> {
        let Content::Array(items) = &self.node.content else {
            let message = format!("`{}` is {}, not a list", self.path, self.node.content.describe());
            self.wrong(message, &format!("a list of {what} in brackets"), None);
            return None;
        };
        if items.len() > LONGEST_LIST {
            let message = format!("`{}` has {} items", self.path, items.len());
            self.wrong(message, &format!("at most {LONGEST_LIST} items"), None);
            return None;
        }
        let item =
            |(index, node)| Entry { node, path: format!("{}[{index}]", self.path), context: self.context };
        Some(items.iter().enumerate().map(item).collect())
    }
}

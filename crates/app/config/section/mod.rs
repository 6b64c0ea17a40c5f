//! Reads one table: each key is read once, checked, and what is wrong is recorded.
//!
//! A reader returns `None` both for a key that is absent and for one that is faulty; a required key then takes a
//! placeholder, and reading goes on, so that all faults are reported at once.

mod unknown;

use std::cell::{Cell, RefCell};

use super::text::diagnostic::{Diagnostic, Span, suggest};
use super::text::message::shown;
use super::text::tree::{Content, Node, Table, join};
use super::value::{Context, Entry, Kind, Placeholder, Value, first_duplicate};

/// One table being read.
pub(super) struct Section<'a> {
    path: String,
    table: &'a Table,
    span: Span,
    context: &'a Context,
    /// The keys that this table knows.
    asked: RefCell<Vec<&'static str>>,
    /// The keys that have no use beside the values of others.
    hidden: RefCell<Vec<&'static str>>,
    /// The keys of which nothing is said: those of earlier versions, and those beside a faulty value.
    excused: RefCell<Vec<&'static str>>,
    /// Whether nothing is said of unknown keys.
    silent: Cell<bool>,
}

impl<'a> Section<'a> {
    /// A table at a key path.
    pub(super) fn new(path: String, table: &'a Table, span: Span, context: &'a Context) -> Self {
        let silent = Cell::new(false);
        let (asked, hidden, excused) = Default::default();
        Self { path, table, span, context, asked, hidden, excused, silent }
    }

    /// Key path of the table.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Whether the key is written, right or wrong; it may lead on into tables and lists.
    pub(super) fn has(&self, key: &str) -> bool {
        self.find(key).0.is_some()
    }

    /// Whether the key is written with several values, as a list or a table.
    pub(super) fn has_several(&self, key: &str) -> bool {
        let content = self.table.get(key).map(|node| &node.content);
        matches!(content, Some(Content::Array(_) | Content::Table(_)))
    }

    /// Whether a value below a key path of the whole configuration, which was read before, has a fault.
    pub(super) fn is_faulty(&self, path: &str) -> bool {
        self.context.sink.any_below(path)
    }

    /// Whether there are so many faults that looking for more would only take time.
    pub(super) fn is_crowded(&self) -> bool {
        self.context.sink.are_many()
    }

    /// Keys that have no use beside the values of others: they are not read, and unknown.
    pub(super) fn hide(&self, keys: Vec<&'static str>) {
        self.hidden.borrow_mut().extend(keys);
    }

    /// Keys of earlier versions, which have no effect: a notice says so, and why.
    pub(super) fn pass_over(&self, keys: &[(&'static str, &str)]) {
        for (key, why) in keys {
            self.excused.borrow_mut().push(key);
            if self.has(key) {
                let notice =
                    format!("`{}` is of an earlier version, and has no effect: {why}", join(&self.path, key));
                self.context.notices.borrow_mut().push(notice);
            }
        }
    }

    /// Record what is wrong with a key that is known and not read.
    pub(super) fn refuse(&self, key: &'static str, message: impl Into<String>, expected: impl Into<String>) {
        self.asked.borrow_mut().push(key);
        self.wrong(key, message, expected);
    }

    /// Nothing is said of unknown keys: what is known depends on a key that is missing or faulty.
    pub(super) fn silence(&self) {
        self.silent.set(true);
    }

    /// Nothing is said of keys that have a use beside other values: which of these is meant is not known.
    pub(super) fn excuse_hidden(&self) {
        self.excused.borrow_mut().extend(self.hidden.borrow().iter());
    }

    /// The value of a key that is known from here on.
    fn entry(&self, key: &'static str) -> Option<Entry<'a>> {
        if self.hidden.borrow().contains(&key) {
            return None;
        }
        self.asked.borrow_mut().push(key);
        let node = self.table.get(key)?;
        Some(Entry { node, path: join(&self.path, key), context: self.context })
    }

    /// Reads a key.
    pub(super) fn read<K, T: Value<K>>(&self, key: &'static str, kind: &K) -> Option<T> {
        T::read(kind, &self.entry(key)?)
    }

    /// Reads a key that is known already, without a word on what is wrong with it.
    pub(super) fn peek<K, T: Value<K>>(&self, key: &str, kind: &K) -> Option<T> {
        let (node, context) = (self.table.get(key)?, Context::default());
        T::read(kind, &Entry { node, path: String::new(), context: &context })
    }

    /// Reads a required key; `example` is a value to write.
    pub(super) fn need<K: Kind, T: Value<K> + Placeholder>(
        &self,
        key: &'static str,
        kind: &K,
        example: &str,
    ) -> T {
        if !self.has(key) {
            self.missing(&[key], &kind.line(key, example));
        }
        self.read(key, kind).unwrap_or_else(T::placeholder)
    }

    /// The table at a key path of this one, such as `terms[1]`, for a check of several tables.
    pub(super) fn inner(&self, path: &str) -> Option<Section<'a>> {
        self.section_of(path, self.find(path).0?)
    }

    /// The table under a name of the user's.
    pub(super) fn named(&self, name: &str) -> Option<Section<'a>> {
        self.section_of(name, self.table.get(name)?)
    }

    fn section_of(&self, key: &str, node: &'a Node) -> Option<Section<'a>> {
        Some(Section::new(join(&self.path, key), node.content.table()?, node.span.clone(), self.context))
    }

    /// Record that one of some keys is missing; `example` is a line that would do.
    pub(super) fn missing(&self, keys: &[&'static str], example: &str) {
        let key = keys.first().copied().unwrap_or_default();
        let table = if self.path.is_empty() { String::new() } else { format!(" in `{}`", self.path) };
        self.record(key, format!("missing key `{key}`{table}"), |diagnostic| {
            Diagnostic { missing: keys.to_vec(), ..diagnostic }.help(format!("add a line like: {example}"))
        });
    }

    /// Record a message at a key of this table, or at the table when the key is not written. The key may lead on into lists
    /// and tables: `terminals[1]`, `coils[1].name`.
    fn record(&self, key: &str, message: String, fill: impl FnOnce(Diagnostic) -> Diagnostic) {
        let path = if key.is_empty() { self.path.clone() } else { join(&self.path, key) };
        self.context.sink.push(fill(Diagnostic::new(path, self.span_of(key), message)));
    }

    /// Record a message and what is expected instead.
    pub(super) fn wrong(&self, key: &str, message: impl Into<String>, expected: impl Into<String>) {
        self.record(key, message.into(), |diagnostic| diagnostic.expected(expected));
    }

    /// Record that a name is none of the known ones.
    pub(super) fn unknown_name(&self, key: &str, message: String, name: &str, known: &[&str]) {
        self.record(key, message, |diagnostic| suggest(diagnostic, name, known));
    }

    /// Record that two keys do not go together: at the second, with the first as the other place.
    pub(super) fn clash(&self, [first, second]: [&str; 2], message: impl Into<String>, expected: &str) {
        let label = format!("`{first}` stands here");
        self.record(second, message.into(), |diagnostic| {
            diagnostic.expected(expected).secondary(self.span_of(first), label)
        });
    }

    /// Whether one of these keys is written; it is wrong to write two.
    pub(super) fn at_most_one(&self, keys: &[&str], expected: &str) -> bool {
        let written: Vec<&str> = keys.iter().copied().filter(|key| self.has(key)).collect();
        if let [first, second, ..] = written[..] {
            self.clash(
                [first, second],
                format!("`{}` has both `{first}` and `{second}`", self.path),
                expected,
            );
        }
        !written.is_empty()
    }

    /// It is wrong to write none of these keys, or two; `example` is a line that would do.
    pub(super) fn exactly_one(&self, keys: &[&'static str], example: &str, expected: &str) {
        if !self.at_most_one(keys, expected) {
            self.missing(keys, example);
        }
    }

    /// Record that two items of a list of tables have one name.
    pub(super) fn named_twice<'n>(
        &self,
        key: &str,
        names: impl IntoIterator<Item = &'n String>,
        what: &str,
        expected: &str,
    ) {
        let names: Vec<String> = names.into_iter().cloned().collect();
        let Some([first, second]) = first_duplicate(&names) else { return };
        let message = format!("two {what} are named `{}`", shown(&names[second]));
        let first = self.span_of(&format!("{key}[{first}].name"));
        self.record(&format!("{key}[{second}].name"), message, |diagnostic| {
            diagnostic.expected(expected).secondary(first, "the name stands here first")
        });
    }

    /// Where a key stands, as for [`Self::record`].
    fn span_of(&self, key: &str) -> Span {
        self.find(key).1
    }

    /// The value at a key path, and where it stands, or the nearest of what is around it.
    fn find(&self, key: &str) -> (Option<&'a Node>, Span) {
        let mut found = None;
        let mut span = self.span.clone();
        let mut table = Some(self.table);
        for part in key.split('.') {
            let mut steps = part.split('[');
            let Some(mut node) = table.and_then(|table| table.get(steps.next()?)) else {
                return (None, span);
            };
            for step in steps {
                let index = step.trim_end_matches(']').parse::<usize>().ok();
                let item = node.content.list().and_then(|items| items.get(index?));
                let Some(item) = item else { return (None, node.span.clone()) };
                node = item;
            }
            span = node.span.clone();
            table = node.content.table();
            found = Some(node);
        }
        (found, span)
    }

    /// The keys that are written, with their values.
    fn written(&self) -> impl Iterator<Item = (&'a str, &'a Node)> {
        self.table.iter().map(|(key, node)| (key.as_str(), node))
    }
}

//! What is wrong with a configuration, and where.

use std::cell::RefCell;
use std::ops::Range;

use super::message::listed;
use super::nearest::offer;

/// A stretch of one of the texts a configuration was read from.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Span {
    /// Index into [`SourceMap::documents`](super::source::SourceMap::documents): 0 is the file, the rest are overrides.
    pub document: usize,
    /// Byte range in that text.
    pub range: Range<usize>,
}

/// One fault of a configuration.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Diagnostic {
    /// Key path, such as `coils[0].center`; empty for the file as a whole.
    pub path: String,
    /// Where it stands.
    pub span: Span,
    /// What is wrong: lower case, names the value.
    pub message: String,
    /// What would be right, shown under the excerpt.
    pub expected: Option<String>,
    /// What to do.
    pub help: Option<String>,
    /// A second place that the fault has to do with, such as where a key stood first, and what is there.
    pub secondary: Option<(Span, String)>,
    /// The keys of the table at [`Self::path`] of which one is missing; none for any other fault.
    pub missing: Vec<&'static str>,
}

impl Diagnostic {
    /// A fault with a message only.
    pub fn new(path: impl Into<String>, span: Span, message: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            span,
            message: message.into(),
            expected: None,
            help: None,
            secondary: None,
            missing: Vec::new(),
        }
    }

    /// The same fault with the expected value or range.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// The same fault with a second place and what is there.
    #[must_use]
    pub fn secondary(mut self, span: Span, label: impl Into<String>) -> Self {
        self.secondary = Some((span, label.into()));
        self
    }

    /// The same fault with a line that says what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The same with what its message says behind the last `; `, the advice of an error, as its help.
    pub(crate) fn with_advice_apart(mut self) -> Self {
        if let Some((message, advice)) = self.message.rsplit_once("; ") {
            self.help = Some(advice.to_owned());
            self.message = message.to_owned();
        }
        self
    }
}

/// The fault with the nearest known name as help and all known names as the expectation.
pub(in crate::config) fn suggest(diagnostic: Diagnostic, name: &str, known: &[&str]) -> Diagnostic {
    let help = offer(name, known.iter().copied());
    Diagnostic { help, ..diagnostic }.expected(listed(known))
}

/// Faults from which on no more advice is given: far more than are shown.
const MANY: usize = 500;

/// Gathers the faults of one reading: readers go on after a fault, so that all are reported at once.
#[derive(Debug, Default)]
pub(in crate::config) struct DiagnosticSink(RefCell<Vec<Diagnostic>>);

impl DiagnosticSink {
    /// Record a fault.
    pub(in crate::config) fn push(&self, diagnostic: Diagnostic) {
        self.0.borrow_mut().push(diagnostic);
    }

    /// Take back that a key of the table at a path is missing, alone or as one of several that would do: it is there,
    /// misspelt.
    pub(in crate::config) fn retract_missing(&self, table: &str, key: &str) {
        let of_table = |path: &str| path.rsplit_once('.').map_or("", |(table, _)| table) == table;
        self.0.borrow_mut().retain(|known| !(known.missing.contains(&key) && of_table(&known.path)));
    }

    /// Whether there are so many that advice and comparisons would only take time.
    pub(in crate::config) fn are_many(&self) -> bool {
        self.0.borrow().len() > MANY
    }

    /// Whether there is a fault below a path.
    pub(in crate::config) fn any_below(&self, path: &str) -> bool {
        let is_below =
            |known: &Diagnostic| known.path.strip_prefix(path).is_some_and(|rest| rest.starts_with('.'));
        self.are_many() || self.0.borrow().iter().any(is_below)
    }

    /// All faults in the order of the text they stand in.
    pub(in crate::config) fn into_sorted(self) -> Vec<Diagnostic> {
        let mut diagnostics = self.0.into_inner();
        sort(&mut diagnostics);
        diagnostics
    }
}

/// Brings faults into the order of the text they stand in.
pub(in crate::config) fn sort(diagnostics: &mut [Diagnostic]) {
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.document, diagnostic.span.range.start));
}

//! What is wrong with a configuration, and where.

use std::cell::RefCell;
use std::ops::Range;

/// A stretch of one of the texts a configuration was read from.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Place {
    /// Index into [`Source::documents`](super::Source::documents): 0 is the file, the rest are overrides.
    pub document: usize,
    /// Byte range in that text.
    pub span: Range<usize>,
}

/// One fault of a configuration.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Fault {
    /// Key path, such as `coils[0].center`; empty for the file as a whole.
    pub path: String,
    /// Where it stands.
    pub place: Place,
    /// What is wrong: lower case, names the value.
    pub message: String,
    /// What would be right, shown under the excerpt.
    pub expected: Option<String>,
    /// What to do.
    pub help: Option<String>,
    /// A second place that the fault has to do with, such as where a key stood first, and what is there.
    pub other: Option<(Place, String)>,
}

impl Fault {
    /// A fault with a message only.
    pub fn new(path: impl Into<String>, place: Place, message: impl Into<String>) -> Self {
        Self { path: path.into(), place, message: message.into(), expected: None, help: None, other: None }
    }

    /// The same fault with the expected value or range.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// The same fault with a second place and what is there.
    #[must_use]
    pub fn other(mut self, place: Place, label: impl Into<String>) -> Self {
        self.other = Some((place, label.into()));
        self
    }

    /// The same fault with a line that says what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Faults from which on no more advice is given: far more than are shown.
const MANY: usize = 500;

/// How the message of a missing key starts.
pub(super) const MISSING_KEY: &str = "missing key ";

/// Gathers the faults of one reading: readers go on after a fault, so that all are reported at once.
#[derive(Debug, Default)]
pub(super) struct Faults(RefCell<Vec<Fault>>);

impl Faults {
    /// Record a fault.
    pub(super) fn push(&self, fault: Fault) {
        self.0.borrow_mut().push(fault);
    }

    /// Take back that a key of the table at a path is missing, alone or as one of several that would do: it is there,
    /// misspelt.
    pub(super) fn retract_missing(&self, table: &str, key: &str) {
        let of_table = |path: &str| path.rsplit_once('.').map_or("", |(table, _)| table) == table;
        let says = |fault: &Fault| {
            let example = fault.help.as_deref().unwrap_or_default();
            let forms = [format!(" {key} = "), format!("[{key}]"), format!(".{key}]")];
            forms.iter().any(|form| example.contains(form.as_str()))
        };
        self.0.borrow_mut().retain(|fault| {
            !(fault.message.starts_with(MISSING_KEY) && of_table(&fault.path) && says(fault))
        });
    }

    /// Whether there are so many that advice and comparisons would only take time.
    pub(super) fn are_many(&self) -> bool {
        self.0.borrow().len() > MANY
    }

    /// Whether there is a fault in the table at a path.
    pub(super) fn any_below(&self, table: &str) -> bool {
        if self.are_many() {
            return true;
        }
        let below = |fault: &Fault| fault.path.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'));
        self.0.borrow().iter().any(below)
    }

    /// All faults in the order of the text they stand in.
    pub(super) fn into_sorted(self) -> Vec<Fault> {
        let mut faults = self.0.into_inner();
        sort(&mut faults);
        faults
    }
}

/// Brings faults into the order of the text they stand in.
pub(super) fn sort(faults: &mut [Fault]) {
    faults.sort_by_key(|fault| (fault.place.document, fault.place.span.start));
}

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
}

impl Fault {
    /// The same fault with the expected value or range.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// The same fault with a line that says what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Gathers the faults of one reading: readers go on after a fault, so that all are reported at once.
#[derive(Debug, Default)]
pub(super) struct Faults(RefCell<Vec<Fault>>);

impl Faults {
    /// Record a fault.
    pub(super) fn push(&self, fault: Fault) {
        self.0.borrow_mut().push(fault);
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

/// Longest name that is compared letter by letter [characters]: the comparison takes time and memory by the product of the
/// lengths, and a longer name is no slip of the pen.
const LONGEST_COMPARED: usize = 64;

/// The candidate that `name` was probably meant to be, if one is near enough.
///
/// Near means at most one edit for every three letters (two at least for short names of four letters or
/// more), or equal but for case, `-` and `_`.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let fold = |text: &str| text.to_lowercase().replace(['-', ' '], "_");
    let wanted = fold(name);
    let length = wanted.chars().count();
    if length > LONGEST_COMPARED {
        return None;
    }
    let limit = if length >= 4 { (length / 3).max(2) } else { 1 };
    candidates
        .into_iter()
        .filter(|candidate| candidate.chars().count() <= LONGEST_COMPARED + limit)
        .map(|candidate| (fold(candidate), candidate))
        // Every missing letter is an edit.
        .filter(|(folded, _)| folded.chars().count().abs_diff(length) <= limit)
        .map(|(folded, candidate)| (strsim::damerau_levenshtein(&wanted, &folded), candidate))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn the_nearest_name_is_suggested_only_when_it_is_near() {
        let names = ["frequency", "penalty", "x_min", "x_max"];
        assert_eq!(nearest("freqency", names), Some("frequency"));
        assert_eq!(nearest("Frequency", names), Some("frequency"));
        assert_eq!(nearest("x-min", names), Some("x_min"));
        assert_eq!(nearest("conductivity", names), None);
        assert_eq!(nearest("", names), None);
    }

    #[test]
    fn long_names_are_not_compared() {
        // Compared letter by letter, these two would take eight gigabytes.
        let (name, other) = ("a".repeat(32_000), "b".repeat(32_000));
        assert_eq!(nearest(&name, [other.as_str(), "x_min"]), None);
        assert_eq!(nearest("x_mim", [other.as_str(), "x_min"]), Some("x_min"));
    }
}

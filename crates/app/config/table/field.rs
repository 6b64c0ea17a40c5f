//! A key and what is said of it in its declaration.

/// A key of a table with what is said of it.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Field<'a> {
    /// As it is written.
    pub(in crate::config) key: &'a str,
    /// Lines that say what it does.
    pub(in crate::config) meaning: &'a [&'a str],
    /// What holds beside its kind.
    pub(in crate::config) also: &'a [Also],
}

/// What holds for a value beside its kind, for the schema; the check of the table says it in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(non_camel_case_types, reason = "they are written as words of a declaration")]
pub(in crate::config) enum Also {
    /// No item twice.
    each_once,
    /// Not 0.
    not_zero,
    /// A component that is not 0.
    not_all_zero,
}

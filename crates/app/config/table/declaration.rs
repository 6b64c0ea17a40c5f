//! What a declaration gives a table: how its keys are read, and how they are described.

use super::description::Description;
use crate::config::section::Section;
use crate::config::text::diagnostic::Span;
use crate::config::text::tree;
use crate::config::value::Context;
use crate::config::value::definitions::Definitions;

/// A table of the configuration.
pub(in crate::config) trait Table: Sized {
    /// Name of its definition in the schema.
    const NAME: &'static str;
    /// Lines that describe it.
    const ABOUT: &'static [&'static str];

    /// Reads its keys.
    fn read_keys(section: &Section<'_>) -> Self;

    /// Describes its keys.
    fn describe_keys(description: &mut Description, definitions: &mut Definitions);
}

/// The description of a table.
pub(in crate::config) fn describe<T: Table>(definitions: &mut Definitions) -> Description {
    let mut description = Description::default();
    T::describe_keys(&mut description, definitions);
    description
}

/// The table with every key left out.
pub(in crate::config) fn left_out<T: Table>() -> T {
    let (table, context) = (tree::Table::new(), Context::default());
    T::read_keys(&Section::new(String::new(), &table, Span { document: 0, range: 0..0 }, &context))
}

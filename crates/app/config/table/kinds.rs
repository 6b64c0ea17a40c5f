//! The vocabulary of `table!`: what a key may hold, its unit and its range.

use super::nested::{ByName, InlineTable, Keys, SubTable, Tables};
use super::unread::{OneOf, SomeQuantity};
pub(in crate::config) use super::unread::{overlay, unread};
use crate::config::text::dimension::Dimension;
pub(in crate::config) use crate::config::text::dimension::Dimension::*;
use crate::config::value::range::Range;
use crate::config::value::{
    Column, Flag, NameOrNames, Names, NotEmpty, Number, PerAxis, Text, Whole, Word, ZeroOr,
};

/// A text that is not empty.
pub(in crate::config) const TEXT: Text = Text;
/// A text that can stand in the header of a table: letters, digits, `_` and `-`.
pub(in crate::config) const COLUMN: Column = Column;
/// A list of different names.
pub(in crate::config) const NAMES: Names = Names { expected: None };
/// One name, or a list of different names that is not empty.
pub(in crate::config) const NAME_OR_NAMES: NameOrNames = NameOrNames;
/// One of the words of a `choice!`.
pub(in crate::config) const WORD: Word = Word;
/// `true` or `false`.
pub(in crate::config) const FLAG: Flag = Flag;
/// A table `[key]`.
pub(in crate::config) const TABLE: SubTable = SubTable;
/// A table `key = { … }`, described where it stands.
pub(in crate::config) const INLINE: InlineTable = InlineTable;
/// Tables `[[key]]`.
pub(in crate::config) const TABLES: Tables = Tables;
/// Tables `[key.NAME]`.
pub(in crate::config) const NAMED: ByName<SubTable> = ByName(SubTable);
/// Keys of this very table that belong together.
pub(in crate::config) const KEYS: Keys = Keys;
/// One of the forms of a `one_of!`.
pub(in crate::config) const ONE_OF: OneOf = OneOf;
/// A quantity whose dimension another key decides: it is read by the check of the table.
pub(in crate::config) const SOME_QUANTITY: SomeQuantity = SomeQuantity;

/// Every finite number.
pub(in crate::config) const FINITE: Range = Range::FINITE;
/// `> 0`.
pub(in crate::config) const POSITIVE: Range = Range::POSITIVE;
/// `>= 0`.
pub(in crate::config) const NOT_NEGATIVE: Range = Range::NOT_NEGATIVE;

/// A number without unit.
pub(in crate::config) const fn number(range: Range) -> Number {
    Number { dimension: None, range }
}

/// A quantity: a text with a unit, or a bare number in SI.
pub(in crate::config) const fn quantity(dimension: Dimension, range: Range) -> Number {
    Number { dimension: Some(dimension), range }
}

/// A length.
pub(in crate::config) const fn length(range: Range) -> Number {
    quantity(Length, range)
}

/// A whole number from `least` to `most`.
pub(in crate::config) const fn integer(least: usize, most: usize) -> Whole {
    Whole { least, most }
}

/// Values by names of the user's.
pub(in crate::config) const fn by_name<K>(kind: K) -> ByName<K> {
    ByName(kind)
}

/// Three lengths, or one that holds along all three axes.
pub(in crate::config) const fn length_per_axis(range: Range) -> PerAxis {
    PerAxis(range)
}

/// A number, or 0 for none.
pub(in crate::config) const fn zero_or(range: Range) -> ZeroOr {
    ZeroOr(range)
}

/// A list with at least one item.
pub(in crate::config) const fn not_empty<K>(kind: K) -> NotEmpty<K> {
    NotEmpty(kind)
}

/// Two different names; `expected` says which.
pub(in crate::config) const fn two_names(expected: &'static str) -> Names {
    Names { expected: Some(expected) }
}

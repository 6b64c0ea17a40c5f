//! What a key of the configuration may hold.
//!
//! A *kind* says how a value is written: its unit, its range, its words. A Rust type says how many of them there are. Both
//! together read the value, with a diagnostic where it is wrong, and describe it for the schema: see [`Value`].

pub(super) mod choice;
mod context;
pub(super) mod definitions;
mod entry;
mod kind;
mod known_keys;
mod limits;
mod list;
mod number;
mod placeholder;
pub(super) mod range;
mod text;

pub(super) use context::Context;
pub(super) use entry::Entry;
pub(super) use kind::{Kind, Value};
pub(super) use known_keys::KnownKeys;
pub(crate) use limits::LONGEST_LENGTH;
pub(super) use list::NotEmpty;
pub(super) use number::{Number, PerAxis, Whole, ZeroOr};
pub(super) use placeholder::Placeholder;
pub(super) use text::{Column, Flag, NameOrNames, Names, Text, Word, choice_named, first_duplicate};

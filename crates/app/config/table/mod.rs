//! The tables of a configuration in general: how one is declared, read and described. `declare` says how.

pub(super) mod declaration;
mod declare;
pub(super) mod description;
pub(super) mod field;
pub(super) mod kinds;
pub(super) mod nested;
pub(super) mod overlay;
pub(super) mod rules;
pub(super) mod unread;

pub(super) use declaration::{Table, describe, left_out};
pub(super) use declare::{one_of, table};
pub(super) use nested::Group;
pub(super) use unread::Unread;

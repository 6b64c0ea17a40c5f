//! Values of several forms, and keys that are read elsewhere: by the check of their table, or once they are laid over others.

use std::marker::PhantomData;

use serde::Serialize;
use serde_json::{Map, json};

use super::declaration::Table;
use super::nested::{Group, SubTable};
use super::overlay::reference;
use crate::config::value::definitions::{Definitions, Keywords};
use crate::config::value::{Entry, Kind, Value};

/// One of the forms of a `one_of!`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct OneOf;

impl Kind for OneOf {}

/// A quantity whose dimension another key decides.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct SomeQuantity;

impl Kind for SomeQuantity {}

/// A key that is written, and read elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(in crate::config) struct Unread;

impl Value<SomeQuantity> for Unread {
    fn read(_: &SomeQuantity, _: &Entry<'_>) -> Option<Self> {
        Some(Self)
    }

    fn schema(_: &SomeQuantity, _: &mut Definitions) -> Keywords {
        Map::from_iter([("type".to_owned(), json!(["string", "number"]))])
    }
}

/// A value as the kind says, read elsewhere.
#[derive(Debug)]
pub(in crate::config) struct ReadElsewhere<T, K>(K, PhantomData<T>);

impl<T, K: Kind> Kind for ReadElsewhere<T, K> {}

/// A value of a type, read elsewhere.
pub(in crate::config) const fn unread<T: Value<K>, K>(kind: K) -> ReadElsewhere<T, K> {
    ReadElsewhere(kind, PhantomData)
}

impl<T: Value<K>, K> Value<ReadElsewhere<T, K>> for Unread {
    fn read(_: &ReadElsewhere<T, K>, _: &Entry<'_>) -> Option<Self> {
        Some(Self)
    }

    fn schema(kind: &ReadElsewhere<T, K>, definitions: &mut Definitions) -> Keywords {
        T::schema(&kind.0, definitions)
    }
}

/// A table of which every key may be left out: it is laid over one that is complete, and read then.
#[derive(Debug)]
pub(in crate::config) struct Overlay<T>(PhantomData<T>);

impl<T> Kind for Overlay<T> {}

/// A table laid over another.
pub(in crate::config) const fn overlay<T: Group>() -> Overlay<T> {
    Overlay(PhantomData)
}

impl<T: Group> Value<Overlay<T>> for Unread {
    fn read(_: &Overlay<T>, _: &Entry<'_>) -> Option<Self> {
        Some(Self)
    }

    fn schema(_: &Overlay<T>, definitions: &mut Definitions) -> Keywords {
        <T as Value<SubTable>>::schema(&SubTable, definitions);
        reference(definitions, T::Written::NAME)
    }
}

//! Lists.

use super::definitions::{Definitions, Keywords, list_of};
use super::entry::Entry;
use super::kind::{Kind, Single, Value};
use super::limits::LONGEST_LIST;
use crate::config::text::dimension::Dimension;

/// A list of any length.
impl<K: Single, T: Value<K>> Value<K> for Vec<T> {
    fn read(kind: &K, entry: &Entry<'_>) -> Option<Self> {
        let items = entry.items(T::plural(kind))?;
        let values: Self = items.iter().filter_map(|item| T::read(kind, item)).collect();
        (values.len() == items.len()).then_some(values)
    }

    fn schema(kind: &K, definitions: &mut Definitions) -> Keywords {
        let mut list = list_of(T::schema(kind, definitions));
        list.insert("maxItems".into(), LONGEST_LIST.into());
        list
    }
}

/// A list of `N`.
impl<K: Single, T: Value<K>, const N: usize> Value<K> for [T; N] {
    fn plural(_: &K) -> &'static str {
        "points"
    }

    fn read(kind: &K, entry: &Entry<'_>) -> Option<Self> {
        let values = Vec::<T>::read(kind, entry)?;
        let count = values.len();
        let array = values.try_into().ok();
        if array.is_none() {
            let expected = format!("exactly {N} {}", T::plural(kind));
            entry.wrong(format!("`{}` has {count} items", entry.path), &expected, None);
        }
        array
    }

    fn schema(kind: &K, definitions: &mut Definitions) -> Keywords {
        let mut list = list_of(T::schema(kind, definitions));
        list.insert("minItems".into(), N.into());
        list.insert("maxItems".into(), N.into());
        list
    }
}

/// A list with at least one item, each as another kind says.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct NotEmpty<K>(pub(in crate::config) K);

impl<K: Kind> Kind for NotEmpty<K> {
    fn dimension(&self) -> Option<Dimension> {
        self.0.dimension()
    }
}

impl<K: Kind, T> Value<NotEmpty<K>> for Vec<T>
where
    Self: Value<K>,
{
    fn read(NotEmpty(kind): &NotEmpty<K>, entry: &Entry<'_>) -> Option<Self> {
        let list = Self::read(kind, entry)?;
        if list.is_empty() {
            entry.wrong(format!("`{}` is an empty list", entry.path), "at least one item", None);
            return None;
        }
        Some(list)
    }

    fn schema(NotEmpty(kind): &NotEmpty<K>, definitions: &mut Definitions) -> Keywords {
        let mut list = Self::schema(kind, definitions);
        list.insert("minItems".into(), 1.into());
        list
    }
}

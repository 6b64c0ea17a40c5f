//! Lists and arrays of a table: of numbers, quantities, points, corners and names.

use super::super::fault::Fault;
use super::super::quantity::Dimension;
use super::super::range::Range;
use super::super::tree::{Node, Value, join, shown};
use super::{LONGEST_LIST, Section, first_duplicate};

impl Section<'_> {
    /// A list of items, each read by `read(item, key path of the item)`; faulty items are left out.
    fn list<T>(
        &self,
        key: &'static str,
        what: &str,
        read: impl Fn(&Node, &str) -> Option<T>,
    ) -> Option<Vec<T>> {
        let node = self.get(key)?;
        self.list_of(node, &join(&self.path, key), what, read)
    }

    fn list_of<T>(
        &self,
        node: &Node,
        path: &str,
        what: &str,
        read: impl Fn(&Node, &str) -> Option<T>,
    ) -> Option<Vec<T>> {
        let Value::Array(items) = &node.value else {
            let message = format!("`{path}` is {}, not a list", node.value.describe());
            self.wrong_at(node, path, message, &format!("a list of {what} in brackets"), None);
            return None;
        };
        if items.len() > LONGEST_LIST {
            let message = format!("`{path}` has {} items", items.len());
            self.wrong_at(node, path, message, &format!("at most {LONGEST_LIST} items"), None);
            return None;
        }
        let values: Vec<_> = items
            .iter()
            .enumerate()
            .filter_map(|(index, item)| read(item, &format!("{path}[{index}]")))
            .collect();
        (values.len() == items.len()).then_some(values)
    }

    fn array_of<const N: usize, T: Copy>(
        &self,
        node: &Node,
        path: &str,
        what: &str,
        read: impl Fn(&Node, &str) -> Option<T>,
    ) -> Option<[T; N]> {
        let values = self.list_of(node, path, what, read)?;
        let count = values.len();
        let array = values.try_into().ok();
        if array.is_none() {
            let message = format!("`{path}` has {count} items");
            self.wrong_at(node, path, message, &format!("exactly {N} {what}"), None);
        }
        array
    }

    /// `N` numbers without unit.
    pub(in crate::config) fn numbers<const N: usize>(
        &self,
        key: &'static str,
        range: Range,
    ) -> Option<[f64; N]> {
        let node = self.get(key)?;
        self.array_of(node, &join(&self.path, key), "numbers", |item, path| self.number_of(item, path, range))
    }

    /// `N` quantities of one dimension.
    pub(in crate::config) fn quantities<const N: usize>(
        &self,
        key: &'static str,
        dimension: Dimension,
        range: Range,
    ) -> Option<[f64; N]> {
        let node = self.get(key)?;
        self.array_of(node, &join(&self.path, key), "quantities", |item, path| {
            self.quantity_of(item, path, dimension, range)
        })
    }

    /// `N` whole numbers from `least` to `most`.
    pub(in crate::config) fn integers<const N: usize>(
        &self,
        key: &'static str,
        least: usize,
        most: usize,
    ) -> Option<[usize; N]> {
        let node = self.get(key)?;
        self.array_of(node, &join(&self.path, key), "whole numbers", |item, path| {
            self.integer_of(item, path, least, most)
        })
    }

    /// Any number of quantities, in SI.
    pub(in crate::config) fn quantity_list(
        &self,
        key: &'static str,
        dimension: Dimension,
        range: Range,
    ) -> Option<Vec<f64>> {
        self.list(key, "quantities", |item, path| self.quantity_of(item, path, dimension, range))
    }

    /// `N` lengths [m].
    pub(in crate::config) fn lengths<const N: usize>(
        &self,
        key: &'static str,
        range: Range,
    ) -> Option<[f64; N]> {
        let node = self.get(key)?;
        self.lengths_of(node, &join(&self.path, key), range)
    }

    fn lengths_of<const N: usize>(&self, node: &Node, path: &str, range: Range) -> Option<[f64; N]> {
        self.array_of(node, path, "lengths", |item, path| {
            self.quantity_of(item, path, Dimension::Length, range)
        })
    }

    /// Any number of lengths [m].
    pub(in crate::config) fn length_list(&self, key: &'static str, range: Range) -> Option<Vec<f64>> {
        self.list(key, "lengths", |item, path| self.quantity_of(item, path, Dimension::Length, range))
    }

    /// Two lengths, the first below the second [m].
    pub(in crate::config) fn interval(&self, key: &'static str) -> Option<[f64; 2]> {
        let ends = self.lengths::<2>(key, Range::FINITE)?;
        if ends[0] < ends[1] {
            return Some(ends);
        }
        let message = format!("`{}` runs from {} m to {} m", join(&self.path, key), ends[0], ends[1]);
        self.wrong(key, message, "the lower end first, below the upper end");
        None
    }

    /// Points in space [m], at least one.
    pub(in crate::config) fn points(&self, key: &'static str) -> Option<Vec<[f64; 3]>> {
        let points =
            self.list(key, "points", |item, path| self.lengths_of::<3>(item, path, Range::FINITE))?;
        if points.is_empty() {
            let message = format!("`{}` is an empty list", join(&self.path, key));
            self.wrong(key, message, "at least one point of three lengths");
            return None;
        }
        Some(points)
    }

    /// Two opposite corners of a box, lower first [m].
    pub(in crate::config) fn corners(&self, key: &'static str) -> Option<[[f64; 3]; 2]> {
        let corners = self.two_points(key)?;
        if (0..3).all(|axis| corners[0][axis] < corners[1][axis]) {
            return Some(corners);
        }
        let message = format!("`{}` has no volume", join(&self.path, key));
        self.wrong(key, message, "the lower corner first, below the upper corner in x, y and z");
        None
    }

    /// Two opposite corners of a box that may be flat, lower first [m].
    pub(in crate::config) fn flat_corners(&self, key: &'static str) -> Option<[[f64; 3]; 2]> {
        let corners = self.two_points(key)?;
        if (0..3).all(|axis| corners[0][axis] <= corners[1][axis]) {
            return Some(corners);
        }
        let message = format!("`{}` is turned over", join(&self.path, key));
        self.wrong(key, message, "the lower corner first, nowhere above the upper corner");
        None
    }

    /// Two points [m].
    pub(in crate::config) fn two_points(&self, key: &'static str) -> Option<[[f64; 3]; 2]> {
        let node = self.get(key)?;
        self.array_of(node, &join(&self.path, key), "points", |item, path| {
            self.lengths_of(item, path, Range::FINITE)
        })
    }

    /// Three lengths, or one that holds along all three axes [m].
    pub(in crate::config) fn length_per_axis(&self, key: &'static str, range: Range) -> Option<[f64; 3]> {
        let node = self.get(key)?;
        match &node.value {
            Value::Array(_) => self.lengths_of(node, &join(&self.path, key), range),
            _ => Some([self.quantity_of(node, &join(&self.path, key), Dimension::Length, range)?; 3]),
        }
    }

    /// A list of different names.
    pub(in crate::config) fn names(&self, key: &'static str) -> Option<Vec<String>> {
        let names = self.list(key, "names", |item, path| self.text_of(item, path))?;
        if let Some([first, second]) = first_duplicate(&names) {
            let message = format!("`{}` names `{}` twice", join(&self.path, key), shown(&names[second]));
            let place = self.place_of(&format!("{key}[{first}]"));
            self.fault(&format!("{key}[{second}]"), |fault| {
                Fault { message, ..fault }.expected("each name once").other(place, "it stands here first")
            });
            return None;
        }
        Some(names)
    }

    /// One name, or a list of different names that is not empty.
    pub(in crate::config) fn name_or_names(&self, key: &'static str) -> Option<Vec<String>> {
        match &self.table.get(key)?.value {
            Value::Array(items) if items.is_empty() => {
                self.asked.borrow_mut().push(key);
                let message = format!("`{}` is an empty list", join(&self.path, key));
                self.wrong(key, message, "at least one name");
                None
            }
            Value::Array(_) => self.names(key),
            _ => self.text(key).map(|name| vec![name]),
        }
    }
}

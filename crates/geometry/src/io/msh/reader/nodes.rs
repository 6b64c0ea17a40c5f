//! The nodes of a file: any tags, in any order, found again in constant or logarithmic time.
//!
//! Nodes are kept in the order of their tags, so that a mesh is numbered alike in whatever order a file lists it. The
//! memory follows the number of nodes and never the size of a tag.

use crate::io::msh::cursor::Cursor;
use crate::io::msh::error::{MshError, MshFault, Subject};
use crate::tet4::Point;

/// A table over all tags between the smallest and the largest is taken up to so many times the number of nodes.
const TABLE_FACTOR: u64 = 4;

/// A place of the table without node.
const NONE: u32 = u32::MAX;

/// Nodes as they come from the file.
#[derive(Default)]
pub(super) struct NodeList {
    tags: Vec<u64>,
    /// Where each tag stands in the file.
    places: Vec<usize>,
    points: Vec<Point>,
}

impl NodeList {
    /// Room for a number of nodes that the file was found able to hold.
    pub(super) fn with_capacity(nodes: usize) -> Self {
        Self {
            tags: Vec::with_capacity(nodes),
            places: Vec::with_capacity(nodes),
            points: Vec::with_capacity(nodes),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.tags.len()
    }

    pub(super) fn tag(&self, index: usize) -> u64 {
        self.tags[index]
    }

    pub(super) fn push_tag(&mut self, tag: u64, place: usize) {
        self.tags.push(tag);
        self.places.push(place);
    }

    /// The coordinates of the next node that has none yet [m].
    pub(super) fn push_point(&mut self, point: Point) {
        self.points.push(point);
    }

    /// Sorts the nodes and makes them findable.
    pub(super) fn into_table(mut self, cursor: &Cursor<'_>) -> Result<NodeTable, MshError> {
        if self.tags.len() >= NONE as usize {
            return Err(cursor.fault(MshFault::TooLarge { what: "nodes", most: u64::from(NONE) - 1 }));
        }
        if !self.tags.is_sorted() {
            let mut order: Vec<u32> = (0..self.tags.len() as u32).collect();
            order.sort_by_key(|&i| self.tags[i as usize]);
            let places: Vec<usize> = order.iter().map(|&i| self.places[i as usize]).collect();
            self.places = places;
            self.points = order.iter().map(|&i| self.points[i as usize]).collect();
            self.tags.sort_unstable();
        }
        // Equal tags stand in the order of the file: the sort keeps it.
        if let Some(i) = self.tags.windows(2).position(|pair| pair[0] == pair[1]) {
            let first = cursor.place(self.places[i]);
            let fault = MshFault::DuplicateNode { first };
            return Err(cursor.fault_at(self.places[i + 1], Subject::Node(self.tags[i]), fault));
        }
        Ok(NodeTable { search: Search::over(&self.tags), tags: self.tags, points: self.points })
    }
}

/// Nodes in the order of their tags.
pub(crate) struct NodeTable {
    tags: Vec<u64>,
    points: Vec<Point>,
    search: Search,
}

/// How a tag is found.
enum Search {
    /// The tags follow each other.
    Contiguous,
    /// The position of every tag between the first and the last.
    Table(Vec<u32>),
    /// By halving.
    Halving,
}

impl Search {
    fn over(tags: &[u64]) -> Self {
        let (Some(&first), Some(&last)) = (tags.first(), tags.last()) else { return Self::Halving };
        let count = tags.len() as u64;
        match last - first {
            span if span == count - 1 => Self::Contiguous,
            span if span < TABLE_FACTOR * count => {
                let mut table = vec![NONE; span as usize + 1];
                for (i, tag) in tags.iter().enumerate() {
                    table[(tag - first) as usize] = i as u32;
                }
                Self::Table(table)
            }
            _ => Self::Halving,
        }
    }
}

impl NodeTable {
    pub(crate) fn len(&self) -> usize {
        self.tags.len()
    }

    /// Coordinates [m], in the order of the tags.
    pub(crate) fn points(&self) -> &[Point] {
        &self.points
    }

    /// The tag of a position.
    pub(crate) fn tag(&self, index: u32) -> u64 {
        self.tags[index as usize]
    }

    /// The position of a tag.
    #[inline]
    pub(super) fn find(&self, tag: u64) -> Option<u32> {
        let offset = tag.checked_sub(*self.tags.first()?)?;
        match &self.search {
            Search::Contiguous => (offset < self.tags.len() as u64).then_some(offset as u32),
            Search::Table(table) => table.get(usize::try_from(offset).ok()?).copied().filter(|&i| i != NONE),
            Search::Halving => self.tags.binary_search(&tag).ok().map(|i| i as u32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_found_however_they_are_spread() {
        let cursor = Cursor::new(b"");
        for tags in [vec![5, 6, 7, 8], vec![9, 3, 12, 5], vec![u64::MAX, 0, 17, 1 << 40], vec![4]] {
            let mut list = NodeList::default();
            for (i, &tag) in tags.iter().enumerate() {
                list.push_tag(tag, i);
                list.push_point([tag as f64, 0.0, 0.0]);
            }
            let table = list.into_table(&cursor).expect("different tags");
            let mut sorted = tags.clone();
            sorted.sort_unstable();
            for (i, &tag) in sorted.iter().enumerate() {
                assert_eq!(table.find(tag), Some(i as u32));
                assert_eq!((table.tag(i as u32), table.points()[i][0]), (tag, tag as f64));
            }
            for absent in [1, 2, 10, 1 << 50, u64::MAX - 1] {
                assert_eq!(table.find(absent).is_some(), tags.contains(&absent), "{absent}");
            }
        }
    }
}

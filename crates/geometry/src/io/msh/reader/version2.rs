//! `$Nodes` and `$Elements` of MSH 2.2, ASCII and binary.
//!
//! Source: Gmsh reference manual, "MSH file format version 2 (Legacy)". Every element carries its tags: the physical
//! group (0: none; negative: turned around), the elementary entity, and with three or more tags its partitions.

use super::contents::{ElementList, GroupNames};
use super::nodes::{NodeList, NodeTable};
use crate::io::msh::cursor::{Cursor, Encoding};
use crate::io::msh::error::{MshError, MshFault, Subject};
use crate::io::msh::scale::Scale;
use crate::io::msh::shape::{Shape, Use};

/// Reads `$Nodes`.
pub(super) fn nodes(cursor: &mut Cursor<'_>, scale: Scale) -> Result<NodeTable, MshError> {
    let least = if cursor.encoding() == Encoding::Ascii { 8 } else { 28 };
    let count = count(cursor, least, "nodes", "the number of nodes")?;
    let mut list = NodeList::with_capacity(count);
    let section = cursor.subject.clone();
    for _ in 0..count {
        let place = cursor.begin_record();
        let tag = cursor.tag("the tag of a node")?;
        cursor.subject = Subject::Node(tag);
        list.push_tag(tag, place);
        list.push_point(super::point(cursor, scale)?);
        cursor.end_record()?;
        cursor.subject = Subject::Section("Nodes".into());
    }
    cursor.subject = section;
    list.into_table(cursor)
}

/// A count on a line of its own, which is text in binary files too.
fn count(
    cursor: &mut Cursor<'_>,
    least: usize,
    what: &'static str,
    expected: &'static str,
) -> Result<usize, MshError> {
    cursor.skip_blank();
    let place = cursor.position();
    let count = cursor.text_size(expected)?;
    cursor.end_line()?;
    cursor.check_count(place, count, least, what)
}

/// Reads `$Elements`.
pub(super) fn elements<'n>(
    cursor: &mut Cursor<'_>,
    nodes: &'n NodeTable,
    names: &GroupNames,
) -> Result<ElementList<'n>, MshError> {
    let mut reader = Reader { list: ElementList::new(nodes), names, partition: None, tags: Vec::new() };
    if cursor.encoding() == Encoding::Ascii {
        // A tag, a type, no tags and one node.
        let count = count(cursor, 8, "elements", "the number of elements")?;
        for _ in 0..count {
            let place = cursor.begin_record();
            let tag = cursor.tag("the tag of an element")?;
            cursor.subject = Subject::Element(tag);
            let head = cursor.next_word();
            let code = cursor.int("the type of an element")?;
            let tags = cursor.tag("a number of tags")?;
            reader.element(cursor, (tag, place, head), code, tags)?;
            cursor.subject = Subject::Section("Elements".into());
        }
        return Ok(reader.list);
    }
    // A head is counted with its elements: a tag and one node each at least.
    let count = count(cursor, 8, "elements", "the number of elements")? as u64;
    let mut found = 0;
    while found < count {
        let head = cursor.position();
        let code = cursor.int("the type of the elements")?;
        let block = cursor.tag("the number of elements in the block")?;
        let tags = cursor.tag("a number of tags")?;
        found += block;
        if block == 0 || found > count {
            let fault = MshFault::CountMismatch { what: "elements", claimed: count, found };
            return Err(cursor.fault_at(head, cursor.subject.clone(), fault));
        }
        for _ in 0..block {
            let place = cursor.position();
            let tag = cursor.tag("the tag of an element")?;
            cursor.subject = Subject::Element(tag);
            reader.element(cursor, (tag, place, head), code, tags)?;
            cursor.subject = Subject::Section("Elements".into());
        }
    }
    Ok(reader.list)
}

struct Reader<'n, 'g> {
    list: ElementList<'n>,
    names: &'g GroupNames,
    /// The one partition that elements may name.
    partition: Option<i32>,
    /// Tags of the element being read.
    tags: Vec<i32>,
}

impl Reader<'_, '_> {
    /// Reads the tags and nodes of an element; `head` is where its type stands.
    fn element(
        &mut self,
        cursor: &mut Cursor<'_>,
        (tag, place, head): (u64, usize, usize),
        code: i32,
        tags: u64,
    ) -> Result<(), MshError> {
        let subject = cursor.subject.clone();
        let fault = |cursor: &Cursor<'_>, fault| Err(cursor.fault_at(place, subject.clone(), fault));
        let Some(shape) = Shape::of(code) else {
            return Err(cursor.fault_at(head, subject, MshFault::UnknownType { code }));
        };
        let tags = cursor.check_count(
            place,
            tags,
            if cursor.encoding() == Encoding::Ascii { 2 } else { 4 },
            "tags",
        )?;
        self.tags.clear();
        for _ in 0..tags {
            self.tags.push(cursor.int("a tag of the element")?);
        }
        if let Some(&partitions) = self.tags.get(2) {
            let partition = self.tags.get(3).copied();
            let other = self.partition.is_some() && partition.is_some() && partition != self.partition;
            if partitions > 1 || other {
                return fault(cursor, MshFault::Partitioned);
            }
            self.partition = self.partition.or(partition);
        }
        let group = self.tags.first().copied().unwrap_or(0);
        match shape.becomes() {
            Use::Tetrahedron if group == 0 => return fault(cursor, MshFault::NoGroup),
            Use::Tetrahedron => {
                self.list.tetrahedron(
                    cursor,
                    (shape, tag, place, group.saturating_abs()),
                    |cursor, what| cursor.tag(what),
                )?;
            }
            Use::Triangle if group != 0 => {
                self.list.triangle(cursor, (shape, tag), &[group], |cursor, what| cursor.tag(what))?;
            }
            Use::Nothing if group != 0 && shape.dimension == 3 => {
                let group = self.names.of(3, group.saturating_abs());
                return fault(cursor, MshFault::NotTetrahedron { shape: shape.name, group });
            }
            _ => {
                self.list.skip(shape, 1);
                if cursor.encoding() == Encoding::Ascii {
                    cursor.skip_line();
                } else {
                    cursor.skip_bytes(4 * shape.nodes, "the nodes of an element")?;
                }
                return Ok(());
            }
        }
        cursor.end_record()
    }
}

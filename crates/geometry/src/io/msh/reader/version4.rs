//! `$Entities`, `$Nodes` and `$Elements` of MSH 4.1, ASCII and binary.
//!
//! Source: Gmsh reference manual, "MSH file format". Elements come in blocks, one for each entity and type; an entity
//! says which physical groups it belongs to. A negative physical tag means the entity turned around.

use std::collections::BTreeMap;

use super::contents::{ElementList, GroupNames};
use super::nodes::{NodeList, NodeTable};
use crate::io::msh::cursor::{Cursor, Encoding};
use crate::io::msh::error::{MshError, MshFault, Subject};
use crate::io::msh::scale::Scale;
use crate::io::msh::shape::{Shape, Use};

/// Fewest bytes of a line in an ASCII file: a digit and its end, or three digits.
const LEAST_LINE: usize = 2;

/// Fewest bytes of the coordinates of a node in an ASCII file.
const LEAST_POINT: usize = 6;

/// Physical tags of the surfaces and volumes of the geometry, by dimension and tag.
#[derive(Default)]
pub(super) struct Entities {
    groups: BTreeMap<(i32, i32), Vec<i32>>,
}

impl Entities {
    pub(super) fn read(cursor: &mut Cursor<'_>, names: &GroupNames) -> Result<Self, MshError> {
        let mut entities = Self::default();
        cursor.begin_record();
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = cursor.size("the number of entities")?;
        }
        cursor.end_record()?;
        let section = cursor.subject.clone();
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                cursor.subject = section.clone();
                let start = cursor.begin_record();
                let tag = cursor.int("the tag of an entity")?;
                let subject = Subject::Entity { dimension, tag };
                cursor.subject = subject.clone();
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    cursor.real("the bounds of an entity")?;
                }
                let groups = tags(cursor, "a physical tag")?;
                if dimension > 0 {
                    tags(cursor, "the tag of a bounding entity")?;
                }
                cursor.end_record()?;
                if dimension < 2 {
                    continue;
                }
                let groups = physical_groups(groups);
                if let (3, [first, second, ..]) = (dimension, groups.as_slice()) {
                    let [first, second] = [first, second].map(|tag| names.of(3, tag.saturating_abs()));
                    return Err(cursor.fault_at(start, subject, MshFault::TwoGroups { first, second }));
                }
                if entities.groups.insert((dimension, tag), groups).is_some() {
                    return Err(cursor.fault_at(start, subject, MshFault::DeclaredTwice));
                }
            }
        }
        Ok(entities)
    }
}

/// A number of tags and the tags.
fn tags(cursor: &mut Cursor<'_>, expected: &'static str) -> Result<Vec<i32>, MshError> {
    let start = cursor.next_word();
    let count = cursor.size("a number of tags")?;
    let least = if cursor.encoding() == Encoding::Ascii { 2 } else { 4 };
    let count = cursor.check_count(start, count, least, "tags")?;
    (0..count).map(|_| cursor.int(expected)).collect()
}

/// Each group once; the tag 0 stands for none.
fn physical_groups(mut tags: Vec<i32>) -> Vec<i32> {
    tags.retain(|&tag| tag != 0);
    tags.sort_by_key(|tag| (tag.unsigned_abs(), *tag < 0));
    tags.dedup_by_key(|tag| tag.unsigned_abs());
    tags
}

/// What the head of a section announces, and how much of it has come.
struct Announced {
    what: &'static str,
    blocks: u64,
    claimed: u64,
    found: u64,
    place: usize,
    section: Subject,
}

impl Announced {
    fn read(cursor: &mut Cursor<'_>, what: &'static str) -> Result<Self, MshError> {
        cursor.begin_record();
        let blocks = cursor.size("the number of blocks")?;
        let place = cursor.next_word();
        let claimed = cursor.size("the number of nodes or elements")?;
        cursor.size("the smallest tag")?;
        cursor.size("the largest tag")?;
        cursor.end_record()?;
        Ok(Self { what, blocks, claimed, found: 0, place, section: cursor.subject.clone() })
    }

    /// A block at `place` announces so many of `least` bytes each.
    fn block(
        &mut self,
        cursor: &Cursor<'_>,
        place: usize,
        count: u64,
        least: usize,
    ) -> Result<usize, MshError> {
        let checked = cursor.check_count(place, count, least, self.what)?;
        self.found = self.found.saturating_add(count);
        if self.found > self.claimed {
            return Err(self.mismatch(cursor, place));
        }
        Ok(checked)
    }

    fn complete(&self, cursor: &Cursor<'_>) -> Result<(), MshError> {
        if self.found == self.claimed { Ok(()) } else { Err(self.mismatch(cursor, self.place)) }
    }

    fn mismatch(&self, cursor: &Cursor<'_>, place: usize) -> MshError {
        let fault = MshFault::CountMismatch { what: self.what, claimed: self.claimed, found: self.found };
        cursor.fault_at(place, self.section.clone(), fault)
    }
}

/// Reads `$Nodes`.
pub(super) fn nodes(cursor: &mut Cursor<'_>, scale: Scale) -> Result<NodeTable, MshError> {
    let ascii = cursor.encoding() == Encoding::Ascii;
    let mut announced = Announced::read(cursor, "nodes")?;
    let least = if ascii { LEAST_LINE + LEAST_POINT } else { 8 + 24 };
    let count = cursor.check_count(announced.place, announced.claimed, least, "nodes")?;
    let mut list = NodeList::with_capacity(count);
    for _ in 0..announced.blocks {
        cursor.subject = announced.section.clone();
        cursor.begin_record();
        let dimension = dimension(cursor)?;
        cursor.int("the tag of an entity")?;
        let at_parametric = cursor.next_word();
        let parametric = cursor.int("0 or 1 for parametric coordinates")?;
        if !(0..=1).contains(&parametric) {
            let fault = MshFault::Unexpected {
                expected: "0 or 1 for parametric coordinates",
                found: parametric.to_string(),
            };
            return Err(cursor.fault_at(at_parametric, cursor.subject.clone(), fault));
        }
        let at_count = cursor.next_word();
        let count = cursor.size("the number of nodes in the block")?;
        cursor.end_record()?;
        let count = announced.block(cursor, at_count, count, least)?;
        let first = list.len();
        for _ in 0..count {
            let place = cursor.begin_record();
            let tag = cursor.size("the tag of a node")?;
            cursor.subject = Subject::Node(tag);
            cursor.end_record()?;
            list.push_tag(tag, place);
            cursor.subject = Subject::Section("Nodes".into());
        }
        let parameters = if parametric == 1 { dimension } else { 0 };
        for i in 0..count {
            cursor.begin_record();
            cursor.subject = Subject::Node(list.tag(first + i));
            list.push_point(super::point(cursor, scale)?);
            for _ in 0..parameters {
                cursor.real("a parametric coordinate")?;
            }
            cursor.end_record()?;
        }
    }
    announced.complete(cursor)?;
    list.into_table(cursor)
}

/// Reads `$Elements`; without `$Entities` no element has a group.
pub(super) fn elements<'n>(
    cursor: &mut Cursor<'_>,
    nodes: &'n NodeTable,
    names: &GroupNames,
    entities: Option<&Entities>,
) -> Result<ElementList<'n>, MshError> {
    let mut announced = Announced::read(cursor, "elements")?;
    let mut list = ElementList::new(nodes);
    for _ in 0..announced.blocks {
        cursor.subject = announced.section.clone();
        let block = ElementBlock::read(cursor, entities)?;
        let ElementBlock { shape, groups, .. } = block;
        let bytes = 8 * (1 + shape.nodes);
        let least = if cursor.encoding() == Encoding::Ascii { 2 * (1 + shape.nodes) } else { bytes };
        let count = announced.block(cursor, block.at_count, block.count, least)?;
        match shape.becomes() {
            Use::Tetrahedron => list.tetrahedra.reserve_exact(count),
            Use::Triangle => list.triangles.reserve_exact(count.saturating_mul(groups.len().min(2))),
            Use::Nothing => {}
        }
        let skipped = block.is_skipped();
        if skipped {
            list.skip(shape, count);
            if cursor.encoding() != Encoding::Ascii {
                cursor.skip_bytes(count * bytes, "an element")?;
                continue;
            }
        }
        for _ in 0..count {
            let place = cursor.begin_record();
            let tag = cursor.size("the tag of an element")?;
            if skipped {
                cursor.skip_line();
                continue;
            }
            block.read_element(cursor, (tag, place), names, &mut list)?;
            cursor.end_record()?;
            cursor.subject = Subject::Section("Elements".into());
        }
    }
    announced.complete(cursor)?;
    let volumes = entities.into_iter().flat_map(|entities| entities.groups.range((3, i32::MIN)..));
    let left_out = volumes.filter(|(_, groups)| groups.is_empty()).map(|((_, tag), _)| *tag);
    list.notices.ungrouped_volumes = left_out.take(MOST_LISTED).collect();
    Ok(list)
}

/// A block of elements of one entity and type, as its head announces it.
struct ElementBlock<'e> {
    shape: Shape,
    dimension: i32,
    /// Of the entity; none of points and curves.
    groups: &'e [i32],
    /// How many elements there are, and where that is said.
    count: u64,
    at_count: usize,
}

impl<'e> ElementBlock<'e> {
    fn read(cursor: &mut Cursor<'_>, entities: Option<&'e Entities>) -> Result<Self, MshError> {
        let place = cursor.begin_record();
        let dimension = dimension(cursor)?;
        let at_tag = cursor.next_word();
        let tag = cursor.int("the tag of an entity")?;
        let at_code = cursor.next_word();
        let code = cursor.int("the type of the elements")?;
        let at_count = cursor.next_word();
        let count = cursor.size("the number of elements in the block")?;
        cursor.end_record()?;
        let of_entity = |at, fault| cursor.fault_at(at, Subject::Entity { dimension, tag }, fault);
        let shape = Shape::of(code).ok_or_else(|| of_entity(at_code, MshFault::UnknownType { code }))?;
        if shape.dimension != dimension {
            return Err(of_entity(place, MshFault::WrongDimension { shape: shape.name, dimension }));
        }
        let groups = match entities {
            Some(entities) if dimension >= 2 => entities
                .groups
                .get(&(dimension, tag))
                .ok_or_else(|| of_entity(at_tag, MshFault::UnknownEntity))?
                .as_slice(),
            _ => &[],
        };
        Ok(Self { shape, dimension, groups, count, at_count })
    }

    /// Whether its elements are passed over: no part of a tetrahedral mesh, or of no group.
    fn is_skipped(&self) -> bool {
        let becomes = self.shape.becomes();
        becomes != Use::Tetrahedron && self.groups.is_empty() || becomes == Use::Nothing && self.dimension < 3
    }

    /// Reads the nodes of the element `tag`, whose record begins at `place`.
    fn read_element(
        &self,
        cursor: &mut Cursor<'_>,
        (tag, place): (u64, usize),
        names: &GroupNames,
        list: &mut ElementList<'_>,
    ) -> Result<(), MshError> {
        let shape = self.shape;
        let subject = Subject::Element(tag);
        match (shape.becomes(), self.groups) {
            (Use::Tetrahedron, []) => Err(cursor.fault_at(place, subject, MshFault::NoGroup)),
            (Use::Tetrahedron, [group, ..]) => {
                cursor.subject = subject;
                let group = group.saturating_abs();
                list.tetrahedron(cursor, (shape, tag, place, group), |cursor, what| cursor.size(what))
            }
            (Use::Triangle, groups) => {
                cursor.subject = subject;
                list.triangle(cursor, (shape, tag), groups, |cursor, what| cursor.size(what))
            }
            (Use::Nothing, groups) => {
                let group = names.of(3, groups.first().map_or(0, |tag| tag.saturating_abs()));
                let fault = MshFault::NotTetrahedron { shape: shape.name, group };
                Err(cursor.fault_at(place, subject, fault))
            }
        }
    }
}

/// Most volumes that a notice lists.
const MOST_LISTED: usize = 20;

fn dimension(cursor: &mut Cursor<'_>) -> Result<i32, MshError> {
    let start = cursor.position();
    let dimension = cursor.int("the dimension of an entity (0 to 3)")?;
    if (0..=3).contains(&dimension) {
        return Ok(dimension);
    }
    let expected = "the dimension of an entity (0 to 3)";
    let fault = MshFault::Unexpected { expected, found: dimension.to_string() };
    Err(cursor.fault_at(start, cursor.subject.clone(), fault))
}

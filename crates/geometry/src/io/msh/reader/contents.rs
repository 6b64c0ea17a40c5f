//! What the versions of the format have in common once read: names, nodes, tetrahedra and triangles with their groups.

use std::collections::BTreeMap;

use super::nodes::NodeTable;
use crate::io::msh::cursor::Cursor;
use crate::io::msh::error::{MshError, MshFault, Subject};
use crate::io::msh::notices::MshNotices;
use crate::io::msh::shape::Shape;

/// Element numbers leave two bits for the local face.
const MOST_TETRAHEDRA: usize = 1 << 30;

/// Longest name of a group [bytes]: that of a file on most systems.
const LONGEST_NAME: usize = 255;

/// Bytes of a file for each triangle of a physical surface: one that lies in many surfaces is kept many times.
const BYTES_PER_TRIANGLE: usize = 8;

/// Triangles of physical surfaces that any file may have.
const ALWAYS_TRIANGLES: usize = 1000;

const GROUP_TAG: &str = "the tag of a physical group, from 1";

/// A tetrahedron of a physical volume.
#[derive(Clone, Copy)]
pub(crate) struct Tetrahedron {
    pub(crate) tag: u64,
    /// Where it stands in the file.
    pub(crate) place: usize,
    /// Positions in the node table.
    pub(crate) nodes: [u32; 4],
    /// Tag of its physical volume.
    pub(crate) group: i32,
}

/// A triangle of a physical surface.
#[derive(Clone, Copy)]
pub(crate) struct Triangle {
    pub(crate) tag: u64,
    /// Positions in the node table.
    pub(crate) nodes: [u32; 3],
    /// Tag of its physical surface.
    pub(crate) group: i32,
}

/// All of a file that counts.
pub(crate) struct Contents<'a> {
    /// To say where something stands.
    pub(crate) cursor: Cursor<'a>,
    pub(crate) names: GroupNames,
    pub(crate) nodes: NodeTable,
    pub(crate) tetrahedra: Vec<Tetrahedron>,
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) notices: MshNotices,
}

/// Names of the physical groups, by dimension and tag.
#[derive(Default)]
pub(crate) struct GroupNames {
    names: BTreeMap<(i32, i32), String>,
    /// The tag of each name, by dimension.
    owners: BTreeMap<(i32, String), i32>,
}

impl GroupNames {
    /// Reads `$PhysicalNames`, which is text in binary files too.
    pub(super) fn read(cursor: &mut Cursor<'_>) -> Result<Self, MshError> {
        let mut groups = Self::default();
        cursor.skip_blank();
        let count = cursor.text_size("the number of physical names")?;
        cursor.end_line()?;
        for _ in 0..count {
            cursor.skip_blank();
            let start = cursor.position();
            let dimension = cursor.text_int("the dimension of a physical group (0 to 3)")?;
            if !(0..=3).contains(&dimension) {
                let fault = MshFault::Unexpected {
                    expected: "the dimension of a physical group (0 to 3)",
                    found: dimension.to_string(),
                };
                return Err(cursor.fault_at(start, cursor.subject.clone(), fault));
            }
            let at_tag = cursor.next_word_of_text();
            let tag = cursor.text_int(GROUP_TAG)?;
            if tag <= 0 {
                let fault = MshFault::Unexpected { expected: GROUP_TAG, found: tag.to_string() };
                return Err(cursor.fault_at(at_tag, cursor.subject.clone(), fault));
            }
            let subject = Subject::Group { dimension, tag };
            let at_name = cursor.next_word_of_text();
            let name =
                name(cursor.line()).map_err(|fault| cursor.fault_at(at_name, subject.clone(), fault))?;
            if groups.names.insert((dimension, tag), name.clone()).is_some() {
                return Err(cursor.fault_at(at_tag, subject, MshFault::DeclaredTwice));
            }
            if let Some(first) = groups.owners.insert((dimension, name.clone()), tag) {
                return Err(cursor.fault_at(at_name, subject, MshFault::NameTwice { name, first }));
            }
        }
        Ok(groups)
    }

    /// Tags of the named groups of a dimension, ascending.
    pub(crate) fn tags(&self, dimension: i32) -> impl Iterator<Item = i32> {
        self.names.range((dimension, i32::MIN)..=(dimension, i32::MAX)).map(|(&(_, tag), _)| tag)
    }

    /// Whether a group has a name of its own.
    pub(crate) fn is_named(&self, dimension: i32, tag: i32) -> bool {
        self.names.contains_key(&(dimension, tag))
    }

    /// The name of a group: as given, or made from its tag.
    pub(crate) fn of(&self, dimension: i32, tag: i32) -> String {
        let kind = if dimension == 3 { "volume" } else { "surface" };
        self.names.get(&(dimension, tag)).cloned().unwrap_or_else(|| format!("{kind}_{tag}"))
    }
}

/// The name in the rest of a line.
fn name(rest: &[u8]) -> Result<String, MshFault> {
    let unquoted = || MshFault::Unexpected {
        expected: "a name in double quotes",
        found: crate::io::msh::cursor::shown(rest.trim_ascii()),
    };
    let inner = rest
        .trim_ascii()
        .strip_prefix(b"\"")
        .and_then(|rest| rest.strip_suffix(b"\""))
        .ok_or_else(unquoted)?;
    let refused = |problem| MshFault::Name { name: crate::io::msh::cursor::shown(inner), problem };
    let text = std::str::from_utf8(inner).map_err(|_| refused("is not UTF-8"))?;
    match name_problem(text) {
        Some(problem) => Err(refused(problem)),
        None => Ok(text.to_owned()),
    }
}

/// Why a text cannot be the name of a group.
pub(crate) fn name_problem(name: &str) -> Option<&'static str> {
    if name.trim().is_empty() {
        Some("is empty")
    } else if name.contains('"') {
        Some("holds a double quote")
    } else if name.len() > LONGEST_NAME {
        Some("is longer than 255 bytes")
    } else if name.chars().any(char::is_control) {
        Some("holds a control character")
    } else {
        None
    }
}

/// Elements as they come from the file.
pub(super) struct ElementList<'n> {
    nodes: &'n NodeTable,
    pub(super) tetrahedra: Vec<Tetrahedron>,
    pub(super) triangles: Vec<Triangle>,
    pub(super) notices: MshNotices,
}

impl<'n> ElementList<'n> {
    pub(super) fn new(nodes: &'n NodeTable) -> Self {
        Self { nodes, tetrahedra: Vec::new(), triangles: Vec::new(), notices: MshNotices::default() }
    }

    /// The positions of an element's vertices, from tags that `next` reads; midside nodes are read and dropped.
    fn vertices<const N: usize>(
        &mut self,
        cursor: &mut Cursor<'_>,
        shape: Shape,
        next: impl Fn(&mut Cursor<'_>, &'static str) -> Result<u64, MshError>,
    ) -> Result<[u32; N], MshError> {
        let mut vertices = [0; N];
        for k in 0..shape.nodes {
            let start = cursor.next_word();
            let tag = next(cursor, "the tag of a node")?;
            match (self.nodes.find(tag), vertices.get_mut(k)) {
                (Some(position), Some(vertex)) => *vertex = position,
                (Some(_), None) => {}
                (None, _) => {
                    let fault = MshFault::DanglingNode { node: tag };
                    return Err(cursor.fault_at(start, cursor.subject.clone(), fault));
                }
            }
        }
        self.notices.second_order += usize::from(shape.is_second_order());
        Ok(vertices)
    }

    /// Reads the nodes of a tetrahedron.
    pub(super) fn tetrahedron(
        &mut self,
        cursor: &mut Cursor<'_>,
        (shape, tag, place, group): (Shape, u64, usize, i32),
        next: impl Fn(&mut Cursor<'_>, &'static str) -> Result<u64, MshError>,
    ) -> Result<(), MshError> {
        let nodes = self.vertices(cursor, shape, next)?;
        if self.tetrahedra.len() == MOST_TETRAHEDRA {
            return Err(cursor.fault(MshFault::TooLarge { what: "tetrahedra", most: MOST_TETRAHEDRA as u64 }));
        }
        self.tetrahedra.push(Tetrahedron { tag, place, nodes, group });
        Ok(())
    }

    /// Reads the nodes of a triangle, which goes into every group given; a negative tag turns it around.
    pub(super) fn triangle(
        &mut self,
        cursor: &mut Cursor<'_>,
        (shape, tag): (Shape, u64),
        groups: &[i32],
        next: impl Fn(&mut Cursor<'_>, &'static str) -> Result<u64, MshError>,
    ) -> Result<(), MshError> {
        let [a, b, c] = self.vertices(cursor, shape, next)?;
        let most = ALWAYS_TRIANGLES.max(cursor.length() / BYTES_PER_TRIANGLE);
        if self.triangles.len() + groups.len() > most {
            let what = "triangles in physical surfaces, each counted in all of its surfaces";
            return Err(cursor.fault(MshFault::TooLarge { what, most: most as u64 }));
        }
        for &group in groups {
            let nodes = if group < 0 { [a, c, b] } else { [a, b, c] };
            self.triangles.push(Triangle { tag, nodes, group: group.saturating_abs() });
        }
        Ok(())
    }

    /// Counts elements that are skipped.
    pub(super) fn skip(&mut self, shape: Shape, count: usize) {
        if count == 0 {
            return;
        }
        match shape.becomes() {
            crate::io::msh::shape::Use::Triangle => self.notices.ungrouped_triangles += count,
            _ => *self.notices.skipped.entry(shape.name).or_default() += count,
        }
    }
}

//! From bytes to the contents of a Gmsh file: the header, the sections and their order.

mod contents;
mod nodes;
mod version2;
mod version4;

use super::cursor::{Cursor, Encoding, shown};
use super::error::{MshError, MshFault, Subject};
use super::scale::Scale;
use crate::tet4::Point;

pub(super) use contents::{Contents, Tetrahedron, name_problem};
use contents::{ElementList, GroupNames};
use nodes::NodeTable;
use version4::Entities;

/// The versions that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    V2,
    V4,
}

/// What has been read so far.
#[derive(Default)]
struct Sections {
    names: Option<GroupNames>,
    entities: Option<Entities>,
    nodes: Option<NodeTable>,
    elements: Option<Elements>,
}

/// Elements, free of the nodes that they were found among.
struct Elements {
    tetrahedra: Vec<contents::Tetrahedron>,
    triangles: Vec<contents::Triangle>,
    notices: super::MshNotices,
}

impl From<ElementList<'_>> for Elements {
    fn from(list: ElementList<'_>) -> Self {
        Self { tetrahedra: list.tetrahedra, triangles: list.triangles, notices: list.notices }
    }
}

/// Reads all sections.
pub(super) fn read(bytes: &[u8], scale: Scale) -> Result<Contents<'_>, MshError> {
    let mut cursor = Cursor::new(bytes);
    let version = header(&mut cursor)?;
    let mut sections = Sections::default();
    loop {
        cursor.skip_blank();
        if cursor.remaining() == 0 {
            break;
        }
        let start = cursor.position();
        cursor.subject = Subject::File;
        let word = cursor.word("the head of a section")?;
        let Some(name) = word.strip_prefix(b"$").and_then(|name| std::str::from_utf8(name).ok()) else {
            let fault = MshFault::Unexpected { expected: "the head of a section", found: shown(word) };
            return Err(cursor.fault_at(start, Subject::File, fault));
        };
        cursor.subject = Subject::Section(shown(name.as_bytes()).into());
        cursor.end_line()?;
        let known = sections
            .read(name, version, &mut cursor, scale)
            // What the section's head itself does wrong is shown at the head.
            .map_err(|refused| refused.at(&cursor, start))?;
        end_of_section(&mut cursor, name, known)?;
    }
    let missing = |section| cursor.fault_at(bytes.len(), Subject::File, MshFault::MissingSection { section });
    let nodes = sections.nodes.ok_or_else(|| missing("Nodes"))?;
    let elements = sections.elements.ok_or_else(|| missing("Elements"))?;
    let names = sections.names.unwrap_or_default();
    let Elements { tetrahedra, triangles, notices } = elements;
    Ok(Contents { cursor, names, nodes, tetrahedra, triangles, notices })
}

/// A section that is refused as a whole, or a fault inside it.
enum Refused {
    Section(MshFault),
    Inside(MshError),
}

impl From<MshError> for Refused {
    fn from(error: MshError) -> Self {
        Self::Inside(error)
    }
}

impl Refused {
    fn at(self, cursor: &Cursor<'_>, start: usize) -> MshError {
        match self {
            Self::Section(fault) => cursor.fault_at(start, cursor.subject.clone(), fault),
            Self::Inside(error) => error,
        }
    }
}

/// Whether a section was read or is to be skipped.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Body {
    Read,
    Skipped,
}

impl Sections {
    fn read(
        &mut self,
        name: &str,
        version: Version,
        cursor: &mut Cursor<'_>,
        scale: Scale,
    ) -> Result<Body, Refused> {
        let order = |order| Err(Refused::Section(MshFault::Order { order }));
        let twice = match name {
            "MeshFormat" => true,
            "PhysicalNames" => self.names.is_some(),
            "Entities" => self.entities.is_some(),
            "Nodes" => self.nodes.is_some(),
            "Elements" => self.elements.is_some(),
            _ => false,
        };
        if twice {
            return Err(Refused::Section(MshFault::SectionTwice));
        }
        let unnamed = GroupNames::default();
        match (name, version) {
            ("PartitionedEntities" | "GhostElements", _) => {
                return Err(Refused::Section(MshFault::Partitioned));
            }
            ("ParametricNodes", Version::V2) => return Err(Refused::Section(MshFault::Parametric)),
            ("PhysicalNames" | "Entities", _) if self.nodes.is_some() => return order("before $Nodes"),
            ("PhysicalNames", _) if self.entities.is_some() => return order("before $Entities"),
            ("Elements", _) if self.nodes.is_none() => return order("after $Nodes"),
            ("PhysicalNames", _) => self.names = Some(GroupNames::read(cursor)?),
            ("Entities", Version::V4) => {
                let names = self.names.as_ref().unwrap_or(&unnamed);
                self.entities = Some(Entities::read(cursor, names)?);
            }
            ("Nodes", Version::V4) => self.nodes = Some(version4::nodes(cursor, scale)?),
            ("Nodes", Version::V2) => self.nodes = Some(version2::nodes(cursor, scale)?),
            ("Elements", _) => {
                let names = self.names.as_ref().unwrap_or(&unnamed);
                let nodes = self.nodes.as_ref().expect("the order was checked");
                self.elements = Some(match version {
                    Version::V4 => version4::elements(cursor, nodes, names, self.entities.as_ref())?.into(),
                    Version::V2 => version2::elements(cursor, nodes, names)?.into(),
                });
            }
            _ => return Ok(Body::Skipped),
        }
        Ok(Body::Read)
    }
}

/// Goes behind the line `$EndNAME`.
fn end_of_section(cursor: &mut Cursor<'_>, name: &str, body: Body) -> Result<(), MshError> {
    let mark = format!("$End{name}");
    cursor.subject = Subject::Section(shown(name.as_bytes()).into());
    if body == Body::Skipped {
        let start = cursor.position();
        if !cursor.skip_behind(mark.as_bytes()) {
            let fault = MshFault::Truncated { expected: "the end of the section" };
            return Err(cursor.fault_at(start, cursor.subject.clone(), fault));
        }
        return cursor.end_line();
    }
    cursor.skip_blank();
    let start = cursor.position();
    let word = cursor.word("the end of the section")?;
    if word != mark.as_bytes() {
        let fault = MshFault::Unexpected { expected: "the end of the section", found: shown(word) };
        return Err(cursor.fault_at(start, cursor.subject.clone(), fault));
    }
    cursor.end_line()
}

/// Reads `$MeshFormat`: the version, and how numbers are written.
fn header(cursor: &mut Cursor<'_>) -> Result<Version, MshError> {
    let start = cursor.begin_record();
    let word = cursor.word("$MeshFormat")?;
    if word == b"$NOD" {
        return Err(cursor.fault_at(start, Subject::File, MshFault::Version { found: "1".to_owned() }));
    }
    if word != b"$MeshFormat" {
        let fault = MshFault::Unexpected { expected: "$MeshFormat", found: shown(word) };
        return Err(cursor.fault_at(start, Subject::File, fault));
    }
    cursor.subject = Subject::Section("MeshFormat".into());
    cursor.end_line()?;
    let mut at = cursor.begin_record();
    let fault = |cursor: &Cursor<'_>, at, fault| cursor.fault_at(at, cursor.subject.clone(), fault);
    let version = match cursor.word("the version of the format")? {
        b"2.2" => Version::V2,
        b"4.1" => Version::V4,
        other => return Err(fault(cursor, at, MshFault::Version { found: shown(other) })),
    };
    at = cursor.next_word();
    let binary = match cursor.word("0 for ASCII or 1 for binary")? {
        b"0" => false,
        b"1" => true,
        other => {
            let expected = "0 for ASCII or 1 for binary";
            return Err(fault(cursor, at, MshFault::Unexpected { expected, found: shown(other) }));
        }
    };
    at = cursor.next_word();
    let size = cursor.word("the data size")?;
    if size != b"8" {
        return Err(fault(cursor, at, MshFault::DataSize { found: shown(size) }));
    }
    cursor.end_line()?;
    if binary {
        let start = cursor.position();
        cursor.set_encoding(Encoding::LittleEndian);
        let encoding = match cursor.int("the number 1, which tells the order of bytes")? {
            1 => Encoding::LittleEndian,
            swapped if swapped.swap_bytes() == 1 => Encoding::BigEndian,
            other => {
                let expected = "the number 1, which tells the order of bytes";
                let fault = MshFault::Unexpected { expected, found: other.to_string() };
                return Err(cursor.fault_at(start, cursor.subject.clone(), fault));
            }
        };
        cursor.set_encoding(encoding);
    }
    end_of_section(cursor, "MeshFormat", Body::Read)?;
    Ok(version)
}

/// The three coordinates of a node, in metres.
fn point(cursor: &mut Cursor<'_>, scale: Scale) -> Result<Point, MshError> {
    let mut point = [0.0; 3];
    for (x, expected) in point.iter_mut().zip(["the x coordinate", "the y coordinate", "the z coordinate"]) {
        let start = cursor.next_word();
        let value = cursor.real(expected)?;
        *x = scale.metres(value);
        if !x.is_finite() {
            return Err(cursor.fault_at(start, cursor.subject.clone(), MshFault::NotFinite { value }));
        }
    }
    Ok(point)
}

//! What can be wrong with a Gmsh file: where, at which node or element, and what to do.

use std::borrow::Cow;
use std::fmt;

use crate::millimetres::millimetres;

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// A line of an ASCII file, from 1.
    Line(usize),
    /// A byte of a binary file, from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// What the file was saying at that place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The order of sections, or the file as a whole.
    File,
    /// The head of a section: its name without the dollar.
    Section(Cow<'static, str>),
    /// A physical group.
    Group {
        /// Its dimension.
        dimension: i32,
        /// Its tag.
        tag: i32,
    },
    /// An elementary entity of the geometry.
    Entity {
        /// Its dimension.
        dimension: i32,
        /// Its tag.
        tag: i32,
    },
    /// A node, by its tag in the file.
    Node(u64),
    /// An element, by its tag in the file.
    Element(u64),
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => f.write_str("file"),
            Self::Section(name) => write!(f, "section ${name}"),
            Self::Group { dimension, tag } => write!(f, "physical group {tag} of dimension {dimension}"),
            Self::Entity { dimension, tag } => write!(f, "entity {tag} of dimension {dimension}"),
            Self::Node(tag) => write!(f, "node {tag}"),
            Self::Element(tag) => write!(f, "element {tag}"),
        }
    }
}

/// A fault of a Gmsh file with its place.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}, {subject}: {fault}")]
pub struct MshError {
    /// Line or byte.
    pub place: Place,
    /// The node, element, entity or section.
    pub subject: Subject,
    /// What is wrong.
    pub fault: MshFault,
    /// The line of an ASCII file; `None` in the numbers of a binary one.
    pub excerpt: Option<Box<Excerpt>>,
}

/// A line of an ASCII file and the place in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excerpt {
    /// The line, or the part of a long one around the place.
    pub text: String,
    /// Bytes of `text`: the word at the place, empty at the end of the line.
    pub span: std::ops::Range<usize>,
}

impl Excerpt {
    /// Most bytes of a line on either side of a place.
    const MOST: usize = 2000;

    /// The line of a byte; bytes that are no text are replaced.
    pub(super) fn of(bytes: &[u8], position: usize) -> Self {
        let position = position.min(bytes.len());
        let is_end = |b: &u8| matches!(b, b'\n' | b'\r');
        let start = bytes[..position].iter().rposition(|b| *b == b'\n').map_or(0, |end| end + 1);
        let end = bytes[position..].iter().position(is_end).map_or(bytes.len(), |length| position + length);
        let start = start.max(position.saturating_sub(Self::MOST));
        let end = end.min(position.saturating_add(Self::MOST));
        let length = bytes[position..end].iter().position(u8::is_ascii_whitespace).unwrap_or(end - position);
        // Tabs would take the underlining out of step.
        let shown = |part: &[u8]| {
            let text = String::from_utf8_lossy(part);
            text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>()
        };
        let (before, word) = (shown(&bytes[start..position]), shown(&bytes[position..position + length]));
        let span = before.len()..before.len() + word.len();
        Self { text: before + &word + &shown(&bytes[position + length..end]), span }
    }
}

/// What is wrong in a Gmsh file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum MshFault {
    /// Something else was to stand there.
    #[error("expected {expected}, found `{found}`")]
    Unexpected {
        expected: &'static str,
        /// What stands there, shortened.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends where {expected} is expected: it is cut off; write or copy it again")]
    Truncated { expected: &'static str },
    /// A header promises more than the rest of the file can hold.
    #[error(
        "{claimed} {what} are announced, but the {bytes} bytes that remain hold at most {most}: the file is cut off or its header is wrong"
    )]
    TooMany { what: &'static str, claimed: u64, bytes: usize, most: u64 },
    /// The blocks of a section do not add up to its header.
    #[error("{claimed} {what} are announced in the section's header, and its blocks announce {found}")]
    CountMismatch { what: &'static str, claimed: u64, found: u64 },
    /// A version that is not read.
    #[error("the version {found} of the format is not read: save the mesh as version 4.1 or 2.2")]
    Version { found: String },
    /// The size of numbers is not that of 64 bits.
    #[error("the data size is {found} bytes, and only 8 is read: save the mesh on a 64-bit system")]
    DataSize { found: String },
    /// A section comes too early or too late.
    #[error("the section must come {order}")]
    Order { order: &'static str },
    /// A section comes twice.
    #[error("the section comes a second time")]
    SectionTwice,
    /// A section is missing.
    #[error("there is no section ${section}: save the mesh with its nodes and elements")]
    MissingSection { section: &'static str },
    /// The mesh is cut into partitions.
    #[error("the mesh is partitioned, which is not read: save it without partitions")]
    Partitioned,
    /// Nodes with coordinates on curves and surfaces, which version 2.2 has in a section of their own.
    #[error(
        "nodes have parametric coordinates: save the mesh with Mesh.SaveParametric = 0, or in format 4.1"
    )]
    Parametric,
    /// A name that cannot be a name.
    #[error("the name `{name}` {problem}: give the group another name")]
    Name {
        /// The name, with control characters escaped.
        name: String,
        problem: &'static str,
    },
    /// Two groups of one dimension have one name, or one group has two.
    #[error(
        "the name `{name}` belongs to group {first} of the same dimension: give every group its own name"
    )]
    NameTwice { name: String, first: i32 },
    /// A group or an entity is declared twice.
    #[error("it is declared a second time")]
    DeclaredTwice,
    /// An element block names an entity that is not declared.
    #[error("the entity is not declared in $Entities")]
    UnknownEntity,
    /// Two nodes have one tag.
    #[error("the tag was given at {first} already: every node needs its own tag")]
    DuplicateNode { first: Place },
    /// An element names a node that is not there.
    #[error("it uses node {node}, which is not in $Nodes")]
    DanglingNode { node: u64 },
    /// A coordinate is not finite.
    #[error("a coordinate is {value}: every coordinate must be finite")]
    NotFinite { value: f64 },
    /// A tetrahedron has no volume.
    #[error(
        "the tetrahedron at {} is flat: its volume of {:.3e} mm³ is nothing but rounding; repair the mesh",
        millimetres(*centroid),
        volume * 1e9
    )]
    Flat {
        /// Its signed volume [m³].
        volume: f64,
        /// Its centroid [m].
        centroid: [f64; 3],
    },
    /// A tetrahedron belongs to no physical volume.
    #[error(
        "the tetrahedron belongs to no physical volume: put every volume into a physical group, which becomes a region"
    )]
    NoGroup,
    /// A volume belongs to two physical volumes.
    #[error(
        "it belongs to the physical volumes `{first}` and `{second}`: every volume belongs to exactly one region"
    )]
    TwoGroups { first: String, second: String },
    /// A tetrahedron comes twice.
    #[error("the tetrahedron has the nodes of element {first}: take one of them out")]
    DuplicateElement { first: u64 },
    /// Three or more tetrahedra share a face.
    #[error("two other tetrahedra have a face with nodes {face:?} too: the mesh overlaps itself")]
    Overlap { face: [u64; 3] },
    /// Two tetrahedra lie on the same side of a common face.
    #[error(
        "it lies on the same side of a common face as element {other}, in `{}` and `{}`, at {}: the mesh is folded, \
         as where a node was moved through a face, extruded layers cross, or a volume was meshed twice; mesh the geometry again",
        regions[0], regions[1], millimetres(*centroid)
    )]
    Folded {
        other: u64,
        regions: Box<[String; 2]>,
        /// Centroid of the tetrahedron [m].
        centroid: [f64; 3],
    },
    /// A physical volume holds other shapes than tetrahedra.
    #[error(
        "a {shape} stands in the physical volume `{group}`: only tetrahedra of first and second order are read; mesh the volume with them"
    )]
    NotTetrahedron { shape: &'static str, group: String },
    /// A type of element that the format does not know.
    #[error("the element type {code} is not known")]
    UnknownType { code: i32 },
    /// The type of the elements does not fit the dimension of their entity.
    #[error("a {shape} cannot lie in an entity of dimension {dimension}")]
    WrongDimension { shape: &'static str, dimension: i32 },
    /// There is nothing to compute on.
    #[error("the file holds no tetrahedron: mesh in 3D, and save the physical volumes")]
    Empty,
    /// More than can be numbered.
    #[error("there are more than {most} {what}: too many for one mesh")]
    TooLarge { what: &'static str, most: u64 },
    /// What the mesh itself refuses.
    #[error("{cause}")]
    Mesh { cause: String },
}

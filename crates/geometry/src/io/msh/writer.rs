//! Writes a mesh as MSH 4.1 with its regions and surfaces as physical groups.
//!
//! A region becomes one volume entity. Surfaces may share triangles, and an element lies in one entity only: so there is
//! one surface entity for every set of surfaces that triangles have in common, with all their physical tags; a tag is
//! negative where the surface sees the triangle from the other side. Nodes lie in the first surface that they touch,
//! else in their volume. Tags are positions plus one, so that the reader finds nodes, elements and triangles in their
//! old order.
//! Cells of observation regions are no part of the format.

use std::collections::BTreeMap;
use std::io::Write as _;

use super::reader::name_problem;
use super::scale::Scale;
use super::shells::{Shell, shells};
use crate::error::MeshError;
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::tet4::Point;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MshEncoding {
    /// As text, with the fewest digits that read back to the same number.
    Ascii,
    /// As bytes, lowest first.
    Binary,
}

/// The bytes of a file whose coordinates are in units of `metres_per_unit` [m].
///
/// A mesh that was read in some unit and is written in it has the same numbers. A region or surface without elements is
/// written as a name alone.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] when a coordinate in that unit is not finite, [`MeshError::Name`] when a name cannot
/// stand in a file.
///
/// # Panics
/// If `metres_per_unit` is not positive and finite.
pub fn msh_bytes(mesh: &Mesh, metres_per_unit: f64, encoding: MshEncoding) -> Result<Vec<u8>, MeshError> {
    let topology = mesh.topology();
    let scale = Scale::new(metres_per_unit);
    let points: Vec<Point> = mesh.points().iter().map(|p| p.map(|x| scale.units(x))).collect();
    if let Some(position) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        let value = points[position].into_iter().find(|x| !x.is_finite()).unwrap_or(f64::NAN);
        return Err(MeshError::NotFiniteArray { array: "coordinates".into(), value, position });
    }
    let surfaces: Vec<&str> = topology.surface_names().collect();
    let names = topology.region_names().iter().map(String::as_str).chain(surfaces.iter().copied());
    for name in names {
        if let Some(problem) = name_problem(name) {
            return Err(MeshError::Name { name: name.to_owned(), problem });
        }
    }
    let shells = shells(mesh, &surfaces)?;
    let mut out = Output { bytes: Vec::new(), encoding };
    out.header();
    out.names(topology.region_names(), &surfaces);
    let volumes = volumes(mesh);
    let groups = node_groups(mesh, &shells);
    out.entities(mesh, &points, &shells, &volumes);
    out.nodes(&points, &groups);
    out.elements(mesh, &shells, &volumes);
    Ok(out.bytes)
}

/// Elements of every region that has some: its number and their positions.
fn volumes(mesh: &Mesh) -> Vec<(usize, Vec<usize>)> {
    let topology = mesh.topology();
    let mut elements = vec![Vec::new(); topology.region_names().len()];
    for (e, region) in topology.region_of().iter().enumerate() {
        elements[region.index()].push(e);
    }
    elements.into_iter().enumerate().filter(|(_, elements)| !elements.is_empty()).collect()
}

/// Nodes by the dimension and tag of the entity that they lie in.
fn node_groups(mesh: &Mesh, shells: &[Shell]) -> BTreeMap<(i32, i32), Vec<usize>> {
    let mut entity: Vec<Option<(i32, i32)>> = vec![None; mesh.points().len()];
    for (tag, shell) in (1..).zip(shells) {
        for node in shell.triangles.iter().flat_map(|(_, nodes)| nodes) {
            entity[node.index()].get_or_insert((2, tag));
        }
    }
    let topology = mesh.topology();
    for (tet, region) in topology.tets().iter().zip(topology.region_of()) {
        for node in tet {
            entity[node.index()].get_or_insert((3, region.index() as i32 + 1));
        }
    }
    let mut groups: BTreeMap<(i32, i32), Vec<usize>> = BTreeMap::new();
    for (node, entity) in entity.into_iter().enumerate() {
        // A node of no element lies in the first volume.
        groups.entry(entity.unwrap_or((3, 1))).or_default().push(node);
    }
    groups
}

/// Smallest and largest coordinates of some nodes.
fn bounds(points: &[Point], nodes: impl Iterator<Item = NodeId>) -> [f64; 6] {
    let mut bounds = [
        f64::INFINITY,
        f64::INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NEG_INFINITY,
        f64::NEG_INFINITY,
    ];
    for node in nodes {
        for (d, &x) in points[node.index()].iter().enumerate() {
            bounds[d] = bounds[d].min(x);
            bounds[d + 3] = bounds[d + 3].max(x);
        }
    }
    bounds
}

/// The file being made.
struct Output {
    bytes: Vec<u8>,
    encoding: MshEncoding,
}

impl Output {
    fn text(&mut self, text: std::fmt::Arguments<'_>) {
        self.bytes.write_fmt(text).expect("writing into memory cannot fail");
    }

    fn int(&mut self, value: i32) {
        match self.encoding {
            MshEncoding::Ascii => self.text(format_args!("{value} ")),
            MshEncoding::Binary => self.bytes.extend(value.to_le_bytes()),
        }
    }

    fn size(&mut self, value: u64) {
        match self.encoding {
            MshEncoding::Ascii => self.text(format_args!("{value} ")),
            MshEncoding::Binary => self.bytes.extend(value.to_le_bytes()),
        }
    }

    fn real(&mut self, value: f64) {
        match self.encoding {
            MshEncoding::Ascii => self.text(format_args!("{value:?} ")),
            MshEncoding::Binary => self.bytes.extend(value.to_le_bytes()),
        }
    }

    /// Ends a line of text, and nothing in a binary file.
    fn end(&mut self) {
        if self.encoding == MshEncoding::Ascii {
            self.bytes.pop_if(|last| *last == b' ');
            self.bytes.push(b'\n');
        }
    }

    fn end_section(&mut self, name: &str) {
        if self.encoding == MshEncoding::Binary {
            self.bytes.push(b'\n');
        }
        self.text(format_args!("$End{name}\n"));
    }

    fn header(&mut self) {
        match self.encoding {
            MshEncoding::Ascii => self.text(format_args!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")),
            MshEncoding::Binary => {
                self.text(format_args!("$MeshFormat\n4.1 1 8\n"));
                self.int(1);
                self.end_section("MeshFormat");
            }
        }
    }

    fn names(&mut self, regions: &[String], surfaces: &[&str]) {
        self.text(format_args!("$PhysicalNames\n{}\n", regions.len() + surfaces.len()));
        for (tag, name) in (1..).zip(surfaces) {
            self.text(format_args!("2 {tag} \"{name}\"\n"));
        }
        for (tag, name) in (1..).zip(regions) {
            self.text(format_args!("3 {tag} \"{name}\"\n"));
        }
        self.text(format_args!("$EndPhysicalNames\n"));
    }

    fn entity(&mut self, tag: i32, bounds: [f64; 6], groups: &[i32]) {
        self.int(tag);
        bounds.into_iter().for_each(|x| self.real(x));
        self.size(groups.len() as u64);
        groups.iter().for_each(|&group| self.int(group));
        // No bounding entities: named surfaces need not close a volume.
        self.size(0);
        self.end();
    }

    fn entities(&mut self, mesh: &Mesh, points: &[Point], shells: &[Shell], volumes: &[(usize, Vec<usize>)]) {
        self.text(format_args!("$Entities\n"));
        [0, 0, shells.len(), volumes.len()].into_iter().for_each(|n| self.size(n as u64));
        self.end();
        for (tag, shell) in (1..).zip(shells) {
            let nodes = shell.triangles.iter().flat_map(|(_, nodes)| *nodes);
            self.entity(tag, bounds(points, nodes), &shell.tags);
        }
        for (region, elements) in volumes {
            let nodes = elements.iter().flat_map(|&e| mesh.topology().tets()[e]);
            let tag = *region as i32 + 1;
            self.entity(tag, bounds(points, nodes), &[tag]);
        }
        self.end_section("Entities");
    }

    /// Four numbers at the head of a section.
    fn announce(&mut self, blocks: usize, count: usize) {
        [blocks, count, 1, count].into_iter().for_each(|n| self.size(n as u64));
        self.end();
    }

    fn block(&mut self, dimension: i32, tag: i32, kind: i32, count: usize) {
        [dimension, tag, kind].into_iter().for_each(|n| self.int(n));
        self.size(count as u64);
        self.end();
    }

    fn nodes(&mut self, points: &[Point], groups: &BTreeMap<(i32, i32), Vec<usize>>) {
        self.text(format_args!("$Nodes\n"));
        self.announce(groups.len(), points.len());
        for (&(dimension, tag), nodes) in groups {
            // 0: without parametric coordinates.
            self.block(dimension, tag, 0, nodes.len());
            for &node in nodes {
                self.size(node as u64 + 1);
                self.end();
            }
            for &node in nodes {
                points[node].into_iter().for_each(|x| self.real(x));
                self.end();
            }
        }
        self.end_section("Nodes");
    }

    fn element(&mut self, tag: u64, nodes: &[NodeId]) {
        self.size(tag);
        nodes.iter().for_each(|node| self.size(u64::from(node.0) + 1));
        self.end();
    }

    fn elements(&mut self, mesh: &Mesh, shells: &[Shell], volumes: &[(usize, Vec<usize>)]) {
        let tets = mesh.topology().tets();
        let triangles: usize = shells.iter().map(|shell| shell.triangles.len()).sum();
        self.text(format_args!("$Elements\n"));
        self.announce(shells.len() + volumes.len(), triangles + tets.len());
        for (tag, shell) in (1..).zip(shells) {
            self.block(2, tag, 2, shell.triangles.len());
            for (tag, nodes) in &shell.triangles {
                self.element(*tag, nodes);
            }
        }
        for (region, elements) in volumes {
            self.block(3, *region as i32 + 1, 4, elements.len());
            for &e in elements {
                self.element((triangles + e) as u64 + 1, &tets[e]);
            }
        }
        self.end_section("Elements");
    }
}

//! Which displacement components are unknown: the design, fixed, sliding and free parts of the remesh region.
//!
//! Every face of the region's elements gets a kind, and a node takes on the constraints of *all* faces that meet at it:
//! where a sliding plane meets a fixed surface the edge is fixed, where two sliding planes meet it moves along the edge
//! only. A face has the kind of the surface that lists it (fixed before slide before free), else by default
//!
//! * fixed, where the region ends: at elements outside it or at the outside of the mesh;
//! * fixed, between two regions of the mesh: a shape contour moves only if it is designed ("suppress all the degrees
//!   of freedom that represent the fixed shape contour", section 2 of the paper);
//! * unconstrained elsewhere, subregions with different laws inside one region of the mesh included.
//!
//! Design nodes are prescribed in all components, whatever faces meet there. Nodes listed as fixed come next.
//!
//! Sliding planes may lie at any angle. A node whose planes hold it in directions between the axes has a frame of its own,
//! which begins with these.

use std::collections::BTreeMap;

use fluxmorph_geometry::directions::{FixedDirections, Frame, axis_of, extend, unit};
use fluxmorph_geometry::tet4::{FACES, Point, area_vector, centroid, cross, dot, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId, Topology};
use rayon::prelude::*;

use crate::deform::RemeshSetup;
use crate::error::RemeshError;

/// Sine of the largest angle between faces of one plane: coordinates in files carry 6 or more digits, faces are a hundredth of
/// the mesh, and some of them thin.
const FLAT: f64 = 1e-3;

/// Sine of the angle between faces of a sliding surface below which it counts as curved, and not as two planes: 25 degrees,
/// coarser than the facets of most meshes.
const CURVED: f64 = 0.42;

/// What the nodes of a surface may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundaryKind {
    /// Displacement prescribed by the design.
    Design,
    /// No displacement.
    Fixed,
    /// No displacement along the normal of each face; the surface must consist of planes.
    Slide,
    /// No constraint, where the default would be fixed.
    Free,
}

impl BoundaryKind {
    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Design => "design",
            Self::Fixed => "fixed",
            Self::Slide => "slide",
            Self::Free => "free",
        }
    }
}

/// A surface and its kind. Triangles that are no face of the remesh region are passed over: a symmetry plane may be
/// larger than the region.
#[derive(Clone, Debug)]
pub struct Boundary {
    /// Name, for messages.
    pub name: String,
    /// What its nodes may do.
    pub kind: BoundaryKind,
    /// Its triangles, in any orientation.
    pub triangles: Vec<[NodeId; 3]>,
}

impl Boundary {
    /// A named surface of the mesh.
    ///
    /// # Errors
    /// [`MeshError::UnknownSurface`].
    pub fn of_surface(topology: &Topology, name: &str, kind: BoundaryKind) -> Result<Self, MeshError> {
        Ok(Self { name: name.to_owned(), kind, triangles: topology.surface(name)?.to_vec() })
    }
}

/// What is known at every node of the mesh.
#[derive(Debug)]
pub(crate) struct NodeConditions {
    /// Design nodes in the order of the design displacement.
    pub(crate) design_nodes: Vec<NodeId>,
    /// By node: whether it is a design node.
    pub(crate) is_design: Vec<bool>,
    /// By node: bit `c` is set where component `c` is held at zero; all three outside the remesh region.
    held: Vec<u8>,
    /// Directions of the components at nodes where they are not along the coordinate axes.
    pub(crate) frames: BTreeMap<NodeId, Frame>,
}

/// All three components.
const ALL: u8 = 0b111;

/// What is left of a normal beside other directions above which it is a new one: planes meet at larger angles.
const NEW: f64 = 1e-3;

impl NodeConditions {
    /// Decides every node; `elements` are those of the remesh region.
    pub(crate) fn new(mesh: &Mesh, setup: &RemeshSetup, elements: &[ElementId]) -> Result<Self, RemeshError> {
        let topology = mesh.topology();
        let node_count = topology.node_count();
        check_nodes("the list of design nodes", &setup.design_nodes, node_count)?;
        let faces = sorted_faces(topology, elements);
        let mut is_design = vec![false; node_count];
        setup.design_nodes.iter().for_each(|n| is_design[n.index()] = true);
        let rules = FaceRules::new(mesh, &setup.boundaries, &faces, &is_design)?;

        let mut held = vec![ALL; node_count];
        let mut touched_outside = vec![true; node_count];
        for node in elements.iter().flat_map(|&e| topology.tet(e)) {
            held[node.index()] = setup.kinematic_constraint.held();
            touched_outside[node.index()] = false;
        }
        let mut in_region = vec![false; topology.tets().len()];
        elements.iter().for_each(|e| in_region[e.index()] = true);
        for e in topology.elements().filter(|e| !in_region[e.index()]) {
            topology.tet(e).iter().for_each(|n| touched_outside[n.index()] = true);
        }

        let mut oblique: BTreeMap<NodeId, Vec<usize>> = BTreeMap::new();
        let region_of = topology.region_of();
        for group in faces.chunk_by(|a, b| a.0 == b.0) {
            let nodes = group[0].0;
            let by_default = match group {
                [(_, a), (_, b)] if region_of[a.index()] == region_of[b.index()] => Rule::Free,
                _ => Rule::Fixed,
            };
            let rule = rules.of(nodes).unwrap_or(by_default);
            for node in nodes {
                match rule {
                    Rule::Fixed => held[node.index()] = ALL,
                    Rule::Slide(axis @ 0..3) => held[node.index()] |= 1 << axis,
                    Rule::Slide(plane) => oblique.entry(node).or_default().push(plane),
                    Rule::Free => {}
                }
                if group.len() == 1 {
                    touched_outside[node.index()] = false;
                }
            }
        }
        // A node that meets the outside by an edge or a corner only is on no face of the border.
        for (held, _) in held.iter_mut().zip(&touched_outside).filter(|(_, outside)| **outside) {
            *held = ALL;
        }

        let (is_design, frames) = (vec![false; node_count], BTreeMap::new());
        let mut conditions = Self { design_nodes: Vec::new(), is_design, held, frames };
        conditions.add_design_nodes(mesh, setup, &rules.design_nodes, elements)?;
        for (node, planes) in oblique {
            conditions.keep_to(node, planes.iter().map(|&plane| rules.normals[plane]));
        }
        Ok(conditions)
    }

    /// Holds a node along normals too.
    fn keep_to(&mut self, node: NodeId, normals: impl Iterator<Item = Point>) {
        let held = &mut self.held[node.index()];
        let along_axes = (0..3).filter(|c| *held >> c & 1 == 1).map(|c| Frame::COORDINATES.axes[c]);
        let mut basis: Vec<Point> = along_axes.collect();
        normals.for_each(|normal| extend(&mut basis, normal, NEW));
        let FixedDirections { frame, fixed } = FixedDirections::spanned_by(&basis);
        // Each axis in the place of the coordinate that it is nearest to: preconditioners couple components with their like.
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let nearness = |order: &[usize; 3]| (0..3).map(|d| frame.axes[order[d]][d].abs()).sum::<f64>();
        let order =
            orders.into_iter().max_by(|a, b| nearness(a).total_cmp(&nearness(b))).unwrap_or(orders[0]);
        *held = (0..3).filter(|&d| fixed >> order[d] & 1 == 1).fold(0, |bits, d| bits | 1 << d);
        if frame != Frame::COORDINATES && !self.is_design[node.index()] {
            self.frames.insert(node, Frame { axes: order.map(|k| frame.axes[k]) });
        }
    }

    fn add_design_nodes(
        &mut self,
        mesh: &Mesh,
        setup: &RemeshSetup,
        of_surfaces: &[NodeId],
        elements: &[ElementId],
    ) -> Result<(), RemeshError> {
        let topology = mesh.topology();
        let in_region = topology.is_node_of(elements.iter().copied());
        for &node in &setup.design_nodes {
            if !in_region[node.index()] {
                return Err(RemeshError::DesignNodeOutside { node, point: mesh.point(node) });
            }
            if std::mem::replace(&mut self.is_design[node.index()], true) {
                return Err(RemeshError::RepeatedDesignNode { node });
            }
        }
        self.design_nodes.extend(&setup.design_nodes);
        for &node in of_surfaces {
            if !std::mem::replace(&mut self.is_design[node.index()], true) {
                self.design_nodes.push(node);
            }
        }
        Ok(())
    }

    /// Whether a displacement component, in the frame of the node, is an unknown of Eq. 3.
    #[inline]
    pub(crate) fn is_unknown(&self, node: NodeId, component: usize) -> bool {
        !self.is_design[node.index()] && self.held[node.index()] >> component & 1 == 0
    }
}

fn check_nodes(list: &str, nodes: &[NodeId], node_count: usize) -> Result<(), RemeshError> {
    match nodes.iter().find(|n| n.index() >= node_count) {
        Some(&node) => Err(RemeshError::DanglingNode { list: list.to_owned(), node, nodes: node_count }),
        None => Ok(()),
    }
}

/// Sorted nodes of every face of the elements, with the element; sorted, so that the two sides follow each other.
fn sorted_faces(topology: &Topology, elements: &[ElementId]) -> Vec<([NodeId; 3], ElementId)> {
    let mut faces: Vec<_> = elements
        .par_iter()
        .flat_map_iter(|&e| FACES.iter().map(move |face| (face_key(face.map(|v| topology.tet(e)[v])), e)))
        .collect();
    faces.par_sort_unstable();
    faces
}

/// What holds at a face, the strongest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rule {
    Fixed,
    /// In the plane with a normal of [`FaceRules::normals`].
    Slide(usize),
    Free,
}

/// What the listed surfaces say about single faces.
struct FaceRules {
    /// Sorted by face; the strongest rule of a face comes first.
    rules: Vec<([NodeId; 3], Rule)>,
    /// Unit normals of sliding planes; the first three are the coordinate axes.
    normals: Vec<Point>,
    /// Nodes of design surfaces, ascending.
    design_nodes: Vec<NodeId>,
}

impl FaceRules {
    fn new(
        mesh: &Mesh,
        boundaries: &[Boundary],
        faces: &[([NodeId; 3], ElementId)],
        is_design: &[bool],
    ) -> Result<Self, RemeshError> {
        let mut rules = Vec::new();
        let mut normals = Frame::COORDINATES.axes.to_vec();
        let mut design_nodes = Vec::new();
        for boundary in boundaries {
            let list = || format!("the surface `{}`", boundary.name);
            for triangle in &boundary.triangles {
                check_nodes(&list(), triangle, mesh.topology().node_count())?;
            }
            let is_face = |triangle: &&[NodeId; 3]| {
                faces.binary_search_by_key(&face_key(**triangle), |face| face.0).is_ok()
            };
            let used: Vec<[NodeId; 3]> = boundary.triangles.iter().filter(is_face).copied().collect();
            // What the design prescribes need not be flat: an optimum goes on as a mesh.
            let slides = |triangle: &[NodeId; 3]| {
                boundary.kind == BoundaryKind::Slide && !triangle.iter().all(|n| is_design[n.index()])
            };
            let planes = planes(mesh, boundary, used.iter().copied().filter(slides))?;
            let places: Vec<usize> = planes.iter().map(|area| place_among(&mut normals, *area)).collect();
            for &triangle in &used {
                let key = face_key(triangle);
                let rule = match boundary.kind {
                    BoundaryKind::Design => {
                        design_nodes.extend(triangle);
                        continue;
                    }
                    BoundaryKind::Fixed => Rule::Fixed,
                    BoundaryKind::Slide => {
                        let area = area_vector(triangle.map(|n| mesh.point(n)));
                        let angles = planes.iter().map(|plane| sine(*plane, area)).enumerate();
                        match angles.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(plane, _)| plane) {
                            Some(plane) if slides(&triangle) => Rule::Slide(places[plane]),
                            _ => continue,
                        }
                    }
                    BoundaryKind::Free => Rule::Free,
                };
                rules.push((key, rule));
            }
            if used.is_empty() {
                let (surface, kind) = (boundary.name.clone(), boundary.kind.name());
                return Err(RemeshError::SurfaceElsewhere { surface, kind });
            }
        }
        rules.sort_unstable();
        design_nodes.sort_unstable();
        design_nodes.dedup();
        Ok(Self { rules, normals, design_nodes })
    }

    /// The rule of a face that a surface lists.
    fn of(&self, face: [NodeId; 3]) -> Option<Rule> {
        let first = self.rules.partition_point(|rule| rule.0 < face);
        self.rules.get(first).filter(|rule| rule.0 == face).map(|rule| rule.1)
    }
}

/// The planes of a sliding surface: sums of the area vectors of their triangles.
fn planes(
    mesh: &Mesh,
    boundary: &Boundary,
    triangles: impl Iterator<Item = [NodeId; 3]>,
) -> Result<Vec<Point>, RemeshError> {
    let mut sums: Vec<Point> = Vec::new();
    for vertices in triangles.map(|triangle| triangle.map(|n| mesh.point(n))) {
        let area = area_vector(vertices);
        if let Some(sum) = sums.iter_mut().find(|sum| sine(**sum, area) <= FLAT) {
            let sign = dot(*sum, area).signum();
            *sum = std::array::from_fn(|d| sum[d] + sign * area[d]);
        } else if sums.iter().any(|sum| sine(*sum, area) < CURVED) {
            let (surface, centroid, normal) = (boundary.name.clone(), centroid(vertices), unit(area));
            return Err(RemeshError::SlideCurved { surface, centroid, normal });
        } else {
            sums.push(area);
        }
    }
    Ok(sums)
}

/// The place of a normal among all; it is added where it is a new one.
fn place_among(normals: &mut Vec<Point>, area: Point) -> usize {
    let normal = unit(area);
    let known = axis_of(normal).or_else(|| (3..normals.len()).find(|&k| normals[k] == normal));
    known.unwrap_or_else(|| {
        normals.push(normal);
        normals.len() - 1
    })
}

/// Sine of the angle between two lines.
fn sine(a: Point, b: Point) -> f64 {
    norm(cross(unit(a), unit(b)))
}

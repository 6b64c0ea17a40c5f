//! Which components are unknown where: `A_x, A_y, A_z` everywhere, `ψ` in conductors and on their surfaces, less what the
//! boundaries fix.
//!
//! Of nodal elements:
//!
//! * *flux-parallel* surface (B·n = 0): the tangential components of `A` are zero, and `ψ = 0` where the surface cuts a
//!   conductor, since the current crosses it at right angles; beside a re-entrant edge of the domain there is a
//!   term with `ψ` instead (`reentrant`);
//! * *flux-normal* surface (n × H = 0): the normal component of `A` is zero, `ψ` is free;
//! * *uniform field*: the tangential components of `A` are those of the applied field, `ψ = 0`;
//! * `ψ` is defined up to a constant on every connected conductor: where no surface fixes it, one node is grounded.
//!
//! Of edge elements the circulations of `A` along the edges are unknown but on a tree outside conductors (`gauge`) and on
//! one edge more for every tunnel (`harmonic`), and the gradients' coefficients in and on conductors; on flux-parallel
//! surfaces and where a field is applied, all that is tangential is known, as on perfect conductors. Flux-normal is
//! natural.
//!
//! On planes along the axes the unknowns of nodal elements are components of `A`; at the nodes of other conditioned surfaces they are
//! components in the node's local frame (`fixed_directions`), and [`Unknowns::gather`] and
//! [`Unknowns::scatter_add`] turn between the two.

use std::collections::{BTreeMap, HashMap, HashSet};

use fluxmorph_geometry::directions::{FixedDirections, Frame, axis_of};
use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::fem::{DofMap, c64};
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, cross, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{CarrierId, ElementId, Mesh, NodeId};

use crate::boundary::{self, Boundary, CONFLICT};
use crate::element::edge::functions::{WHITNEY, is_gradient};
use crate::elements::ElementFamily;
use crate::error::SolverError;
use crate::fixed_directions::{CREASE, Fix, fixed_directions};
use crate::gauge;
use crate::harmonic::{self, HarmonicField};
use crate::space::Space;

/// Component index of `ψ`.
pub const PSI: usize = 3;

/// Sine of the angle between faces up to which they are one plane: coordinates in files carry few digits.
const FLAT: f64 = 1e-3;

/// Equation numbers of the A–ψ system.
#[derive(Clone, Debug)]
pub struct Unknowns {
    /// Components along the node's directions, and `ψ`.
    pub dofs: DofMap<4>,
    /// One node per connected conductor whose ψ no boundary fixes.
    pub grounded: Vec<CarrierId>,
    /// Directions at the nodes where they are not the coordinates'.
    frames: BTreeMap<CarrierId, Frame>,
    /// Fixed components that are not zero [T m], along the node's directions.
    prescribed: BTreeMap<CarrierId, Point>,
    /// Of edge elements, the curl-free fields of the mesh's tunnels, on the edges that are left.
    harmonic: Vec<HarmonicField>,
    /// Bit `d`: the node lies on a conditioned plane at right angles to the axis `d`.
    planes: BTreeMap<NodeId, u8>,
    /// Nodes on conditioned triangles that are at right angles to no axis, with the unit normals of these.
    oblique: Vec<(NodeId, Point)>,
}

/// Where currents flow, so that there is ψ.
#[derive(Clone, Debug, Default)]
pub struct Conductors {
    /// Meshed, ascending.
    pub elements: Vec<ElementId>,
    /// Surfaces with ψ: of edge elements those with an impedance, of nodal ones those beside re-entrant edges, conductors' or
    /// flux-parallel.
    pub surface: Vec<[NodeId; 3]>,
    /// Surfaces of conductors on which ψ is zero; of edge elements those of perfect conductors, where all is zero that is
    /// tangential.
    pub grounded: Vec<[NodeId; 3]>,
}

impl Conductors {
    /// The same without some elements, ascending.
    pub(crate) fn without(mut self, elements: &[ElementId]) -> Self {
        self.elements.retain(|e| elements.binary_search(e).is_err());
        self
    }

    /// The vertices between which current may pass: on surfaces with a fixed tangential `A`, and in and on conductors.
    pub(crate) fn joined(
        &self,
        mesh: &Mesh,
        boundaries: &[(String, Boundary)],
    ) -> Result<DisjointSets, SolverError> {
        let topology = mesh.topology();
        let mut joined = DisjointSets::new(topology.node_count());
        self.elements.iter().for_each(|&e| joined.join(topology.tet(e).map(NodeId::index)));
        let fixed = boundaries.iter().filter(|(_, boundary)| *boundary != Boundary::FluxNormal);
        for (surface, _) in fixed {
            topology.surface(surface)?.iter().for_each(|nodes| joined.join(nodes.map(NodeId::index)));
        }
        let own = self.surface.iter().chain(&self.grounded);
        own.for_each(|nodes| joined.join(nodes.map(NodeId::index)));
        Ok(joined)
    }

    /// Calls back with the carriers of every element and surface triangle with ψ.
    pub(crate) fn each(&self, space: &Space, mut with: impl FnMut(&[CarrierId])) {
        self.elements.iter().for_each(|&e| with(space.carriers_of(e)));
        self.surface.iter().for_each(|&triangle| with(&space.triangle(triangle)));
    }
}

/// What conditions say at one node.
#[derive(Default)]
struct AtNode {
    faces: Vec<(Fix, Point)>,
    /// Without the faces of the applied field.
    own: Vec<(Fix, Point)>,
    potential: Option<Point>,
    psi_zero: bool,
}

impl Unknowns {
    /// Numbers the unknowns of a space with conductors, and conditions on named surfaces.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] for an unknown surface, [`SolverError::Conflict`] where an applied field contradicts
    /// another condition.
    pub fn new(
        mesh: &Mesh,
        space: &Space,
        conductors: &Conductors,
        boundaries: &[(String, Boundary)],
    ) -> Result<Self, SolverError> {
        match space.family() {
            ElementFamily::Nodal => Self::of_nodes(mesh, space, conductors, boundaries),
            ElementFamily::Edge => Self::of_edges(mesh, space, conductors, boundaries),
        }
    }

    fn of_nodes(
        mesh: &Mesh,
        space: &Space,
        conductors: &Conductors,
        boundaries: &[(String, Boundary)],
    ) -> Result<Self, SolverError> {
        let covered = conductors.surface.iter().map(|&triangle| face_key(triangle)).collect();
        let at_nodes = conditions(mesh, space, boundaries, &covered)?;
        if at_nodes.is_empty() && conductors.grounded.is_empty() && !conductors.surface.is_empty() {
            let expected = "a condition on an outer surface, or elements = \"edge\": a surface with sharp edges leaves \
                            the potential of nodal elements open by a constant";
            return Err(SolverError::parameter("boundaries", "none", expected));
        }
        let potentials = at_nodes.values().filter_map(|at| at.potential).map(norm);
        let tolerance = CONFLICT * potentials.fold(0.0, f64::max);
        let node_count = space.carrier_count();
        let mut fixed = vec![0u8; node_count];
        let mut psi_zero = vec![false; node_count];
        let (mut frames, mut prescribed) = (BTreeMap::new(), BTreeMap::new());
        for (node, at) in at_nodes {
            let FixedDirections { frame, fixed: bits } = fixed_directions(&at.faces);
            fixed[node.index()] = bits;
            psi_zero[node.index()] = at.psi_zero;
            if frame != Frame::COORDINATES {
                frames.insert(node, frame);
            }
            if let Some(potential) = at.potential {
                check_agreement(mesh, space, node, &at.own, potential, tolerance)?;
                let component = |k: usize| {
                    if bits >> k & 1 == 1 { dot(frame.axes[k], potential) } else { 0.0 }
                };
                prescribed.insert(node, [component(0), component(1), component(2)]);
            }
        }
        let mut has_psi = vec![false; node_count];
        let bare = conductors.grounded.iter().flat_map(|&triangle| space.triangle(triangle));
        bare.for_each(|n| psi_zero[n.index()] = true);
        let mut connected = DisjointSets::new(node_count);
        conductors.each(space, |nodes| {
            connected.join(nodes.iter().map(|n| n.index()));
            nodes.iter().for_each(|n| has_psi[n.index()] = true);
        });
        let grounded = ground(&mut connected, &has_psi, &psi_zero);
        for n in &grounded {
            psi_zero[n.index()] = true;
        }
        let dofs = DofMap::new(node_count, |node, c| {
            let i = node.index();
            if c == PSI { has_psi[i] && !psi_zero[i] } else { fixed[i] >> c & 1 == 0 }
        });
        let (planes, oblique) = planes(mesh, boundaries)?;
        Ok(Self { dofs, grounded, frames, prescribed, planes, oblique, harmonic: Vec::new() })
    }

    fn of_edges(
        mesh: &Mesh,
        space: &Space,
        conductors: &Conductors,
        boundaries: &[(String, Boundary)],
    ) -> Result<Self, SolverError> {
        let count = space.carrier_count();
        let edges = space.edges();
        let (mut known, mut prescribed) = (vec![false; count], BTreeMap::new());
        let along = |carrier: CarrierId, potential: Point| -> f64 {
            let [from, to] = edges[carrier.index()].map(|n| mesh.point(n));
            dot(potential, sub(to, from))
        };
        let at_carriers = conditions(mesh, space, boundaries, &HashSet::new())?;
        let applied = || {
            let of_edges = at_carriers.iter().filter(|(carrier, _)| carrier.index() < edges.len());
            of_edges.filter_map(|(&carrier, at)| Some((carrier, at, at.potential?)))
        };
        let largest = applied().map(|(_, _, potential)| norm(potential)).fold(0.0, f64::max);
        let tolerance = CONFLICT * largest;
        for (carrier, at, potential) in applied() {
            // Along the plane in all directions, whether or not of the edge: beside a plane without A all flux must be in that of the
            // surface.
            let planes: Vec<_> = at.own.iter().copied().filter(|(fix, _)| *fix == Fix::Tangential).collect();
            check_agreement(mesh, space, carrier, &planes, potential, tolerance)?;
            let value = if planes.is_empty() { along(carrier, potential) } else { 0.0 };
            prescribed.insert(carrier, [value, 0.0, 0.0]);
        }
        for (carrier, at) in &at_carriers {
            known[carrier.index()] = at.psi_zero;
        }
        let perfect = conductors.grounded.iter().flat_map(|&triangle| space.triangle(triangle));
        perfect.for_each(|carrier| known[carrier.index()] = true);
        let mut conducts = vec![false; count];
        conductors.each(space, |carriers| carriers.iter().for_each(|c| conducts[c.index()] = true));
        let is_kept = |e: usize| known[e] || conducts[e];
        let mut branches = gauge::tree(mesh.topology().node_count(), edges, is_kept);
        let harmonic = harmonic::fields(edges.len(), &space.edge_triangles(), |e| is_kept(e) || branches[e]);
        harmonic.iter().for_each(|field| branches[field.edge] = true);
        let dofs = DofMap::new(count, |carrier, c| {
            let i = carrier.index();
            if known[i] {
                return false;
            }
            let is_rotational = match branches.get(i) {
                Some(&is_branch) => c == WHITNEY && !is_branch,
                None => c < 2,
            };
            is_rotational || conducts[i] && is_gradient(space.order(), i < edges.len(), c)
        });
        let (planes, oblique) = planes(mesh, boundaries)?;
        let (grounded, frames) = (Vec::new(), BTreeMap::new());
        Ok(Self { dofs, grounded, frames, prescribed, planes, oblique, harmonic })
    }

    /// The coefficients of a carrier, of a node `A_x, A_y, A_z` and `ψ`, out of a vector of unknowns; zero where a component is fixed.
    #[inline]
    pub fn gather(&self, values: &[c64], carrier: CarrierId) -> [c64; 4] {
        let local = self.dofs.gather(values, carrier);
        match self.frame(carrier) {
            None => local,
            Some(frame) => {
                let mut global = [c64::default(), c64::default(), c64::default(), local[PSI]];
                for (k, axis) in frame.axes.iter().enumerate() {
                    for d in 0..3 {
                        global[d] += axis[d] * local[k];
                    }
                }
                global
            }
        }
    }

    /// The prescribed part of `A` at a node [T m]; of an edge its circulation [T m²], in the first place.
    #[inline]
    pub fn prescribed_at(&self, carrier: CarrierId) -> Option<Point> {
        if self.prescribed.is_empty() {
            return None;
        }
        let local = self.prescribed.get(&carrier)?;
        let axes = self.frame(carrier).map_or(Frame::COORDINATES.axes, |frame| frame.axes);
        Some(std::array::from_fn(|d| (0..3).map(|k| axes[k][d] * local[k]).sum()))
    }

    /// Of edge elements, the curl-free fields that are no gradients: a sound load does no work on them.
    pub(crate) fn harmonic_fields(&self) -> &[HarmonicField] {
        &self.harmonic
    }

    /// Carriers with a prescribed part of `A`, which belongs to where they lie, so that they must not move; ascending.
    pub fn prescribed_carriers(&self) -> impl Iterator<Item = CarrierId> + '_ {
        self.prescribed.keys().copied()
    }

    /// Nodes on conditioned planes along the axes, and bits of the axes that these are at right angles to: along them
    /// the nodes must not move, for the condition is that of the plane.
    pub fn plane_nodes(&self) -> impl Iterator<Item = (NodeId, u8)> + '_ {
        self.planes.iter().map(|(&node, &axes)| (node, axes))
    }

    /// Nodes on conditioned surfaces that are at right angles to no axis, with the unit normals of the triangles there: along these
    /// the nodes must not move either.
    pub fn oblique_nodes(&self) -> &[(NodeId, Point)] {
        &self.oblique
    }

    /// Nodes with directions of their own at which oblique faces count as one smooth surface: the directions follow the areas of
    /// these, so that the nodes must not move.
    pub fn smoothed_nodes(&self) -> impl Iterator<Item = NodeId> + '_ {
        let crease = CREASE.to_radians().cos();
        let are_smoothed = move |a: Point, b: Point| norm(cross(a, b)) > FLAT && dot(a, b) > crease;
        let has_pair = move |own: &[(NodeId, Point)]| {
            own.iter().any(|(_, a)| own.iter().any(|(_, b)| are_smoothed(*a, *b)))
        };
        let at_nodes = self.oblique.chunk_by(|a, b| a.0 == b.0);
        at_nodes.filter(move |own| self.frame(own[0].0.into()).is_some() && has_pair(own)).map(|own| own[0].0)
    }

    /// Adds the components of a carrier, of a node `x, y, z` and ψ, into a vector of unknowns; what is fixed is dropped.
    #[inline]
    pub fn scatter_add(&self, values: &mut [c64], carrier: CarrierId, components: [c64; 4]) {
        let local = match self.frame(carrier) {
            None => components,
            Some(frame) => {
                let along = |k: usize| (0..3).map(|d| frame.axes[k][d] * components[d]).sum();
                [along(0), along(1), along(2), components[PSI]]
            }
        };
        self.dofs.scatter_add(values, carrier, local);
    }

    /// The directions at a node, where they are not the coordinates'.
    #[inline]
    pub(crate) fn frame(&self, carrier: CarrierId) -> Option<&Frame> {
        if self.frames.is_empty() { None } else { self.frames.get(&carrier) }
    }

    /// Whether some node has directions of its own.
    pub(crate) fn has_frames(&self) -> bool {
        !self.frames.is_empty()
    }
}

/// What [`planes`] finds.
type Planes = (BTreeMap<NodeId, u8>, Vec<(NodeId, Point)>);

/// The axes across conditioned planes, at every vertex on one, and the normals of the triangles across no axis at theirs.
fn planes(mesh: &Mesh, boundaries: &[(String, Boundary)]) -> Result<Planes, SolverError> {
    let (mut planes, mut oblique) = Planes::default();
    for (surface, _) in boundaries {
        for &triangle in mesh.topology().surface(surface)? {
            let area = area_vector(triangle.map(|v| mesh.point(v)));
            let normal = area.map(|c| c / norm(area));
            match axis_of(normal) {
                Some(axis) => triangle.iter().for_each(|&v| *planes.entry(v).or_insert(0) |= 1 << axis),
                None => oblique.extend(triangle.map(|v| (v, normal))),
            }
        }
    }
    oblique.sort_by_key(|(node, normal): &(NodeId, Point)| (*node, normal.map(f64::to_bits)));
    oblique.dedup();
    Ok((planes, oblique))
}

/// The faces of conditioned surfaces at every carrier of the space, but for flux-parallel ones that have a term instead.
fn conditions(
    mesh: &Mesh,
    space: &Space,
    boundaries: &[(String, Boundary)],
    covered: &HashSet<[NodeId; 3]>,
) -> Result<BTreeMap<CarrierId, AtNode>, SolverError> {
    let default = boundary::default_centre(mesh, boundaries)?;
    let mut at_nodes: BTreeMap<CarrierId, AtNode> = BTreeMap::new();
    let mut condition_of: HashMap<[NodeId; 3], (&str, &Boundary)> = HashMap::new();
    for (surface, boundary) in boundaries {
        let applied = match boundary {
            Boundary::UniformField(field) => Some((field, field.centre.unwrap_or(default))),
            _ => None,
        };
        let fix = if *boundary == Boundary::FluxNormal { Fix::Normal } else { Fix::Tangential };
        for &triangle in mesh.topology().surface(surface)? {
            let vertices = triangle.map(|v| mesh.point(v));
            let area = area_vector(vertices);
            let (other, first) = condition_of.entry(face_key(triangle)).or_insert((surface, boundary));
            if *first != boundary {
                return Err(SolverError::TwoConditions {
                    surfaces: [(*other).to_owned(), surface.clone()],
                    place: centroid(vertices),
                });
            }
            if *boundary == Boundary::FluxParallel && covered.contains(&face_key(triangle)) {
                continue;
            }
            for node in space.triangle(triangle) {
                let at = at_nodes.entry(node).or_default();
                at.faces.push((fix, area));
                at.psi_zero |= fix == Fix::Tangential;
                match applied {
                    None => at.own.push((fix, area)),
                    Some((field, centre)) => {
                        at.potential = Some(field.vector_potential(centre, space.position(mesh, node)));
                    }
                }
            }
        }
    }
    Ok(at_nodes)
}

/// Refuses an applied field whose potential is not zero along a direction that another condition fixes to zero.
fn check_agreement(
    mesh: &Mesh,
    space: &Space,
    node: CarrierId,
    own: &[(Fix, Point)],
    potential: Point,
    tolerance: f64,
) -> Result<(), SolverError> {
    if own.is_empty() {
        return Ok(());
    }
    let FixedDirections { frame, fixed } = fixed_directions(own);
    let conflict = (0..3)
        .filter(|k| fixed >> k & 1 == 1)
        .map(|k| dot(frame.axes[k], potential).abs())
        .fold(0.0, f64::max);
    if conflict > tolerance {
        return Err(SolverError::Conflict { place: space.position(mesh, node) });
    }
    Ok(())
}

/// The first node of every connected set of nodes with ψ in which no node is fixed already.
fn ground(sets: &mut DisjointSets, has_psi: &[bool], psi_zero: &[bool]) -> Vec<CarrierId> {
    let nodes = || (0..has_psi.len()).filter(|&n| has_psi[n]);
    let mut is_fixed = vec![false; has_psi.len()];
    for n in nodes().filter(|&n| psi_zero[n]) {
        is_fixed[sets.root(n)] = true;
    }
    nodes().filter(|&n| sets.root(n) == n && !is_fixed[n]).map(CarrierId::new).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fluxmorph_geometry::generate::{BlockParameters, SphereParameters, block, sphere};

    use super::*;
    use crate::elements::{ElementFamily, Order};

    #[test]
    fn faces_of_a_sphere_are_smoothed_and_oblique_planes_are_not() {
        let smoothed = |mesh: &Mesh, surfaces: &[&str]| {
            let space = Space::new(mesh.topology(), ElementFamily::Nodal, Order::Linear);
            let boundaries: Vec<(String, Boundary)> =
                surfaces.iter().map(|name| ((*name).to_owned(), Boundary::FluxParallel)).collect();
            let unknowns = Unknowns::new(mesh, &space, &Conductors::default(), &boundaries);
            unknowns.expect("conditions that agree").smoothed_nodes().count()
        };
        let octant =
            sphere(&SphereParameters { divisions: 2, ..SphereParameters::default() }).expect("sound");
        assert!(smoothed(&octant, &["outer"]) > 0);
        let straight =
            block(&BlockParameters { cells: [2; 3], ..BlockParameters::default() }).expect("sound");
        let (sine, cosine) = 0.5_f64.sin_cos();
        let turned =
            straight.points().iter().map(|&[x, y, z]| [cosine * x - sine * y, sine * x + cosine * y, z]);
        let oblique =
            Mesh::new(Arc::clone(straight.topology()), turned.collect()).expect("the same elements");
        assert_eq!(smoothed(&oblique, &["x_min", "y_min", "z_min"]), 0);
    }
}

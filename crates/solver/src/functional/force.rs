//! Force and torque on a body, by virtual work in the layer of elements around it.
//!
//! A rigid virtual velocity `v` of the body's nodes, zero at all others, deforms the elements that touch the body from outside.
//! The force is minus the work of Maxwell's stress there, `−∫σ:∇v` ([`crate::element::virtual_work`]), the rate at which their
//! energy falls as they carry their flux along; inside the body nothing is deformed, so that a region which its surface stands for
//! need not have elements. It holds with eddy currents as well: in harmonics it is the time average. Where the body goes on beyond
//! an outer face, its nodes there keep to the face, so that a force is that on the free faces of the meshed part. The layer must be
//! without current, magnetisation and conductivity, and where space is what it is in the mesh: not in the shell that stands for all
//! of it.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use fluxmorph_geometry::directions::{beside, extend, unit};
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, cross, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId};
use rayon::prelude::*;

use super::integral::Sum;
use super::{FunctionalValue, is_static};
use crate::coil::CoilShape;
use crate::element::virtual_work::VirtualWork;
use crate::error::SolverError;
use crate::family::LocalIntegral;
use crate::model::FieldModel;
use crate::solution::FieldState;
use crate::surface::Conductor;

/// A component of force or torque: the work per unit of a rigid motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RigidMotion {
    /// Along a unit vector: a force [N].
    Translation(Point),
    /// Around an axis: a torque [N m].
    Rotation {
        /// Unit vector along the axis.
        axis: Point,
        /// A point on the axis [m].
        about: Point,
    },
}

impl RigidMotion {
    /// The velocity [m per unit] of a point of the body.
    fn velocity(&self, x: Point) -> Point {
        match *self {
            Self::Translation(direction) => direction,
            Self::Rotation { axis, about } => cross(axis, sub(x, about)),
        }
    }
}

/// Force [N] and torque [N m] of what acts on the nodes of a body ([`Force::nodal`]), the torque about a point.
pub fn resultant(nodal: &BTreeMap<NodeId, Point>, mesh: &Mesh, about: Point) -> [Point; 2] {
    let mut sums = [[0.0; 3]; 2];
    for (&node, &force) in nodal {
        let torque = cross(sub(mesh.point(node), about), force);
        for d in 0..3 {
            sums[0][d] += force[d];
            sums[1][d] += torque[d];
        }
    }
    sums
}

/// The force on some regions.
#[derive(Clone, Debug)]
pub struct Force {
    /// Elements that touch the body from outside, ascending.
    layer: Vec<ElementId>,
    /// Nodes of the body, with the directions in which they cannot move, across outer faces: orthonormal.
    body: BTreeMap<NodeId, Vec<Point>>,
    motion: RigidMotion,
}

impl Force {
    /// The force on the body that some regions make up, meshed or replaced by their surfaces.
    ///
    /// # Errors
    /// [`SolverError::NoLayer`] for a body without elements around it, [`SolverError::Layer`] where these are not
    /// free, [`SolverError::TouchesConductor`] where they end at the surface of another one, [`SolverError::ForceInShell`] where they
    /// or the body are in the shell of open space.
    pub fn new(
        model: &FieldModel,
        mesh: &Mesh,
        name: &str,
        regions: &[RegionId],
        motion: RigidMotion,
    ) -> Result<Self, SolverError> {
        let topology = model.topology();
        let region_of = |e: ElementId| topology.region_of()[e.index()];
        let inside = |e: &ElementId| regions.contains(&region_of(*e));
        let is_of_body = |conductor: &&Conductor| {
            topology.region(&conductor.name).is_ok_and(|region| regions.contains(&region))
        };
        let (replaced, others): (Vec<_>, Vec<_>) = model.conductors().iter().partition(is_of_body);
        let meshed = topology.elements().filter(inside).flat_map(|e| topology.tet(e));
        let of_surfaces = replaced.into_iter().flat_map(|own| own.surface.iter().flatten().copied());
        let body = held_nodes(model, mesh, meshed.chain(of_surfaces))?;
        let around = body.keys().flat_map(|&node| topology.elements_around(node)).copied();
        let layer: BTreeSet<ElementId> = around.filter(|e| !inside(e)).collect();
        if layer.is_empty() {
            return Err(SolverError::NoLayer { body: name.to_owned() });
        }
        let place = |e: ElementId| centroid(mesh.vertices(e));
        let mut with_layer = topology.elements().filter(inside).chain(layer.iter().copied());
        if let Some(e) = with_layer.find(|&e| model.is_open(e)) {
            return Err(SolverError::ForceInShell { body: name.to_owned(), place: place(e) });
        }
        let fault = |e: ElementId, what| SolverError::Layer {
            body: name.to_owned(),
            region: topology.region_names()[region_of(e).index()].clone(),
            place: place(e),
            what,
        };
        for &e in &layer {
            if model.curve_of(e).is_some() {
                return Err(fault(e, "iron with a B–H curve"));
            }
            if model.remanence_of(e) != [0.0; 3] {
                return Err(fault(e, "a magnet"));
            }
            if model.materials()[region_of(e).index()].conductivity > 0.0 {
                return Err(fault(e, "a conductor"));
            }
            if carries_current(model, mesh, e) {
                return Err(fault(e, "a winding"));
            }
        }
        // Current flows in the surfaces that stand for conductors, which have no element.
        let touches = |(_, face): &(&Conductor, [NodeId; 3])| face.iter().any(|node| body.contains_key(node));
        let mut faces = others.into_iter().flat_map(|own| own.surface.iter().map(move |face| (own, *face)));
        if let Some((conductor, face)) = faces.find(touches) {
            return Err(SolverError::TouchesConductor {
                body: name.to_owned(),
                conductor: conductor.name.clone(),
                place: centroid(face.map(|node| mesh.point(node))),
            });
        }
        Ok(Self { layer: layer.into_iter().collect(), body, motion })
    }

    /// What acts on every node of the body [N], ascending by node: minus the work of the stress in the layer along its velocity.
    /// Sums of it are force and torque; nodes inside the body have nothing.
    pub fn nodal(&self, (model, mesh, solution): FieldState<'_>) -> BTreeMap<NodeId, Point> {
        let topology = model.topology();
        let of_element = |&e: &ElementId| virtual_work((model, mesh, solution), e, &[[0.0; 3]; 4]).1;
        // Computed in parallel, added in the order of the elements.
        let terms: Vec<[Point; 4]> = self.layer.par_iter().map(of_element).collect();
        let mut sums = BTreeMap::new();
        for (&e, terms) in self.layer.iter().zip(&terms) {
            for (node, term) in topology.tet(e).into_iter().zip(terms) {
                let Some(held) = self.body.get(&node) else { continue };
                let sum: &mut Point = sums.entry(node).or_default();
                let free = beside(held, *term);
                (0..3).for_each(|d| sum[d] -= free[d]);
            }
        }
        sums
    }

    pub(super) fn evaluate(&self, (model, mesh, solution): FieldState<'_>) -> FunctionalValue {
        let free =
            |node: NodeId, vector: Point| self.body.get(&node).map_or([0.0; 3], |held| beside(held, vector));
        let mut sum = Sum::new(model);
        sum.elements(&self.layer, |e| {
            let nodes = model.topology().tet(e);
            // Minus the rate: the velocities are turned round.
            let velocities = nodes.map(|node| free(node, self.motion.velocity(mesh.point(node))).map(|v| -v));
            let (mut rate, by_velocity) = virtual_work((model, mesh, solution), e, &velocities);
            if let RigidMotion::Rotation { axis, .. } = self.motion {
                // A node of the body that moves by δx has the velocity axis × δx more.
                for (k, &node) in nodes.iter().enumerate() {
                    let more = cross(free(node, by_velocity[k]), axis);
                    (0..3).for_each(|d| rate.positions[k][d] -= more[d]);
                }
            }
            rate
        });
        sum.into_value()
    }
}

/// The work of the stress in an element along velocities of its vertices, with its derivatives, and the derivatives by the velocities.
fn virtual_work(
    (model, mesh, solution): FieldState<'_>,
    e: ElementId,
    velocities: &[Point; 4],
) -> (LocalIntegral<4>, [Point; 4]) {
    let share = if is_static(model) { 0.5 } else { 0.25 };
    let (space, field) = (model.space(), solution.element(model, e));
    let cell = space.cell(mesh, e);
    let mut work = VirtualWork::new(&cell.tet, share * model.coefficients_of(e).reluctivity, velocities);
    let mut rate = space.elements().flux_integral(&cell, field.values(), &mut |b| work.density(b));
    let [by_positions, by_velocities] = work.at_vertices(&cell.tet);
    for (position, more) in rate.positions.iter_mut().zip(by_positions) {
        (0..3).for_each(|d| position[d] += more[d]);
    }
    (rate, by_velocities)
}

/// The nodes of a body, with the directions in which they cannot move.
fn held_nodes(
    model: &FieldModel,
    mesh: &Mesh,
    nodes: impl Iterator<Item = NodeId>,
) -> Result<BTreeMap<NodeId, Vec<Point>>, SolverError> {
    let mut body: BTreeMap<NodeId, Vec<Point>> = nodes.map(|node| (node, Vec::new())).collect();
    let natural = natural(model, mesh, |node| body.contains_key(node))?;
    for (node, normal) in conditioned(model).chain(natural) {
        body.entry(node).and_modify(|held| extend(held, normal, INDEPENDENT));
    }
    Ok(body)
}

/// The nodes on conditioned surfaces with the normals of these, a node once for each.
fn conditioned(model: &FieldModel) -> impl Iterator<Item = (NodeId, Point)> + '_ {
    let unknowns = model.unknowns();
    let of_planes = unknowns.plane_nodes().flat_map(|(node, axes)| {
        let across = (0..3).filter(move |axis| axes >> axis & 1 == 1);
        across.map(move |axis| (node, std::array::from_fn(|d| f64::from(u8::from(d == axis)))))
    });
    of_planes.chain(unknowns.oblique_nodes().iter().copied())
}

/// The nodes of outer faces of which nothing is said, with the normals of these: `n × H = 0` there, as on a flux-normal plane. Of faces
/// with a node that is asked for.
fn natural(
    model: &FieldModel,
    mesh: &Mesh,
    is_asked_for: impl Fn(&NodeId) -> bool,
) -> Result<Vec<(NodeId, Point)>, SolverError> {
    let topology = model.topology();
    let outer = topology.outer_facets().map(|facet| facet.nodes);
    let mut faces: Vec<[NodeId; 3]> = outer.filter(|nodes| nodes.iter().any(&is_asked_for)).collect();
    if faces.is_empty() {
        return Ok(Vec::new());
    }
    let conductors = model.conductors().iter().flat_map(|conductor| &conductor.surface);
    let mut with_condition: HashSet<_> = conductors.map(|face| face_key(*face)).collect();
    for (name, _) in &model.setup().boundaries {
        with_condition.extend(topology.surface(name)?.iter().map(|face| face_key(*face)));
    }
    faces.retain(|&face| !with_condition.contains(&face_key(face)));
    let with_normal = |nodes: [NodeId; 3]| {
        let normal = unit(area_vector(nodes.map(|node| mesh.point(node))));
        nodes.map(|node| (node, normal))
    };
    Ok(faces.into_iter().flat_map(with_normal).collect())
}

/// What a normal must have beside directions that are held [1] to be another one, and not of a face of the same surface, which may
/// be curved: the sine of 17 degrees.
const INDEPENDENT: f64 = 0.3;

/// Whether the current of a coil flows in an element.
fn carries_current(model: &FieldModel, mesh: &Mesh, e: ElementId) -> bool {
    model.coils().iter().any(|coil| match &coil.shape {
        CoilShape::Racetrack(racetrack) => racetrack.wound_place(mesh.vertices(e)).is_some(),
        // What flows in a solid conductor above 0 Hz moves with it, as eddy currents do.
        CoilShape::Solid(_) if model.angular_frequency() > 0.0 => false,
        shape => shape
            .region_current()
            .is_some_and(|current| current.current_density().binary_search_by_key(&e, |(e, _)| *e).is_ok()),
    })
}

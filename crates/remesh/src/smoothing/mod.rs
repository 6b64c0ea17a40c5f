//! Optimisation-based smoothing: interior nodes move, one after the other, to raise the least quality around them.
//!
//! Only strictly interior nodes of the elastic body move; every outer face, every face between regions and every named
//! surface stays bit for bit. What is raised is the quality of Eq. 4, or with a reference mesh the same measure of the
//! map from the reference element to the present one (`measure.rs`): a layer that is thin on purpose then stays thin.
//! The place of one node is found in `star.rs`. Nodes are visited one by one, the worst first, so that the result has
//! the same bits for any number of threads.
//!
//! What holds whatever the mesh: the worst quality and the worst measure of the elements never fall, and in a valid mesh
//! no element ever inverts, at no time. In a tangled mesh every tangled star raises its least volume first, and upright
//! elements may invert on the way; the outcome is a valid mesh or an error. Nodes anywhere within a cell around their
//! place are put in order. What moves of single nodes do not undo is a layer sheared by many times its thickness.

mod maximin;
mod measure;
mod star;

use std::sync::Arc;

use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId, Topology};
use rayon::prelude::*;

use crate::error::RemeshError;
use measure::Ideal;
use star::{Corner, Star, Worth};

/// How long to smooth, and what to leave alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothingSettings {
    /// A node whose elements all have at least this measure is left alone, in `0 < target`. The measure is 1 at best,
    /// both as quality and against a reference; 0.3 bounds the paper's poor elements.
    pub target: f64,
    /// Most sweeps over the poor nodes. Smoothing ends before, when no node can be improved: blocks of cells as long as
    /// wide take about five sweeps, thin layers more.
    pub sweeps: usize,
}

impl Default for SmoothingSettings {
    fn default() -> Self {
        Self { target: 0.3, sweeps: 20 }
    }
}

/// What a smoothing did.
#[derive(Clone, Debug)]
pub struct Smoothed {
    /// The smoothed mesh: the given points plus [`Smoothed::displacement`], to the bit.
    pub mesh: Mesh,
    /// Motion from the given points [m], shape `(n_nodes, 3)`; zero at all nodes but the smoothed ones.
    pub displacement: Vec<Point>,
    /// Nodes that were moved.
    pub moved_nodes: usize,
    /// Sweeps made, the last of which may have moved nothing.
    pub sweeps: usize,
    /// Worst quality (Eq. 4) of the elements on entry.
    pub worst_before: f64,
    /// Worst quality of the elements now; not less.
    pub worst_after: f64,
    /// Worst measure on entry: against the reference mesh if there is one, else the quality.
    pub measure_before: f64,
    /// Worst measure now; not less.
    pub measure_after: f64,
}

/// Smooths the interior nodes of `elements`, an elastic body.
///
/// With a `reference` mesh of the same topology the shapes of its elements are the ideal; without one, the regular
/// tetrahedron.
///
/// # Errors
/// [`RemeshError::EmptyRegion`], [`RemeshError::DanglingSmoothed`], [`RemeshError::SmoothingTarget`],
/// [`RemeshError::ReferenceTopology`].
pub fn smooth(
    mesh: &Mesh,
    reference: Option<&Mesh>,
    elements: &[ElementId],
    settings: &SmoothingSettings,
) -> Result<Smoothed, RemeshError> {
    smooth_points(mesh.topology(), mesh.points(), reference, elements, settings)
}

/// As [`smooth`], of `points` [m], shape `(n_nodes, 3)`, that may be tangled.
///
/// # Errors
/// As [`smooth`], and [`RemeshError::Mesh`]: points that do not fit the topology or are not finite, and
/// [`MeshError::Inverted`] naming the worst element where the tangle remains.
pub fn smooth_points(
    topology: &Arc<Topology>,
    points: &[Point],
    reference: Option<&Mesh>,
    elements: &[ElementId],
    settings: &SmoothingSettings,
) -> Result<Smoothed, RemeshError> {
    check(topology, points, reference, elements, settings)?;
    let mut body = Body::new(topology, points, reference, elements);
    let before = body.worst(elements);
    let mut sweeps = 0;
    while sweeps < settings.sweeps {
        sweeps += 1;
        if body.sweep(settings.target, before) == 0 {
            break;
        }
    }
    let after = body.worst(elements);
    let mesh = Mesh::new(Arc::clone(topology), body.points)?;
    Ok(Smoothed {
        mesh,
        moved_nodes: body.displacement.iter().filter(|u| **u != [0.0; 3]).count(),
        displacement: body.displacement,
        sweeps,
        worst_before: before.quality,
        worst_after: after.quality,
        measure_before: before.measure,
        measure_after: after.measure,
    })
}

/// Least measure of some elements of a mesh against those of a reference mesh of the same topology: the share of its
/// shape that the worst one keeps, 1 for similar elements. 1 of no element.
#[expect(clippy::disallowed_methods, reason = "the least of numbers has no order")]
pub fn least_shape(mesh: &Mesh, reference: &Mesh, elements: &[ElementId]) -> f64 {
    let measure = |&e: &ElementId| Ideal::shape_of(reference.vertices(e)).measure(mesh.vertices(e));
    elements.par_iter().map(measure).reduce(|| 1.0, f64::min)
}

fn check(
    topology: &Arc<Topology>,
    points: &[Point],
    reference: Option<&Mesh>,
    elements: &[ElementId],
    settings: &SmoothingSettings,
) -> Result<(), RemeshError> {
    let count = topology.tets().len();
    if elements.is_empty() {
        return Err(RemeshError::EmptyRegion);
    }
    if let Some(&element) = elements.iter().find(|e| e.index() >= count) {
        return Err(RemeshError::DanglingSmoothed { element, elements: count });
    }
    if !(settings.target > 0.0 && settings.target.is_finite()) {
        return Err(RemeshError::SmoothingTarget { target: settings.target });
    }
    if points.len() != topology.node_count() {
        return Err(MeshError::PointCount { points: points.len(), nodes: topology.node_count() }.into());
    }
    if let Some(i) = points.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        return Err(MeshError::NotFinite { node: NodeId::new(i), point: points[i] }.into());
    }
    if let Some(other) = reference.map(Mesh::topology)
        && !Arc::ptr_eq(other, topology)
        && other.tets() != topology.tets()
    {
        return Err(RemeshError::ReferenceTopology {
            reference_nodes: other.node_count(),
            reference_elements: other.tets().len(),
            nodes: topology.node_count(),
            elements: count,
        });
    }
    Ok(())
}

/// What a node may do in the next visit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Standing {
    /// It stays for good: not strictly inside one region of the body.
    Held,
    /// It may move.
    Free,
    /// It may move, but nothing around it has changed since it could not be improved.
    Settled,
}

/// The elastic body while it is smoothed.
struct Body<'a> {
    topology: &'a Topology,
    given: &'a [Point],
    reference: Option<&'a Mesh>,
    points: Vec<Point>,
    displacement: Vec<Point>,
    /// By element; of elements outside the body, what no sweep takes for poor.
    worth: Vec<Worth>,
    standing: Vec<Standing>,
}

impl<'a> Body<'a> {
    fn new(
        topology: &'a Topology,
        given: &'a [Point],
        reference: Option<&'a Mesh>,
        elements: &[ElementId],
    ) -> Self {
        let none = Worth::least([]);
        let mut body = Self {
            topology,
            given,
            reference,
            points: given.to_vec(),
            displacement: vec![[0.0; 3]; given.len()],
            worth: vec![none; topology.tets().len()],
            standing: standing(topology, elements),
        };
        let worth: Vec<Worth> =
            elements.par_iter().map(|&e| Worth::new(body.vertices(e), &body.ideal(e))).collect();
        for (&e, worth) in elements.iter().zip(worth) {
            body.worth[e.index()] = worth;
        }
        body
    }

    fn vertices(&self, element: ElementId) -> [Point; 4] {
        self.topology.tet(element).map(|n| self.points[n.index()])
    }

    fn ideal(&self, element: ElementId) -> Ideal {
        self.reference.map_or_else(Ideal::regular, |mesh| Ideal::shape_of(mesh.vertices(element)))
    }

    fn worst(&self, elements: &[ElementId]) -> Worth {
        Worth::least(elements.iter().map(|e| self.worth[e.index()]))
    }

    /// The least measure around a node.
    fn least(&self, node: NodeId) -> f64 {
        self.worst(self.topology.elements_around(node)).measure
    }

    /// Visits every poor node once, the worst first, and says how many were moved.
    fn sweep(&mut self, target: f64, floor: Worth) -> usize {
        let poor = self.topology.elements().filter(|e| self.worth[e.index()].measure < target);
        let mut nodes: Vec<NodeId> = poor
            .flat_map(|e| self.topology.tet(e))
            .filter(|n| self.standing[n.index()] == Standing::Free)
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut queue: Vec<(f64, NodeId)> = nodes.into_iter().map(|n| (self.least(n), n)).collect();
        queue.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        queue.into_iter().filter(|&(_, node)| self.least(node) < target && self.visit(node, floor)).count()
    }

    /// Moves a node to a better place; whether there was one.
    fn visit(&mut self, node: NodeId, floor: Worth) -> bool {
        let around = self.topology.elements_around(node);
        let i = node.index();
        let corner = |&e: &ElementId| {
            let local = self.topology.tet(e).iter().position(|&n| n == node)?;
            Some(Corner { vertices: self.vertices(e), local, ideal: self.ideal(e) })
        };
        let star = around.iter().map(corner).collect::<Option<_>>().and_then(|c| Star::new(self.given[i], c));
        let found = star.and_then(|star| {
            let u = star.improve(self.displacement[i], floor)?;
            Some((u, star.worth(u)))
        });
        let Some((u, worth)) = found else {
            self.standing[i] = Standing::Settled;
            return false;
        };
        self.displacement[i] = u;
        self.points[i] = std::array::from_fn(|d| self.given[i][d] + u[d]);
        for (&e, worth) in around.iter().zip(worth) {
            self.worth[e.index()] = worth;
            for n in self.topology.tet(e) {
                let standing = &mut self.standing[n.index()];
                if *standing == Standing::Settled {
                    *standing = Standing::Free;
                }
            }
        }
        true
    }
}

/// Free are the nodes with all elements in the body and in one region, on no face between regions or outside and on no
/// named surface.
fn standing(topology: &Topology, elements: &[ElementId]) -> Vec<Standing> {
    let mut inside = vec![false; topology.tets().len()];
    for e in elements {
        inside[e.index()] = true;
    }
    let region_of = topology.region_of();
    let within = |node: NodeId| {
        let around = topology.elements_around(node);
        let same = |e: &ElementId| inside[e.index()] && region_of[e.index()] == region_of[around[0].index()];
        !around.is_empty() && around.iter().all(same)
    };
    let mut standing: Vec<Standing> =
        topology.nodes().map(|n| if within(n) { Standing::Free } else { Standing::Held }).collect();
    let surfaces = topology.surface_names().filter_map(|name| topology.surface(name).ok()).flatten();
    for n in topology.facets().iter().map(|f| &f.nodes).chain(surfaces).flatten() {
        standing[n.index()] = Standing::Held;
    }
    standing
}

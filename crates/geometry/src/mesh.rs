//! A topology with coordinates: the only thing that moves.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::box_tree::AxisBox;
use crate::error::MeshError;
use crate::ids::{ElementId, NodeId};
use crate::tet4::{self, Point};
use crate::topology::Topology;

/// A valid tetrahedral mesh: finite coordinates, every volume positive.
#[derive(Clone, Debug)]
pub struct Mesh {
    topology: Arc<Topology>,
    points: Vec<Point>,
}

impl Mesh {
    /// A mesh of `points` [m], one per node.
    ///
    /// # Errors
    /// [`MeshError::PointCount`], [`MeshError::NotFinite`] (first node), [`MeshError::Inverted`] (worst element).
    #[expect(clippy::disallowed_methods, reason = "numbers of elements tell equal volumes apart")]
    pub fn new(topology: Arc<Topology>, points: Vec<Point>) -> Result<Self, MeshError> {
        if points.len() != topology.node_count() {
            return Err(MeshError::PointCount { points: points.len(), nodes: topology.node_count() });
        }
        if let Some(i) = points.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
            return Err(MeshError::NotFinite { node: NodeId::new(i), point: points[i] });
        }
        let mesh = Self { topology, points };
        let smallest = mesh
            .topology
            .tets()
            .par_iter()
            .enumerate()
            .map(|(e, tet)| (tet4::volume(tet.map(|n| mesh.points[n.index()])), e))
            // Coordinates so large that a product overflows give a volume that is no number: worse than any other.
            .min_by(|a, b| {
                let order = |volume: f64| if volume.is_finite() { volume } else { f64::NEG_INFINITY };
                order(a.0).total_cmp(&order(b.0)).then(a.1.cmp(&b.1))
            });
        match smallest {
            Some((volume, e)) if !(volume > 0.0 && volume.is_finite()) => {
                let element = ElementId::new(e);
                let centroid = tet4::centroid(mesh.vertices(element));
                Err(MeshError::Inverted { element, volume, centroid })
            }
            _ => Ok(mesh),
        }
    }

    /// The same topology with every node moved by `displacement` [m], shape `(n_nodes, 3)`.
    ///
    /// # Errors
    /// As [`Mesh::new`]: a motion that inverts an element yields no mesh.
    pub fn moved(&self, displacement: &[Point]) -> Result<Self, MeshError> {
        if displacement.len() != self.points.len() {
            return Err(MeshError::PointCount { points: displacement.len(), nodes: self.points.len() });
        }
        let points = self
            .points
            .iter()
            .zip(displacement)
            .map(|(x, u)| [x[0] + u[0], x[1] + u[1], x[2] + u[2]])
            .collect();
        Self::new(Arc::clone(&self.topology), points)
    }

    /// Connectivity, regions and surfaces.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// Coordinates [m], shape `(n_nodes, 3)`.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Coordinates of one node [m].
    #[inline]
    pub fn point(&self, node: NodeId) -> Point {
        self.points[node.index()]
    }

    /// The four vertices of an element [m].
    #[inline]
    pub fn vertices(&self, element: ElementId) -> [Point; 4] {
        self.topology.tet(element).map(|n| self.points[n.index()])
    }

    /// Smallest and largest coordinate in each direction [m].
    pub fn bounding_box(&self) -> [Point; 2] {
        let AxisBox { lower, upper } = AxisBox::around(&self.points);
        [lower, upper]
    }

    /// The node of another mesh at the place of each node of this one, to the bit; `None` where it has none. Of as many nodes it is the
    /// same one.
    pub fn nodes_in(&self, other: &Self) -> Vec<Option<NodeId>> {
        if self.points.len() == other.points.len() {
            return other.topology.nodes().map(Some).collect();
        }
        let key = |point: Point| point.map(f64::to_bits);
        let there: BTreeMap<_, NodeId> =
            other.topology.nodes().map(|node| (key(other.point(node)), node)).collect();
        self.points.iter().map(|&point| there.get(&key(point)).copied()).collect()
    }

    /// The mesh without one region, and the faces that its removal exposed (see [`Topology::without_region`]).
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn without_region(&self, region: crate::RegionId) -> Result<(Self, Vec<[NodeId; 3]>), MeshError> {
        let left = self.topology.without_region(region)?;
        let points = left.old_of.iter().map(|n| self.point(*n)).collect();
        Ok((Self::new(Arc::new(left.topology), points)?, left.exposed))
    }
}

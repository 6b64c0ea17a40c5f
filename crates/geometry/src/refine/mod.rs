//! Finer meshes of the same bodies: every element of any tetrahedral mesh, or those that are marked.
//!
//! A new node lies in the middle of an edge, so that the bodies stay what they are to the last bit: curved surfaces keep their
//! facets. Regions, named surfaces and given cells are inherited; of a region without given cells, every new element is
//! one. Old nodes keep their numbers, and the parents of the new ones carry fields and displacements over
//! ([`Refinement::prolong`]).
//!
//! `uniform` halves every edge, `marked` bisects one tetrahedron, `bisection` a mesh until it conforms, `inherit` makes the new
//! topology. Does not live here: which elements are worth refining.

mod bisection;
mod inherit;
mod marked;
mod uniform;

pub use bisection::Bisection;
pub use uniform::uniform;

use crate::ids::{ElementId, NodeId};
use crate::mesh::Mesh;
use crate::tet4::Point;

/// How far a mesh may be refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefineLimits {
    /// Most elements of the finer mesh.
    pub most_tets: usize,
    /// Most bisections behind one another. Default 60: an edge is then a millionth of what it was.
    pub most_levels: u16,
}

impl Default for RefineLimits {
    /// As many elements as their faces can be numbered in 32 bits.
    fn default() -> Self {
        Self { most_tets: u32::MAX as usize / 4, most_levels: 60 }
    }
}

/// A finer mesh, and where its nodes and elements come from.
#[derive(Clone, Debug)]
pub struct Refinement {
    mesh: Mesh,
    parents: Vec<[NodeId; 2]>,
    ancestors: Vec<ElementId>,
}

impl Refinement {
    /// A mesh as it is.
    pub fn none(mesh: Mesh) -> Self {
        let ancestors = mesh.topology().elements().collect();
        Self { mesh, parents: Vec::new(), ancestors }
    }

    /// The finer mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Of every node that the coarse mesh does not have, the two in whose middle it lies; both have lower numbers.
    pub fn parents(&self) -> &[[NodeId; 2]] {
        &self.parents
    }

    /// The element of the coarse mesh that each element lies in.
    pub fn ancestors(&self) -> &[ElementId] {
        &self.ancestors
    }

    /// Values at the nodes of the finer mesh from those at the coarse one's: linear in every coarse element, shape
    /// `(n_nodes, 3)`.
    ///
    /// # Panics
    /// If there is not one value for every node of the coarse mesh.
    pub fn prolong(&self, coarse: &[Point]) -> Vec<Point> {
        assert_eq!(coarse.len() + self.parents.len(), self.mesh.points().len(), "one value a coarse node");
        let mut values = coarse.to_vec();
        values.reserve(self.parents.len());
        for &[a, b] in &self.parents {
            values.push(middle(values[a.index()], values[b.index()]));
        }
        values
    }

    /// This refinement and another one of its mesh as one.
    ///
    /// # Panics
    /// If `next` is not a refinement of this mesh.
    #[must_use]
    pub fn then(mut self, next: Self) -> Self {
        assert_eq!(self.mesh.points().len() + next.parents.len(), next.mesh.points().len(), "of this mesh");
        self.parents.extend(next.parents);
        let ancestors = next.ancestors.iter().map(|e| self.ancestors[e.index()]).collect();
        Self { mesh: next.mesh, parents: self.parents, ancestors }
    }
}

/// The middle of two points.
fn middle(a: Point, b: Point) -> Point {
    std::array::from_fn(|d| 0.5 * (a[d] + b[d]))
}

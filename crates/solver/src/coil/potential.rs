//! The scalar problem on a coil region: `∫(u − ∇φ)·∇q = 0` for a field `u` constant on each element.
//!
//! Linear elements; `φ` is given on some nodes (the terminals, or one node of a closed ring) and `q` runs over the
//! others. The matrix `V g_a·g_b` is symmetric positive definite and factored once.

use fluxmorph_geometry::fem::{
    BlockPattern, Coupling, CsrMatrix, DofMap, ElementGroup, Ldlt, LdltAnalysis, LocalMatrix, ordering,
};
use fluxmorph_geometry::tet4::{Point, Tet4, dot, sub};
use fluxmorph_geometry::{MeshError, NodeId};

use super::patch::Patch;

/// The element matrix `∫∇N_a·∇N_b`.
struct Laplace<'a>(&'a Tet4);

impl LocalMatrix<f64, 4, 1> for Laplace<'_> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[f64; 1]; 1] {
        [[self.0.volume * dot(self.0.gradients[a], self.0.gradients[b])]]
    }
}

/// The factored problem.
#[derive(Debug)]
pub(super) struct Potential<'a> {
    patch: &'a Patch,
    dofs: DofMap<1>,
    /// `None` where every node is given.
    factor: Option<Ldlt<f64>>,
}

impl<'a> Potential<'a> {
    /// The problem with `φ` given on the local nodes where `given` holds; at least one in every part.
    pub(super) fn new(patch: &'a Patch, given: &[bool]) -> Result<Self, MeshError> {
        let node_count = patch.points.len();
        let dofs = DofMap::<1>::new(node_count, |n, _| !given[n.index()]);
        let couplings = vec![Coupling::full(1); patch.connectivity.len()];
        let group = ElementGroup::new(node_count, patch.connectivity.clone(), couplings);
        let pattern = BlockPattern::rectangular(&dofs, &dofs, &group);
        let mut matrix = CsrMatrix::zeros(pattern.structure());
        pattern.assemble(&pattern.bind(&group), &mut matrix.values, |e| Laplace(&patch.tets[e.index()]));
        let factor = match dofs.count() {
            0 => None,
            _ => {
                let order = ordering::dissection(pattern.structure());
                let analysis = LdltAnalysis::new(pattern.structure(), order)?;
                Some(Ldlt::positive_definite(&analysis, |_, k| matrix.values[k])?)
            }
        };
        Ok(Self { patch, dofs, factor })
    }

    /// `∫u·∇q` for every free node.
    pub(super) fn residual(&self, field: &[Point]) -> Vec<f64> {
        let mut load = vec![0.0; self.dofs.count()];
        for ((nodes, tet), u) in self.patch.connectivity.iter().zip(&self.patch.tets).zip(field) {
            for (n, g) in nodes.iter().zip(&tet.gradients) {
                self.dofs.scatter_add(&mut load, *n, [tet.volume * dot(*u, *g)]);
            }
        }
        load
    }

    /// `φ` at the nodes; `given` holds its values at the nodes that are given, and zero elsewhere.
    pub(super) fn solve(&self, field: &[Point], given: &[f64]) -> Vec<f64> {
        let lift = self.patch.gradient(given);
        let rest: Vec<Point> = field.iter().zip(&lift).map(|(u, l)| sub(*u, *l)).collect();
        let mut solution = self.residual(&rest);
        if let Some(factor) = &self.factor {
            factor.solve_in_place(&mut solution);
        }
        (0..given.len()).map(|i| given[i] + self.dofs.gather(&solution, NodeId::new(i))[0]).collect()
    }
}

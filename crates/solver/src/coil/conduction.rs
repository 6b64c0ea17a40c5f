//! Conduction at 0 Hz to second order: what functions of the edges take off the energy of a linear potential.
//!
//! The energy `g = ∫|∇χ|²` of a discrete potential is never below the true one, and the resistance `1/(σg)` never above. Beside
//! the inner corners of a bend, where the current density has no bound, linear functions are percents off. With `4λ_aλ_b` of all
//! edges beside them (hierarchical functions: Zienkiewicz, Gago, Kelly, Computers & Structures 16 (1983) 53) the correction `δ`
//! of the potential is `∫∇δ·∇q = −∫∇χ·∇q`, and `g` falls by `∫|∇δ|²`.
//!
//! Does not live here: the linear potential itself, which is in [`super::solid`], and the current, which is that of it alone.

use fluxmorph_geometry::fem::{
    BlockPattern, Coupling, CsrMatrix, DofMap, ElementGroup, IterationStatus, LocalMatrix,
    conjugate_gradients,
};
use fluxmorph_geometry::tet4::{EDGES, Point, Tet4, add, dot};
use fluxmorph_geometry::topology::{edge_key, triangle_edges};
use fluxmorph_geometry::{CarrierId, ElementId, Mesh, NodeId};

use super::region::TerminalFace;
use crate::error::{NonConvergence, SolverError};

/// Relative residual to which the correction is found: its energy is exact to the square of that.
const TOLERANCE: f64 = 1e-8;

/// Most iterations: conductors a thousand elements long take some thousands.
const MOST_ITERATIONS: usize = 50_000;

/// Functions of an element: four of vertices and six of edges.
const FUNCTIONS: usize = 10;

/// The element matrix `∫∇φ_i·∇φ_j` [m] of vertex functions `λ_a` and edge functions `4λ_aλ_b`.
struct Stiffness(Tet4);

impl Stiffness {
    /// `∫∇φ_i·u` [m] for a constant `u` [1/m].
    fn against(&self, function: usize, u: Point) -> f64 {
        let Self(Tet4 { gradients: g, volume, .. }) = self;
        let mean = match edge(function) {
            None => g[function],
            // ∫4λ_a = V.
            Some([a, b]) => add(g[a], g[b]),
        };
        volume * dot(mean, u)
    }
}

/// The vertices of the edge of a function, by their places in the element; `None` for one of a vertex.
fn edge(function: usize) -> Option<[usize; 2]> {
    Some(EDGES[function.checked_sub(4)?])
}

impl LocalMatrix<f64, FUNCTIONS, 1> for Stiffness {
    #[inline]
    fn block(&self, i: usize, j: usize) -> [[f64; 1]; 1] {
        let Self(Tet4 { gradients: g, volume, .. }) = self;
        let entry = match (edge(i), edge(j)) {
            (None, _) => self.against(j, g[i]),
            (_, None) => self.against(i, g[j]),
            (Some(of_i), Some(of_j)) => {
                // ∫λ_aλ_b = V/20, of one vertex twice that.
                let term = |k: usize, l: usize| {
                    let weight = if of_i[k] == of_j[l] { 2.0 } else { 1.0 };
                    weight * dot(g[of_i[1 - k]], g[of_j[1 - l]])
                };
                0.8 * volume * (term(0, 0) + term(0, 1) + term(1, 0) + term(1, 1))
            }
        };
        [[entry]]
    }
}

/// The vertices and edges of elements as carriers, from 0.
struct Carriers {
    nodes: Vec<NodeId>,
    edges: Vec<[NodeId; 2]>,
}

impl Carriers {
    fn of(mesh: &Mesh, elements: &[(ElementId, [f64; 4])]) -> Self {
        let tets = || elements.iter().map(|(e, _)| mesh.topology().tet(*e));
        let mut nodes: Vec<NodeId> = tets().flatten().collect();
        let mut edges: Vec<[NodeId; 2]> =
            tets().flat_map(|tet| EDGES.map(|ends| ends_of(tet, ends))).collect();
        nodes.sort_unstable();
        nodes.dedup();
        edges.sort_unstable();
        edges.dedup();
        Self { nodes, edges }
    }

    fn count(&self) -> usize {
        self.nodes.len() + self.edges.len()
    }

    /// Those of the functions of an element.
    fn of_tet(&self, tet: [NodeId; 4]) -> [CarrierId; FUNCTIONS] {
        std::array::from_fn(|function| {
            let place = match edge(function) {
                None => self.nodes.binary_search(&tet[function]).ok(),
                Some(ends) => {
                    self.edges.binary_search(&ends_of(tet, ends)).ok().map(|edge| self.nodes.len() + edge)
                }
            };
            CarrierId::new(place.expect("it was collected of all elements"))
        })
    }

    /// Whether the potential is given there: on the faces of terminals; of a ring, which has none, at one node.
    fn given(&self, terminals: &[TerminalFace]) -> Vec<bool> {
        let mut given = vec![false; self.count()];
        given[0] = terminals.is_empty();
        for face in terminals {
            for node in face.nodes {
                self.nodes.binary_search(&node).into_iter().for_each(|place| given[place] = true);
            }
            for ends in triangle_edges(face.nodes) {
                let place = self.edges.binary_search(&ends);
                place.into_iter().for_each(|edge| given[self.nodes.len() + edge] = true);
            }
        }
        given
    }
}

/// The ends of an edge of an element, as a key.
fn ends_of(tet: [NodeId; 4], ends: [usize; 2]) -> [NodeId; 2] {
    edge_key(ends.map(|place| tet[place]))
}

/// What second order takes off `∫|∇χ|²` [m] of every segment; `potential` is χ at the vertices of every element, of which each has
/// its segment.
///
/// # Errors
/// [`SolverError::NotConverged`] where the correction is not found.
pub(super) fn decrease(
    mesh: &Mesh,
    potential: &[(ElementId, [f64; 4])],
    segments: &[usize],
    terminals: &[TerminalFace],
) -> Result<Vec<f64>, SolverError> {
    let carriers = Carriers::of(mesh, potential);
    let connectivity: Vec<_> =
        potential.iter().map(|(e, _)| carriers.of_tet(mesh.topology().tet(*e))).collect();
    let given = carriers.given(terminals);
    let dofs = DofMap::<1>::new(carriers.count(), |carrier, _| !given[carrier.index()]);
    let stiffness = |place: usize| Stiffness(Tet4::new(mesh.vertices(potential[place].0)));
    let couplings = vec![Coupling::full(1); connectivity.len()];
    let group = ElementGroup::new(carriers.count(), connectivity.clone(), couplings);
    let pattern = BlockPattern::rectangular(&dofs, &dofs, &group);
    let mut matrix = CsrMatrix::zeros(pattern.structure());
    pattern.assemble(&pattern.bind(&group), &mut matrix.values, |e| stiffness(e.index()));
    // ∫∇χ·∇φ of the functions of every element.
    let loads: Vec<[f64; FUNCTIONS]> = (0..potential.len())
        .map(|place| {
            let (own, chi) = (stiffness(place), potential[place].1);
            let gradient = std::array::from_fn(|d| (0..4).map(|a| chi[a] * own.0.gradients[a][d]).sum());
            std::array::from_fn(|function| own.against(function, gradient))
        })
        .collect();
    let mut load_of_all = vec![0.0; dofs.count()];
    for (carriers, load) in connectivity.iter().zip(&loads) {
        for (carrier, load) in carriers.iter().zip(load) {
            dofs.scatter_add(&mut load_of_all, *carrier, [*load]);
        }
    }
    let diagonal: Vec<f64> = (0..dofs.count()).map(|row| matrix.entry(row, row).unwrap_or(1.0)).collect();
    let scaled = |r: &[f64], z: &mut [f64]| (0..r.len()).for_each(|row| z[row] = r[row] / diagonal[row]);
    let (correction, report) = conjugate_gradients(&matrix, scaled, &load_of_all, TOLERANCE, MOST_ITERATIONS);
    if report.status == IterationStatus::Stopped {
        let (residual, iterations) = (report.residual, report.iterations);
        let cause = NonConvergence::IllConditioned;
        return Err(SolverError::NotConverged { residual, required: TOLERANCE, iterations, cause });
    }
    let mut taken = vec![0.0; segments.iter().max().map_or(0, |last| last + 1)];
    for ((carriers, load), segment) in connectivity.iter().zip(&loads).zip(segments) {
        taken[*segment] +=
            carriers.iter().zip(load).map(|(c, load)| load * dofs.gather(&correction, *c)[0]).sum::<f64>();
    }
    Ok(taken)
}

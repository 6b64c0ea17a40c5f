//! Laws by which the mesh is one function of the design: all other nodes come to rest where an energy is least.

use std::sync::Arc;

use fluxmorph_geometry::fem::LocalMatrix;
use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{Point, Tet4, add, dot};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use rayon::prelude::*;

use crate::deform::ElasticMap;
use crate::elasticity::Tensor;
use crate::error::RemeshError;
use crate::neo_hooke::Deformation;

/// Share of the predicted decrease of the energy that a step has to reach (Armijo).
const SUFFICIENT: f64 = 1e-4;

/// Shortest step of the line search.
const SHORTEST: f64 = 1e-6;

/// A law of motion on the undeformed mesh.
pub(crate) trait EnergyLaw: std::fmt::Debug + Send + Sync {
    /// The tangent at rest.
    fn rest(&self) -> &Arc<ElasticMap>;

    /// Where the nodes come to rest for displacements of the design nodes [m], shape `(n_design, 3)`; whether or not that leaves a
    /// valid mesh. A function of the design alone, with the same bits after any history and for any number of threads.
    ///
    /// # Errors
    /// [`RemeshError::NotSettled`], [`RemeshError::NotFinite`], [`fluxmorph_geometry::MeshError::Factorisation`].
    fn equilibrium(&self, design: &[Point]) -> Result<Equilibrium, RemeshError>;

    /// Where the nodes come to rest for displacements near those of another equilibrium: sooner, and where there are several
    /// equilibria perhaps at another one. Gives up early.
    ///
    /// # Errors
    /// As [`EnergyLaw::equilibrium`].
    fn near(&self, _other: &Equilibrium, design: &[Point]) -> Result<Equilibrium, RemeshError> {
        self.equilibrium(design)
    }

    /// Whether the energy is convex.
    fn has_one_equilibrium(&self) -> bool {
        true
    }

    /// The elements of the body, by their position in it.
    fn elements(&self) -> &[Element];

    /// `J` of every element of the body, the ratio of its volumes after and before, for displacements of all nodes [m], shape
    /// `(n_nodes, 3)`.
    fn stretches(&self, displacement: &[Point]) -> Vec<f64> {
        self.elements().par_iter().map(|element| element.deformation(displacement).volume).collect()
    }

    /// `Σ_e s_e ∂J_e/∂x` at every node, shape `(n_nodes, 3)`, of shares `s_e` by the position of the element.
    fn stretch_derivative(&self, displacement: &[Point], shares: &[f64]) -> Vec<Point> {
        let scaled = |(element, share): (&Element, &f64)| {
            element.deformation(displacement).cofactor().map(|row| row.map(|c| share * c))
        };
        let tensors: Vec<Tensor> = self.elements().par_iter().zip(shares).map(scaled).collect();
        gathered(self.elements(), &tensors, |_| 1.0, displacement.len())
    }
}

/// `Σ_e s_e T_e ∇N_a` at every node `a`.
pub(crate) fn gathered(
    elements: &[Element],
    tensors: &[Tensor],
    share: impl Fn(&Element) -> f64,
    nodes: usize,
) -> Vec<Point> {
    let mut nodal = vec![[0.0; 3]; nodes];
    for (element, tensor) in elements.iter().zip(tensors) {
        let share = share(element);
        for (node, gradient) in element.nodes.iter().zip(&element.gradients) {
            let own = tensor.map(|row| share * dot(row, *gradient));
            nodal[node.index()] = add(nodal[node.index()], own);
        }
    }
    nodal
}

/// Where the nodes of a design come to rest.
#[derive(Clone, Debug)]
pub(crate) struct Equilibrium {
    /// Displacement of every node from the undeformed mesh [m], shape `(n_nodes, 3)`.
    pub(crate) displacement: Vec<Point>,
    /// Least stretch of an element, and the element.
    pub(crate) least: (f64, ElementId),
    /// The derivative of the displacements by those of the design nodes.
    pub(crate) tangent: Arc<ElasticMap>,
    /// Newton steps taken.
    pub(crate) steps: usize,
}

impl Equilibrium {
    pub(crate) fn new(
        law: &impl EnergyLaw,
        displacement: Vec<Point>,
        tangent: Arc<ElasticMap>,
        steps: usize,
    ) -> Self {
        let stretches = law.stretches(&displacement).into_iter();
        let least = stretches.zip(law.rest().elements().iter().copied());
        let least = least.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a body has elements");
        Self { displacement, least, tangent, steps }
    }
}

/// An element of the body, undeformed.
#[derive(Debug)]
pub(crate) struct Element {
    pub(crate) nodes: [NodeId; 4],
    /// `∇N_a` [1/m].
    pub(crate) gradients: [Point; 4],
    /// Volume times the modulus, over the mean modulus [m³].
    pub(crate) weight: f64,
}

impl Element {
    /// `Σ_a u_a ⊗ ∇N_a`, constant on the element.
    pub(crate) fn displacement_gradient(&self, u: &[Point]) -> Tensor {
        let [a, b, c, d] = self.nodes.map(|node| u[node.index()]);
        let g = &self.gradients;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| a[i] * g[0][j] + b[i] * g[1][j] + c[i] * g[2][j] + d[i] * g[3][j])
        })
    }

    /// How displacements of all nodes [m] deform the element.
    pub(crate) fn deformation(&self, u: &[Point]) -> Deformation {
        let mut gradient = self.displacement_gradient(u);
        (0..3).for_each(|i| gradient[i][i] += 1.0);
        Deformation::new(gradient)
    }

    /// The elements of the body of a map on the undeformed mesh, weighted along an axis, or alike in all directions.
    pub(crate) fn of_body(mesh: &Mesh, map: &ElasticMap, axis: Option<usize>) -> Vec<Self> {
        let weights = map.weights(mesh, axis);
        // Of order one: a matrix in numbers of its own size.
        let mean = ordered_sum(weights.len(), |i| weights[i]) / weights.len().max(1) as f64;
        let element = |(&e, weight): (&ElementId, f64)| {
            let tet = Tet4::new(mesh.vertices(e));
            let weight = weight / mean * tet.volume;
            Self { nodes: mesh.topology().tet(e), gradients: tet.gradients, weight }
        };
        map.elements().iter().zip(weights).map(element).collect()
    }
}

/// One number a pair of nodes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalars(pub(crate) [[f64; 4]; 4]);

impl LocalMatrix<f64, 4, 3> for Scalars {
    fn block(&self, a: usize, b: usize) -> [[f64; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { self.0[a][b] } else { 0.0 }))
    }

    fn scalars(&self) -> Option<[[f64; 4]; 4]> {
        Some(self.0)
    }
}

/// The share of a Newton step, of 1, ½, ¼ …, that decreases the energy enough: `energy` of a share, `slope` its derivative at none.
pub(crate) fn line_search(energy: impl Fn(f64) -> f64, slope: f64) -> f64 {
    let before = energy(0.0);
    let mut share = 1.0;
    while share > SHORTEST && energy(share) > before + SUFFICIENT * share * slope {
        share *= 0.5;
    }
    share
}

//! Motion along one axis: the minimiser of a convex energy, which is one function of the design.
//!
//! Every node moves along the axis `d` by `u`, and the stretch of an element `J_e = 1 + ∂_d u_e` is *linear* in the
//! displacements. So
//!
//! `E(u) = Σ_e w_e [ψ(J_e) + ½ ε |∇_⊥ u|²]`,
//!
//! with `ψ` of [`crate::barrier`] and weights `w_e` that follow the element's size, is strictly convex: it has one minimiser for
//! given displacements of the design nodes, whatever the mesh before it, and squeezed elements push back. Newton's method with
//! `H = Σ w_e [ψ''(J_e) ∂_d N ∂_d Nᵀ + ε ∇_⊥ N·∇_⊥ N]`, symmetric positive definite with the pattern of a scalar Laplacian, starts
//! at the linear solution of a mesh at rest, a function of the design too: the same design gives the same bits. At the
//! minimiser `H` is the tangent of the map from design to mesh: an [`ElasticMap`] whose transpose gives exact gradients.

use std::sync::Arc;

use fluxmorph_geometry::fem::LocalMatrix;
use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{Point, Tet4, dot};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::barrier::{KNEE, density};
use crate::deform::ElasticMap;
use crate::error::RemeshError;

/// `ε`: what neighbouring columns hold one another by. Measured on the optimum of configs/shield.toml, against what two skin
/// layers keep of their thickness: 0.01 leaves steps between inner layers that cost accuracy (F/F₀ 0.515; 0.84 and 0.74), at 1
/// thick columns pull thin ones along (0.510; 0.78 and 0.69); in between both are right (0.511; 0.80 and 0.71).
const SIDEWAYS: f64 = 0.6;

/// Newton steps at most: 4 to 12 on all measured motions (docs/torture.md), so that more is a fault.
const MAX_STEPS: usize = 100;

/// Relative change of the stretch of every element, in a full step, below which that step is the last: convergence is quadratic,
/// so that what is left after it is rounding.
const SETTLED: f64 = 1e-8;

/// Relative change below which a full step is taken unseen: Newton's method contracts there for a self-concordant energy.
const CLOSE: f64 = 0.25;

/// Share of the predicted decrease of the energy that a step has to reach (Armijo).
const SUFFICIENT: f64 = 1e-4;

/// Shortest step of the line search.
const SHORTEST: f64 = 1e-6;

/// The law of motion along one axis on the undeformed mesh.
#[derive(Debug)]
pub(crate) struct Rails {
    axis: usize,
    elements: Vec<Element>,
    /// The tangent at rest.
    rest: Arc<ElasticMap>,
}

/// An element of the body, undeformed.
#[derive(Debug)]
struct Element {
    nodes: [NodeId; 4],
    /// `∇N_a` [1/m].
    gradients: [Point; 4],
    weight: f64,
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
}

/// One number a pair of nodes.
struct Scalars([[f64; 4]; 4]);

impl LocalMatrix<f64, 4, 3> for Scalars {
    fn block(&self, a: usize, b: usize) -> [[f64; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { self.0[a][b] } else { 0.0 }))
    }

    fn scalars(&self) -> Option<[[f64; 4]; 4]> {
        Some(self.0)
    }
}

impl Element {
    fn values(&self, u: &[f64]) -> [f64; 4] {
        self.nodes.map(|n| u[n.index()])
    }

    /// `∇u`, constant on the element.
    fn gradient(&self, u: &[f64]) -> Point {
        let values = self.values(u);
        std::array::from_fn(|d| (0..4).map(|a| values[a] * self.gradients[a][d]).sum())
    }

    /// `w [ψ'' ∂_d N ∂_d Nᵀ + ε ∇_⊥ N·∇_⊥ N]` for a curvature `ψ''`.
    fn tangent(&self, axis: usize, curvature: f64) -> Scalars {
        let entry = |a: usize, b: usize| {
            let (ga, gb) = (self.gradients[a], self.gradients[b]);
            let along = ga[axis] * gb[axis];
            self.weight * (curvature * along + SIDEWAYS * (dot(ga, gb) - along))
        };
        Scalars(std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b))))
    }
}

impl Rails {
    /// The law on the undeformed mesh of a map whose nodes move along `axis` only; it takes body, boundaries and weights from it.
    ///
    /// # Errors
    /// As [`ElasticMap::new`].
    pub(crate) fn new(mesh: &Mesh, map: &ElasticMap, axis: usize) -> Result<Self, RemeshError> {
        let element = |&e: &ElementId, weight: f64| {
            let tet = Tet4::new(mesh.vertices(e));
            Element { nodes: mesh.topology().tet(e), gradients: tet.gradients, weight: weight * tet.volume }
        };
        let weights = map.weights(mesh, axis);
        // Of order one: a matrix in numbers of its own size.
        let mean = ordered_sum(weights.len(), |i| weights[i]) / weights.len().max(1) as f64;
        let elements: Vec<Element> =
            map.elements().iter().zip(weights).map(|(e, weight)| element(e, weight / mean)).collect();
        let curvature = density(1.0).curvature;
        let rest = map.with_stiffness(|position| elements[position].tangent(axis, curvature))?;
        Ok(Self { axis, elements, rest: Arc::new(rest) })
    }

    /// The tangent at rest.
    pub(crate) fn rest(&self) -> &Arc<ElasticMap> {
        &self.rest
    }

    /// The displacements at which the energy is least for those of the design nodes [m], shape `(n_design, 3)`; whether or not
    /// they leave a valid mesh.
    ///
    /// # Errors
    /// [`RemeshError::NotSettled`], [`RemeshError::NotFinite`], [`fluxmorph_geometry::MeshError::Factorisation`].
    pub(crate) fn equilibrium(&self, design: &[Point]) -> Result<Equilibrium, RemeshError> {
        let mut u: Vec<f64> = self.rest.linear(design)?.iter().map(|u| u[self.axis]).collect();
        for _ in 0..MAX_STEPS {
            let stretches = self.stretches(&u);
            let curvatures: Vec<f64> = stretches.iter().map(|&j| density(j).curvature).collect();
            let tangent = self.rest.with_stiffness(|position| {
                self.elements[position].tangent(self.axis, curvatures[position])
            })?;
            let residual = self.residual(&u, &stretches);
            let step = tangent.solve_along(residual.iter().map(|r| -r).collect(), self.axis)?;
            let change = self.largest_change(&step, &stretches);
            let share = if change <= CLOSE { 1.0 } else { self.line_search(&u, &step, &residual) };
            u.iter_mut().zip(&step).for_each(|(u, step)| *u += share * step);
            if change <= SETTLED {
                return Ok(self.at_rest(&u, design, Arc::new(tangent)));
            }
        }
        Err(RemeshError::NotSettled { steps: MAX_STEPS })
    }

    fn at_rest(&self, u: &[f64], design: &[Point], tangent: Arc<ElasticMap>) -> Equilibrium {
        let stretches = self.stretches(u);
        let least = stretches.iter().copied().zip(self.rest.elements().iter().copied());
        let least = least.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a body has elements");
        let mut displacement = vec![[0.0; 3]; u.len()];
        displacement.iter_mut().zip(u).for_each(|(point, u)| point[self.axis] = *u);
        for (node, own) in self.rest.design_nodes().iter().zip(design) {
            displacement[node.index()] = *own;
        }
        Equilibrium { displacement, least, tangent }
    }

    /// `J` of every element of the body.
    fn stretches(&self, u: &[f64]) -> Vec<f64> {
        self.elements.iter().map(|element| 1.0 + element.gradient(u)[self.axis]).collect()
    }

    /// `J` of every element of the body for displacements of all nodes [m], shape `(n_nodes, 3)`.
    pub(crate) fn stretches_of(&self, displacement: &[Point]) -> Vec<f64> {
        let u: Vec<f64> = displacement.iter().map(|u| u[self.axis]).collect();
        self.stretches(&u)
    }

    /// `Σ_e s_e ∂J_e/∂x` at every node, shape `(n_nodes, 3)`, of shares `s_e` by the position of the element.
    pub(crate) fn stretch_derivative(&self, shares: &[f64], nodes: usize) -> Vec<Point> {
        let mut nodal = vec![[0.0; 3]; nodes];
        for (element, share) in self.elements.iter().zip(shares) {
            for (node, own) in element.nodes.iter().zip(&element.gradients) {
                nodal[node.index()][self.axis] += share * own[self.axis];
            }
        }
        nodal
    }

    fn energy(&self, u: &[f64]) -> f64 {
        ordered_sum(self.elements.len(), |i| {
            let element = &self.elements[i];
            let gradient = element.gradient(u);
            let along = gradient[self.axis];
            let sideways = dot(gradient, gradient) - along * along;
            element.weight * (density(1.0 + along).energy + 0.5 * SIDEWAYS * sideways)
        })
    }

    /// `∂E/∂u` at every node.
    fn residual(&self, u: &[f64], stretches: &[f64]) -> Vec<f64> {
        let mut residual = vec![0.0; u.len()];
        for (element, &stretch) in self.elements.iter().zip(stretches) {
            let gradient = element.gradient(u);
            let slope = density(stretch).slope;
            for (node, own) in element.nodes.iter().zip(&element.gradients) {
                let along = own[self.axis];
                let sideways = dot(*own, gradient) - along * gradient[self.axis];
                residual[node.index()] += element.weight * (slope * along + SIDEWAYS * sideways);
            }
        }
        residual
    }

    /// Largest change of a stretch in a step, relative to the stretch.
    fn largest_change(&self, step: &[f64], stretches: &[f64]) -> f64 {
        let change = |(element, stretch): (&Element, &f64)| {
            element.gradient(step)[self.axis].abs() / stretch.abs().max(KNEE)
        };
        self.elements.iter().zip(stretches).map(change).fold(0.0, f64::max)
    }

    /// The share of a Newton step that decreases the energy enough, of 1, ½, ¼ …
    fn line_search(&self, u: &[f64], step: &[f64], residual: &[f64]) -> f64 {
        let before = self.energy(u);
        let predicted: f64 = step.iter().zip(residual).map(|(s, r)| s * r).sum();
        let mut share = 1.0;
        while share > SHORTEST {
            let moved: Vec<f64> = u.iter().zip(step).map(|(u, s)| u + share * s).collect();
            if self.energy(&moved) <= before + SUFFICIENT * share * predicted {
                break;
            }
            share *= 0.5;
        }
        share
    }
}

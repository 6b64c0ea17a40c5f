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

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{Point, dot};
use rayon::prelude::*;

use crate::barrier::{KNEE, density};
use crate::deform::ElasticMap;
use crate::equilibrium::{Element, EnergyLaw, Equilibrium, Scalars, line_search};
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

/// The law of motion along one axis on the undeformed mesh.
#[derive(Debug)]
pub(crate) struct Rails {
    axis: usize,
    elements: Vec<Element>,
    /// The tangent at rest.
    rest: Arc<ElasticMap>,
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

    /// `∂E/∂u` of its nodes, of this element alone.
    fn forces(&self, u: &[f64], axis: usize, stretch: f64) -> [f64; 4] {
        let gradient = self.gradient(u);
        let slope = density(stretch).slope;
        self.gradients.map(|own| {
            let along = own[axis];
            let sideways = dot(own, gradient) - along * gradient[axis];
            self.weight * (slope * along + SIDEWAYS * sideways)
        })
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
        let elements = Element::of_body(mesh, map, Some(axis));
        let curvature = density(1.0).curvature;
        let rest = map.with_stiffness(|position| elements[position].tangent(axis, curvature))?;
        Ok(Self { axis, elements, rest: Arc::new(rest) })
    }

    /// `J` of every element of the body.
    fn stretches_along(&self, u: &[f64]) -> Vec<f64> {
        self.elements.par_iter().map(|element| 1.0 + element.gradient(u)[self.axis]).collect()
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
        let of = |(element, &stretch): (&Element, &f64)| element.forces(u, self.axis, stretch);
        let forces: Vec<[f64; 4]> = self.elements.par_iter().zip(stretches).map(of).collect();
        let mut residual = vec![0.0; u.len()];
        for (element, forces) in self.elements.iter().zip(forces) {
            for (node, force) in element.nodes.iter().zip(forces) {
                residual[node.index()] += force;
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
}

impl EnergyLaw for Rails {
    fn rest(&self) -> &Arc<ElasticMap> {
        &self.rest
    }

    fn elements(&self) -> &[Element] {
        &self.elements
    }

    fn equilibrium(&self, design: &[Point]) -> Result<Equilibrium, RemeshError> {
        let mut u: Vec<f64> = self.rest.linear(design)?.iter().map(|u| u[self.axis]).collect();
        for steps in 1..=MAX_STEPS {
            let stretches = self.stretches_along(&u);
            let curvatures: Vec<f64> = stretches.par_iter().map(|&j| density(j).curvature).collect();
            let tangent = self.rest.with_stiffness(|position| {
                self.elements[position].tangent(self.axis, curvatures[position])
            })?;
            let residual = self.residual(&u, &stretches);
            let step = tangent.solve_along(residual.iter().map(|r| -r).collect(), self.axis)?;
            let change = self.largest_change(&step, &stretches);
            let moved =
                |share: f64| -> Vec<f64> { u.iter().zip(&step).map(|(u, s)| u + share * s).collect() };
            let share = if change <= CLOSE {
                1.0
            } else {
                let slope = step.iter().zip(&residual).map(|(s, r)| s * r).sum();
                line_search(|share| self.energy(&moved(share)), slope)
            };
            u = moved(share);
            if change <= SETTLED {
                let mut displacement = vec![[0.0; 3]; u.len()];
                displacement.iter_mut().zip(&u).for_each(|(point, u)| point[self.axis] = *u);
                for (node, own) in self.rest.design_nodes().iter().zip(design) {
                    displacement[node.index()] = *own;
                }
                return Ok(Equilibrium::new(self, displacement, Arc::new(tangent), steps));
            }
        }
        Err(RemeshError::NotSettled { steps: MAX_STEPS })
    }

    fn stretches(&self, displacement: &[Point]) -> Vec<f64> {
        let u: Vec<f64> = displacement.iter().map(|u| u[self.axis]).collect();
        self.stretches_along(&u)
    }

    fn stretch_derivative(&self, displacement: &[Point], shares: &[f64]) -> Vec<Point> {
        let mut nodal = vec![[0.0; 3]; displacement.len()];
        for (element, share) in self.elements.iter().zip(shares) {
            for (node, own) in element.nodes.iter().zip(&element.gradients) {
                nodal[node.index()][self.axis] += share * own[self.axis];
            }
        }
        nodal
    }
}

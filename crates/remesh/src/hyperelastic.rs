//! Motion in all directions: the minimiser of a hyperelastic energy on the undeformed mesh.
//!
//! `E(u) = Σ_e w_e ψ(F_e)` with `F_e = 1 + ∇u_e` and `ψ` of [`crate::neo_hooke`], with weights that follow the element's size. It
//! knows finite rotations, and keeps elements from being squeezed to nothing. It is not convex: Newton's method with a
//! line search starts at the harmonic map of the displacements, a function of the design alone, so that the mesh is one too,
//! with the same bits after any history. (Linear elasticity inverts more elements where thin layers turn: twice the steps.) Where
//! the tangent is not positive definite, one of absolute eigenvalues takes its place. What does not come to rest so, or ends
//! with inverted elements, is approached in parts of the displacements from the mesh at rest.
//! At the minimiser the exact tangent is the derivative of the mesh by the design: an [`ElasticMap`].

use std::sync::Arc;

use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{Point, add, dot, sub};
use fluxmorph_geometry::{Mesh, MeshError};
use rayon::prelude::*;

use crate::deform::ElasticMap;
use crate::elasticity::{ISOTROPIC, Tensor};
use crate::equilibrium::{Element, EnergyLaw, Equilibrium, Scalars, gathered, line_search};
use crate::error::RemeshError;
use crate::neo_hooke::{Curvature, Deformation, Tangent};

/// Newton steps at most: 4 to 24 on all measured motions that come to rest (docs/torture.md).
const MAX_STEPS: usize = 40;

/// Relative change of the deformation of every element, in a full step, below which that step is the last: convergence is
/// quadratic, so that what is left after it is rounding.
const SETTLED: f64 = 1e-8;

/// Relative change below which a full step is taken unseen: what it gains is soon within the rounding of the energy.
const CLOSE: f64 = 1e-2;

/// Relative change below which the exact tangent is tried again after it was not positive definite.
const NEAR: f64 = 0.25;

/// Newton steps at most from an equilibrium nearby, in the search for what is carried: what takes more lies beyond that, or so near
/// to the limit that little is lost.
const MAX_STEPS_NEARBY: usize = 12;

/// Parts in which displacements are approached that are not reached at once.
const PARTS: usize = 4;

/// The law of motion in all directions on the undeformed mesh.
#[derive(Debug)]
pub(crate) struct Hyperelastic {
    elements: Vec<Element>,
    /// The tangent at rest.
    rest: Arc<ElasticMap>,
    /// Where Newton's method starts: the map of `½ Σ_e w_e |∇u_e|²`.
    harmonic: ElasticMap,
}

impl Hyperelastic {
    /// The law on the undeformed mesh of a map; it takes body, boundaries and weights from it.
    ///
    /// # Errors
    /// As [`ElasticMap::new`].
    pub(crate) fn new(mesh: &Mesh, map: &ElasticMap) -> Result<Self, RemeshError> {
        let elements = Element::of_body(mesh, map, None);
        let rest = Deformation::new(ISOTROPIC);
        let tangent = |position: usize| {
            let Element { gradients, weight, .. } = &elements[position];
            Tangent::new(&rest, gradients, *weight, Curvature::Exact)
        };
        let rest = map.with_stiffness(tangent)?;
        let laplacian = |position: usize| {
            let Element { gradients: g, weight, .. } = &elements[position];
            Scalars(std::array::from_fn(|a| std::array::from_fn(|b| weight * dot(g[a], g[b]))))
        };
        let harmonic = map.with_stiffness(laplacian)?;
        Ok(Self { rest: Arc::new(rest), harmonic, elements })
    }

    fn deformations(&self, u: &[Point]) -> Vec<Deformation> {
        self.elements.par_iter().map(|element| element.deformation(u)).collect()
    }

    fn tangent(&self, deformations: &[Deformation], curvature: Curvature) -> Result<ElasticMap, RemeshError> {
        let of = |(element, deformation): (&Element, &Deformation)| {
            Tangent::new(deformation, &element.gradients, element.weight, curvature)
        };
        let tangents: Vec<Tangent> = self.elements.par_iter().zip(deformations).map(of).collect();
        self.rest.with_stiffness(|position| tangents[position])
    }

    /// The exact tangent where that is asked for and positive definite, else the convex one; which of them.
    fn positive_tangent(
        &self,
        deformations: &[Deformation],
        curvature: Curvature,
    ) -> Result<(ElasticMap, Curvature), RemeshError> {
        match self.tangent(deformations, curvature) {
            Err(RemeshError::Mesh(MeshError::Factorisation { .. })) if curvature == Curvature::Exact => {
                Ok((self.tangent(deformations, Curvature::Convex)?, Curvature::Convex))
            }
            tangent => Ok((tangent?, curvature)),
        }
    }

    fn energy(&self, u: &[Point]) -> f64 {
        ordered_sum(self.elements.len(), |i| {
            self.elements[i].weight * self.elements[i].deformation(u).energy()
        })
    }

    /// `∂E/∂u` at every node.
    fn residual(&self, deformations: &[Deformation], nodes: usize) -> Vec<Point> {
        let stresses: Vec<Tensor> = deformations.par_iter().map(Deformation::stress).collect();
        gathered(&self.elements, &stresses, |element| element.weight, nodes)
    }

    /// Newton's method from displacements that are those of the design at its nodes, in so many steps at most.
    ///
    /// # Errors
    /// [`RemeshError::NotSettled`]; as [`ElasticMap::new`].
    fn settle(&self, mut u: Vec<Point>, most: usize) -> Result<Equilibrium, RemeshError> {
        let mut curvature = None;
        for steps in 1..=most {
            let deformations = self.deformations(&u);
            // Where elements are inverted there is no hope for the exact one.
            let first = || {
                let is_inverted = deformations.iter().any(|own| own.volume <= 0.0);
                if is_inverted { Curvature::Convex } else { Curvature::Exact }
            };
            let curvature_asked = curvature.unwrap_or_else(first);
            let residual = self.residual(&deformations, u.len());
            let (tangent, taken) = self.positive_tangent(&deformations, curvature_asked)?;
            let step = tangent.solve_nodal(residual.iter().map(|r| r.map(|c| -c)).collect())?;
            let relative = |(element, deformation): (&Element, &Deformation)| {
                deformation.relative_change(&element.displacement_gradient(&step))
            };
            let change = self.elements.iter().zip(&deformations).map(relative).fold(0.0, f64::max);
            let moved = |share: f64| -> Vec<Point> {
                u.iter().zip(&step).map(|(u, s)| std::array::from_fn(|d| u[d] + share * s[d])).collect()
            };
            let share = if change <= CLOSE {
                1.0
            } else {
                let slope = ordered_sum(step.len(), |i| dot(step[i], residual[i]));
                line_search(|share| self.energy(&moved(share)), slope)
            };
            u = moved(share);
            if change <= SETTLED && taken == Curvature::Exact {
                return Ok(Equilibrium::new(self, u, Arc::new(tangent), steps));
            }
            curvature = Some(if share * change < NEAR { Curvature::Exact } else { taken });
        }
        Err(RemeshError::NotSettled { steps: most })
    }

    /// Where the tangent of an equilibrium leads for a change of the displacements of the design nodes, to `design`.
    fn further(
        &self,
        from: &Equilibrium,
        change: &[Point],
        design: &[Point],
    ) -> Result<Vec<Point>, RemeshError> {
        let further = from.tangent.linear(change)?;
        let mut start: Vec<Point> =
            from.displacement.iter().zip(further).map(|(u, step)| add(*u, step)).collect();
        for (node, own) in self.rest.design_nodes().iter().zip(design) {
            start[node.index()] = *own;
        }
        Ok(start)
    }

    /// The design in equal parts from the mesh at rest, each from where the tangent of the one before leads.
    ///
    /// # Errors
    /// As [`Hyperelastic::settle`], and [`RemeshError::NotSettled`] where a part ends with inverted elements.
    fn in_parts(&self, design: &[Point]) -> Result<Equilibrium, RemeshError> {
        let change: Vec<Point> = design.iter().map(|u| u.map(|u| u / PARTS as f64)).collect();
        let mut steps = 0;
        let mut reached: Option<Equilibrium> = None;
        for part in 1..=PARTS {
            let share = part as f64 / PARTS as f64;
            let goal: Vec<Point> = design.iter().map(|u| u.map(|u| share * u)).collect();
            let start = match &reached {
                None => self.harmonic.linear(&change)?,
                Some(before) => self.further(before, &change, &goal)?,
            };
            let own = self.settle(start, MAX_STEPS)?;
            steps += own.steps;
            if own.least.0 <= 0.0 {
                return Err(RemeshError::NotSettled { steps });
            }
            reached = Some(own);
        }
        let last = reached.expect("there is a part");
        Ok(Equilibrium { steps, ..last })
    }
}

impl EnergyLaw for Hyperelastic {
    fn rest(&self) -> &Arc<ElasticMap> {
        &self.rest
    }

    fn elements(&self) -> &[Element] {
        &self.elements
    }

    fn equilibrium(&self, design: &[Point]) -> Result<Equilibrium, RemeshError> {
        match self.settle(self.harmonic.linear(design)?, MAX_STEPS) {
            Ok(own) if own.least.0 > 0.0 => Ok(own),
            at_once => self.in_parts(design).or(at_once),
        }
    }

    fn near(&self, other: &Equilibrium, design: &[Point]) -> Result<Equilibrium, RemeshError> {
        let nodes = self.rest.design_nodes();
        let change: Vec<Point> =
            nodes.iter().zip(design).map(|(n, u)| sub(*u, other.displacement[n.index()])).collect();
        self.settle(self.further(other, &change, design)?, MAX_STEPS_NEARBY)
    }

    fn has_one_equilibrium(&self) -> bool {
        false
    }
}

//! What is minimised: a real function of the flux densities, with its derivative for the adjoint problem.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Tet4, cross};
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

use crate::element::Complex3;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldSolution;

/// How observation cells are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// One term per observation cell: `F = Σ_k B_k·B_k*` [T²], the paper's.
    Point,
    /// `F = ∫ B·B* dV` [T² m³].
    Volume,
}

/// `F = Σ_k w_k B_k·B_k*` over the cells of an observation region, `B_k` the volume mean over the cell.
///
/// The cells must not move with the design: the driver refuses an observation region inside the remesh region, so `F`
/// depends on the node positions through the field alone.
#[derive(Clone, Debug)]
pub struct Objective {
    cells: Vec<Vec<ElementId>>,
    weighting: Weighting,
}

/// Value of an objective, and what the adjoint problem needs.
#[derive(Clone, Debug)]
pub struct ObjectiveValue {
    /// `F`.
    pub value: f64,
    /// `∂F/∂u` as `Cᵀ w conj(b)`, one entry per unknown: `dF = 2 Re Σ derivative · du`.
    pub derivative: Vec<c64>,
}

impl Objective {
    /// The objective on the cells of a region: one per cell that the mesh defines (point), or per element (volume).
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`].
    pub fn new(mesh: &Mesh, region: RegionId, weighting: Weighting) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let cells = match weighting {
            Weighting::Point => topology.cells_of(region),
            Weighting::Volume => topology.elements_of(region).into_iter().map(|e| vec![e]).collect(),
        };
        if cells.is_empty() {
            return Err(SolverError::EmptyRegion {
                region: topology.region_names()[region.index()].clone(),
                expected: "the objective observes the field there",
            });
        }
        Ok(Self { cells, weighting })
    }

    /// Elements that take part.
    pub fn elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.cells.iter().flatten().copied()
    }

    /// Mean flux density of every cell [T], shape `(n_cells, 3)`.
    pub fn cell_flux_densities(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Vec<Complex3> {
        self.cells.iter().map(|cell| mean(cell, model, mesh, solution).0).collect()
    }

    /// `F` and its derivative with respect to the unknowns.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`].
    pub fn evaluate(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Result<ObjectiveValue, SolverError> {
        let unknowns = model.unknowns();
        let mut value = 0.0;
        let mut derivative = vec![c64::default(); model.unknown_count()];
        for cell in &self.cells {
            let (b, volume) = mean(cell, model, mesh, solution);
            let weight = match self.weighting {
                Weighting::Point => 1.0,
                Weighting::Volume => volume,
            };
            value += weight * b.iter().map(|c| c.norm_sqr()).sum::<f64>();
            let conjugate = b.map(|c| c.conj());
            for &e in cell {
                let tet = Tet4::new(mesh.vertices(e));
                let share = weight * tet.volume / volume;
                for (gradient, node) in tet.gradients.into_iter().zip(model.topology().tet(e)) {
                    // b = Σ_a ∇N_a × A_a, hence conj(b)·db = Σ_a (conj(b) × ∇N_a)·dA_a.
                    let re = cross(conjugate.map(|c| c.re), gradient);
                    let im = cross(conjugate.map(|c| c.im), gradient);
                    let at = |d: usize| share * c64::new(re[d], im[d]);
                    unknowns.scatter_add(&mut derivative, node, [at(0), at(1), at(2), c64::default()]);
                }
            }
        }
        if !value.is_finite() {
            return Err(SolverError::NotFinite { what: "objective", value });
        }
        Ok(ObjectiveValue { value, derivative })
    }
}

/// Volume mean of B [T] over a cell, and the cell's volume [m³].
fn mean(cell: &[ElementId], model: &FieldModel, mesh: &Mesh, solution: &FieldSolution) -> (Complex3, f64) {
    let mut sum = [c64::default(); 3];
    let mut volume = 0.0;
    for &e in cell {
        let v = Tet4::new(mesh.vertices(e)).volume;
        let b = solution.flux_density(model, mesh, e);
        volume += v;
        for d in 0..3 {
            sum[d] += v * b[d];
        }
    }
    (sum.map(|s| s / volume), volume)
}

//! How the elastic system `K_dd Δx_d = …` is solved: by one factor, or above a size by component blocks.
//!
//! A factor of all unknowns grows with their number to the power of 4/3, its work with the square: below a size it is the
//! best there is, since an optimiser solves with it again and again. Above, conjugate gradients are preconditioned by
//! factors of the blocks `K_xx`, `K_yy`, `K_zz`, at a tenth of the memory and work, with a number of iterations that does not
//! grow with the mesh ([`fluxmorph_geometry::fem::components`]).
//!
//! A factorisation without a positive pivot, an iteration that stops short, and a solution that is not finite are errors: the
//! map would not be the one that gradients are made for. What an optimisation does then is the driver's: the run ends with its
//! best design.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::{
    ComponentAnalysis, ComponentPreconditioner, CsrMatrix, DofMap, IterationStatus, Ldlt, LdltAnalysis,
    conjugate_gradients, csr::CsrStructure, ordering,
};

use crate::distributed::DistributedElastic;
use crate::error::RemeshError;
use crate::policy::StiffnessPolicy;

/// Unknowns up to which one factor is taken without being asked for. Measured (`benches/elastic.rs`): at 90 thousand it
/// takes 9 s and 0.8 GiB, against 1.4 s and 0.15 GiB for the blocks, and every solution is 0.8 s faster, which an optimiser
/// wins back in five evaluations; at 130 thousand 16 s and 1.3 GiB, and both grow faster than the number.
const LARGEST_DIRECT: usize = 100_000;

/// True relative residual of the component-block solver. Displacement and gradient are used as if they were exact: a
/// gradient certificate compares differences of objectives to 10⁻⁶ over steps of 10⁻⁴ of the bounds, which leaves 10⁻¹⁰
/// for all errors; this is two digits below, and close to what a direct factor leaves.
pub(crate) const TOLERANCE: f64 = 1e-12;

/// Iterations at most: some twenty on regular meshes, a hundred on thin cells with `ν` = 0.45, so that more is a fault.
pub(crate) const MAX_ITERATIONS: usize = 2000;

/// How the elastic system is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SolverChoice {
    /// By its size: direct for small systems, component blocks for large ones.
    #[default]
    Automatic,
    /// One factor of the whole matrix.
    Direct,
    /// Conjugate gradients, preconditioned by the factors of `K_xx`, `K_yy` and `K_zz`.
    ComponentBlocks,
}

/// The solver's part that follows from the pattern.
#[derive(Debug)]
pub(crate) enum SolverAnalysis {
    /// There is no unknown.
    Nothing,
    Direct(Arc<LdltAnalysis>),
    ComponentBlocks(Arc<ComponentAnalysis>),
    /// Rows and factors are distributed over ranks.
    Distributed(Arc<DistributedElastic>),
}

/// A system ready to be solved with.
#[derive(Debug)]
pub(crate) enum ElasticSolver {
    Nothing,
    Direct(Ldlt<f64>),
    ComponentBlocks { matrix: CsrMatrix<f64>, preconditioner: ComponentPreconditioner },
    Distributed(DistributedSlot),
}

/// The matrix of one reference on all ranks, for as long as it is needed.
#[derive(Debug)]
pub(crate) struct DistributedSlot {
    system: Arc<DistributedElastic>,
    /// `None` without unknowns, and at workers.
    slot: Option<u64>,
}

impl Drop for DistributedSlot {
    fn drop(&mut self) {
        if let Some(slot) = self.slot {
            self.system.release(slot);
        }
    }
}

impl SolverAnalysis {
    pub(crate) fn new(
        choice: SolverChoice,
        unknowns: &DofMap<3>,
        structure: &Arc<CsrStructure>,
    ) -> Result<Self, RemeshError> {
        let count = unknowns.count();
        if count == 0 {
            return Ok(Self::Nothing);
        }
        // Of one component alone, the block is the whole.
        let components = unknowns.component_count();
        let direct = match choice {
            SolverChoice::Automatic => count <= LARGEST_DIRECT || components == 1,
            SolverChoice::Direct => true,
            SolverChoice::ComponentBlocks => false,
        };
        Ok(if direct {
            let order = ordering::nested_dissection_of_nodes(structure, unknowns);
            Self::Direct(LdltAnalysis::new(structure, order)?)
        } else {
            Self::ComponentBlocks(ComponentAnalysis::new(unknowns, structure)?)
        })
    }

    /// Bytes of the numeric solver at most: the factors, and the matrix where it is kept.
    pub(crate) fn solver_bytes(&self, structure: &CsrStructure) -> usize {
        match self {
            Self::Nothing => 0,
            Self::Direct(analysis) => analysis.factor_entries() * size_of::<f64>(),
            Self::Distributed(_) => 0,
            Self::ComponentBlocks(analysis) => {
                structure.columns.len() * size_of::<f64>() + analysis.factor_bytes()
            }
        }
    }
}

impl ElasticSolver {
    /// Factors; `matrix` assembles where that is done in this process.
    pub(crate) fn new(
        analysis: &SolverAnalysis,
        matrix: impl FnOnce() -> CsrMatrix<f64>,
        (reference, policy): (&Mesh, StiffnessPolicy),
    ) -> Result<Self, RemeshError> {
        if let SolverAnalysis::Distributed(system) = analysis {
            let slot = system.factor(reference, policy)?;
            return Ok(Self::Distributed(DistributedSlot { system: Arc::clone(system), slot }));
        }
        Self::of_matrix(analysis, matrix())
    }

    /// Factors a matrix of this process.
    ///
    /// # Panics
    /// If the system is distributed.
    pub(crate) fn of_matrix(analysis: &SolverAnalysis, matrix: CsrMatrix<f64>) -> Result<Self, RemeshError> {
        Ok(match analysis {
            SolverAnalysis::Nothing => Self::Nothing,
            SolverAnalysis::Direct(analysis) => {
                Self::Direct(Ldlt::positive_definite(analysis, |_, k| matrix.values[k])?)
            }
            SolverAnalysis::ComponentBlocks(analysis) => {
                let preconditioner = ComponentPreconditioner::new(analysis, &matrix)?;
                Self::ComponentBlocks { matrix, preconditioner }
            }
            SolverAnalysis::Distributed(_) => unreachable!("a distributed system has no matrix here"),
        })
    }

    /// Solves in place for `what`, as errors name it.
    ///
    /// # Errors
    /// [`RemeshError::NotConverged`], [`RemeshError::NotFinite`].
    pub(crate) fn solve_in_place(
        &self,
        right_side: &mut Vec<f64>,
        what: &'static str,
    ) -> Result<(), RemeshError> {
        let check = |values: &[f64]| match values.iter().find(|value| !value.is_finite()) {
            Some(&value) => Err(RemeshError::NotFinite { what, value }),
            None => Ok(()),
        };
        check(right_side)?;
        match self {
            Self::Nothing => {}
            Self::Direct(factor) => factor.solve_in_place(right_side),
            Self::Distributed(DistributedSlot { system, slot: Some(slot) }) => {
                *right_side = system.solve(*slot, right_side)?;
            }
            Self::Distributed(DistributedSlot { slot: None, .. }) => right_side.fill(0.0),
            Self::ComponentBlocks { matrix, preconditioner } => {
                let (solution, report) = conjugate_gradients(
                    matrix,
                    |r, z| preconditioner.apply(r, z),
                    right_side,
                    TOLERANCE,
                    MAX_ITERATIONS,
                );
                if report.status == IterationStatus::Stopped {
                    return Err(RemeshError::NotConverged {
                        unknowns: right_side.len(),
                        iterations: report.iterations,
                        residual: report.residual,
                        tolerance: TOLERANCE,
                    });
                }
                *right_side = solution;
            }
        }
        check(right_side)
    }
}

//! The two-level preconditioner: a coarse space that a factor in single precision solves, and a smoother for the rest.
//!
//! The smoother is block Gauss–Seidel for quadratic nodal elements, whose incomplete factor is a poor smoother on flat cells, and
//! an incomplete factor for the others: for linear elements it costs half as much and does as well, and for edge elements neither is
//! a good one. With the smoother `S`, and `Q = P (Pᵀ K P)⁻¹ Pᵀ`, one application is
//!
//! ```text
//! z = S r + Q (r − K S r)
//! ```
//!
//! ("A-DEF2" of Tang, Nabben, Vuik and Erlangga, J. Sci. Comput. 39 (2009) 340). For a residual without a coarse part it is the
//! balanced `Q r + (I − Q K) S (I − K Q) r`, which is complex symmetric, at little more than half the cost; the iteration
//! keeps residuals free of it if it begins with [`TwoLevel::start`]. Unlike smoothing before and after, it does not ask that
//! `S` contracts, which an incomplete factor does not on flat elements. All that it takes of `K S r` is `Pᵀ K S r`: beside an
//! incomplete factor `Pᵀ K`, which has about as many entries as `K`, is kept in single precision.

use std::sync::Arc;

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, IncompleteAnalysis, LdltAnalysis, StrongSets, c32, c64, ordering};
use rayon::prelude::*;

use super::cost::{Costs, SINGLE_ENTRY, Sizes};
use super::factor::{Precondition, Scaled, Unscaled};
use super::gauss_seidel::{GaussSeidel, GaussSeidelAnalysis};
use super::hats;
use super::method::Method;
use super::transfer::Transfer;
use crate::elements::{ElementFamily, Order};

/// What the diagonal is multiplied by before the incomplete factorisation. Between 1.0 and 1.05 the iterations hardly change.
const DIAGONAL_FACTOR: f64 = 1.02;

/// Coupling over the diagonal from which two unknowns stay in one part of the incomplete factor.
const STRONG: f64 = 0.25;

/// Coupling over the diagonal from which unknowns are joined to blocks of Gauss–Seidel, the strongest first.
const JOINED: f64 = 0.1;

/// Unknowns of a block. Of 100, 300, 600, 1000 and 2000 a shield of 150 000 unknowns takes 100, 82, 80, 77 and 72 iterations,
/// each longer than the one before: all from 300 to 1000 take the same time. Without a limit the couplings join most of a fine
/// mesh to one block, whose factor is nearly that of the whole.
const MOST_JOINED: usize = 500;

/// What follows from the pattern and the couplings on the reference mesh.
#[derive(Debug)]
pub(super) struct TwoLevelAnalysis {
    transfer: Transfer,
    structure: Arc<CsrStructure>,
    coarse: Arc<LdltAnalysis>,
    smoother: SmootherAnalysis,
}

#[derive(Debug)]
enum SmootherAnalysis {
    Incomplete {
        incomplete: Arc<IncompleteAnalysis>,
        /// The structure of `Pᵀ K`.
        restricted: Arc<CsrStructure>,
        /// The diagonal entries of `Pᵀ K P` that are raised.
        raised: Vec<u32>,
    },
    GaussSeidel(Arc<GaussSeidelAnalysis>),
}

impl TwoLevelAnalysis {
    /// Analyses both levels of a matrix and a prolongation onto its unknowns, which are those of such elements.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the coarse factor or that of the sets does not fit.
    pub(super) fn new(
        matrix: &CsrMatrix<c64>,
        prolongation: CsrMatrix<f64>,
        elements: (ElementFamily, Order),
    ) -> Result<Arc<Self>, MeshError> {
        let transfer = Transfer::new(prolongation);
        let (structure, smoother) = match elements {
            (ElementFamily::Nodal, Order::Quadratic) => {
                let sets = blocks(matrix, &transfer);
                let analysis = Arc::new(GaussSeidelAnalysis::new(&matrix.structure, &sets)?);
                (transfer.coarse_structure(&matrix.structure), SmootherAnalysis::GaussSeidel(analysis))
            }
            _ => {
                let restricted = transfer.restricted_structure(&matrix.structure);
                let structure = transfer.structure_of_restricted(&restricted);
                let raised = shared_diagonal(&transfer, &structure);
                let incomplete = incomplete_analysis(matrix);
                (structure, SmootherAnalysis::Incomplete { incomplete, restricted, raised })
            }
        };
        let coarse = LdltAnalysis::new(&structure, ordering::dissection(&structure))?;
        Ok(Arc::new(Self { transfer, structure, coarse, smoother }))
    }

    /// Costs for a matrix with so many entries.
    pub(super) fn costs(&self, matrix_entries: usize) -> Costs {
        let sizes = Sizes { matrix_entries, ..Sizes::default() };
        let coarse = Sizes {
            matrix_entries: self.structure.columns.len(),
            factor_entries: self.coarse.factor_entries(),
            multiplications: self.coarse.multiplications(),
        };
        let smoother = match &self.smoother {
            SmootherAnalysis::Incomplete { restricted, .. } => {
                Costs::incomplete(&sizes).with_product(restricted.columns.len())
            }
            SmootherAnalysis::GaussSeidel(own) => Costs::gauss_seidel(&sizes, &own.sizes()),
        };
        smoother.and(Costs::complete(Method::DirectSingle, &coarse))
    }

    /// Whether the coarse space has hat functions.
    pub(super) fn has_hats(&self) -> bool {
        matches!(&self.smoother, SmootherAnalysis::Incomplete { raised, .. } if !raised.is_empty())
    }

    /// Memory of both factors and the transfer [bytes].
    pub(super) fn bytes(&self) -> usize {
        let smoother = match &self.smoother {
            SmootherAnalysis::Incomplete { incomplete, restricted, .. } => {
                incomplete.bytes::<c32>() + restricted.columns.len() * SINGLE_ENTRY
            }
            SmootherAnalysis::GaussSeidel(analysis) => analysis.bytes(),
        };
        self.coarse.factor_entries() * size_of::<c32>() + smoother + self.transfer.bytes()
    }
}

/// Where the diagonal entries of hats stand, the coarse unknowns with a weight other than one.
fn shared_diagonal(transfer: &Transfer, structure: &CsrStructure) -> Vec<u32> {
    let has_shares = transfer.has_shares();
    let diagonal = |row: usize| structure.row(row).find(|&k| structure.columns[k] as usize == row);
    let shared = (0..structure.row_count()).filter(|&row| has_shares[row]);
    shared.filter_map(diagonal).map(|k| k as u32).collect()
}

/// The blocks of Gauss–Seidel. What the coarse space has by itself joins none.
fn blocks(matrix: &CsrMatrix<c64>, transfer: &Transfer) -> StrongSets {
    let coupling = couplings(matrix);
    let is_coarse = transfer.is_coarse();
    StrongSets::of_at_most(MOST_JOINED, &matrix.structure, |row, k| {
        let strength = coupling(row, k);
        let is_free = !is_coarse[row] && !is_coarse[matrix.structure.columns[k] as usize];
        (is_free && strength > JOINED * JOINED).then_some(strength as f32)
    })
}

/// Order and parts of an incomplete factor, after the strong couplings of a matrix.
pub(super) fn incomplete_analysis(matrix: &CsrMatrix<c64>) -> Arc<IncompleteAnalysis> {
    let coupling = couplings(matrix);
    IncompleteAnalysis::in_parts(&matrix.structure, |row, k| coupling(row, k) > STRONG * STRONG)
}

/// How strongly an entry of a row couples: its square over the product of the diagonal entries.
fn couplings(matrix: &CsrMatrix<c64>) -> impl Fn(usize, usize) -> f64 {
    let of = |row: usize| matrix.entry(row, row).unwrap_or_default().norm();
    let diagonal: Vec<f64> = (0..matrix.structure.row_count()).into_par_iter().map(of).collect();
    move |row, k| {
        let column = matrix.structure.columns[k] as usize;
        matrix.values[k].norm_sqr() / (diagonal[row] * diagonal[column])
    }
}

/// The preconditioner of one matrix.
#[derive(Debug)]
pub(super) struct TwoLevel {
    analysis: Arc<TwoLevelAnalysis>,
    smoother: Smoother,
    coarse: Scaled<c32>,
}

#[derive(Debug)]
enum Smoother {
    /// With `Pᵀ K`.
    Incomplete(Unscaled, CsrMatrix<c32>),
    GaussSeidel(GaussSeidel),
}

impl TwoLevel {
    /// Factors both levels of a matrix with the analysed pattern.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when a factorisation fails.
    pub(super) fn new(analysis: &Arc<TwoLevelAnalysis>, matrix: &CsrMatrix<c64>) -> Result<Self, MeshError> {
        let TwoLevelAnalysis { transfer, structure, .. } = &**analysis;
        let complete = |coarse: CsrMatrix<c64>| Scaled::complete(&analysis.coarse, &coarse, None);
        let (coarse, smoother) = match &analysis.smoother {
            SmootherAnalysis::Incomplete { incomplete, restricted, raised } => {
                // Of both matrices in double precision neither is there beside a factor that it is no part of.
                let (coarse, restricted) = {
                    let restricted = transfer.restricted_matrix(restricted, matrix);
                    let mut coarse = transfer.matrix_of_restricted(structure, &restricted);
                    raised.iter().for_each(|&k| coarse.values[k as usize] *= hats::DIAGONAL_FACTOR);
                    (coarse, single(&restricted))
                };
                let coarse = complete(coarse)?;
                let incomplete = Unscaled::new(incomplete, matrix, DIAGONAL_FACTOR)?;
                (coarse, Smoother::Incomplete(incomplete, restricted))
            }
            SmootherAnalysis::GaussSeidel(own) => {
                let coarse = complete(transfer.coarse_matrix(structure, matrix))?;
                (coarse, Smoother::GaussSeidel(GaussSeidel::new(own, matrix)?))
            }
        };
        Ok(Self { analysis: Arc::clone(analysis), smoother, coarse })
    }

    /// `z += P (Pᵀ K P)⁻¹ r` for a coarse right side.
    fn add_coarse_solution(&self, r: &[c64], z: &mut [c64]) {
        let mut coarse = vec![c64::default(); r.len()];
        self.coarse.apply(r, &mut coarse);
        self.analysis.transfer.add_prolongation(&coarse, z);
    }
}

impl Precondition for TwoLevel {
    fn bytes(&self) -> usize {
        let smoother = match &self.smoother {
            Smoother::Incomplete(factor, restricted) => {
                factor.bytes() + restricted.values.len() * SINGLE_ENTRY
            }
            Smoother::GaussSeidel(own) => own.bytes(),
        };
        smoother + self.coarse.bytes()
    }

    /// Moves `x` so that the residual `b − K x` has no coarse part: where a deflated iteration starts.
    fn start(&self, matrix: &CsrMatrix<c64>, b: &[c64], x: &mut [c64]) {
        let rest = matrix.residual(x, b);
        self.add_coarse_solution(&self.analysis.transfer.restrict(&rest), x);
    }

    fn apply(&self, r: &[c64], z: &mut [c64]) {
        let transfer = &self.analysis.transfer;
        let rest = match &self.smoother {
            Smoother::Incomplete(factor, restricted) => {
                factor.apply(r, z);
                restricted.residual(z, &transfer.restrict(r))
            }
            Smoother::GaussSeidel(own) => {
                let mut rest = vec![c64::default(); r.len()];
                own.apply(r, z, &mut rest);
                transfer.restrict(&rest)
            }
        };
        self.add_coarse_solution(&rest, z);
    }
}

/// The matrix in single precision.
fn single(matrix: &CsrMatrix<c64>) -> CsrMatrix<c32> {
    let value = |value: &c64| c32::new(value.re as f32, value.im as f32);
    let values = matrix.values.par_iter().map(value).collect();
    CsrMatrix { structure: Arc::clone(&matrix.structure), values }
}

//! Direct factorisation of symmetric matrices, real or complex: `P A Pᵀ = L D Lᵀ` with the plain transpose, without pivoting.
//!
//! `K + jωC` with positive semidefinite parts and a positive definite sum is complex *symmetric*, not Hermitian: its factor
//! carries no conjugation, and needs no pivoting (docs/adr/0003). The method is left-looking and supernodal: columns with
//! one pattern form a *panel*, a dense rectangle that gathers the updates of all panels before it and is then factored by
//! dense kernels. Beside the factor, only one small workspace a thread is held, and where
//! panels are kept the matrix entries that they are made of; a multifrontal method would keep a stack of
//! update matrices as large as the factor.
//!
//! Lives here: the number types (`scalar`) and vectors of them (`lanes`), the analysis of a pattern (`analysis`,
//! `panels`, `schedule`), dense kernels of one panel (`dense`, `multiply`, `panel_solve`), the numeric factorisation
//! (`factor`) and the triangular solves (`solve`), both compiled for the four types in `compiled`. Does not live here:
//! orderings ([`ordering`](super::ordering)), iterations that refine or precondition.
//!
//! The bits of factor and solution do not depend on the number of threads: every panel, and every fixed tile of its rows,
//! takes its updates in one order, and no dense kernel is itself parallel. They may differ between processors with other vector
//! instructions.

mod analysis;
mod compiled;
mod dense;
mod factor;
mod lanes;
mod multiply;
mod panel_solve;
mod panels;
mod scalar;
mod schedule;
mod solve;
#[cfg(test)]
mod tests;

pub use analysis::LdltAnalysis;
pub use compiled::FactorScalar;
pub use factor::{Entry, KeptPanels, Ldlt};
pub use scalar::PanelScalar;

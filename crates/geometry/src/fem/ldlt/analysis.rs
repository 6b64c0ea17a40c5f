//! What a factorisation knows from the pattern alone: elimination order, panels, tasks.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::SymbolicSupernodalParams;
use faer::sparse::linalg::cholesky::{simplicial, supernodal};

use super::panels::Panels;
use super::schedule::{self, Branch};
use crate::error::MeshError;
use crate::fem::csr::CsrStructure;
use crate::fem::ordering;

/// Elimination order and symbolic factor of one symmetric pattern; serves every number type.
#[derive(Debug)]
pub struct LdltAnalysis {
    pub(super) structure: Arc<CsrStructure>,
    /// `order[new] = old`.
    pub(super) order: Vec<u32>,
    /// `inverse[old] = new`.
    pub(super) inverse: Vec<u32>,
    pub(super) panels: Panels,
    pub(super) tasks: Branch,
    /// Whether a panel is the same for every matrix, and so are those that change it; empty where none is.
    pub(super) kept: Vec<bool>,
}

impl LdltAnalysis {
    /// Analyses a structurally symmetric pattern in the elimination order `order[new] = old`, which is postordered here; by
    /// minimum degree without one.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the order is not a permutation of the rows, or the factor does not fit the index
    /// type or the memory.
    pub fn new(structure: &Arc<CsrStructure>, order: Option<Vec<u32>>) -> Result<Arc<Self>, MeshError> {
        Ok(Arc::new(Self::analysed(structure, order)?))
    }

    /// The same for matrices in which only some rows change from one to the next: panels of the others are kept
    /// ([`Ldlt::new_keeping`](super::Ldlt::new_keeping)).
    ///
    /// # Errors
    /// As [`LdltAnalysis::new`].
    pub fn keeping(
        structure: &Arc<CsrStructure>,
        order: Option<Vec<u32>>,
        changes: &[bool],
    ) -> Result<Arc<Self>, MeshError> {
        let mut analysis = Self::analysed(structure, order)?;
        let mut kept = vec![false; analysis.panels.len()];
        for (p, panel) in analysis.panels.iter().enumerate() {
            let own = &analysis.order[panel.start..panel.start + panel.width];
            kept[p] = own.iter().all(|&old| !changes[old as usize])
                && analysis.panels.updates(p).iter().all(|update| kept[update.source as usize]);
        }
        analysis.kept = kept;
        Ok(Arc::new(analysis))
    }

    fn analysed(structure: &Arc<CsrStructure>, order: Option<Vec<u32>>) -> Result<Self, MeshError> {
        let n = structure.row_count();
        let failed = |cause: String| MeshError::Factorisation { unknowns: n, cause };
        let order = match order {
            Some(order) if is_permutation(&order, n) => order,
            Some(order) => {
                let length = order.len();
                return Err(failed(format!(
                    "the elimination order of {length} entries is not a permutation of the {n} rows"
                )));
            }
            None => ordering::minimum_degree(structure)
                .ok_or_else(|| failed("out of memory for the minimum degree order".to_owned()))?,
        };
        let order = ordering::postorder(structure, order);
        let inverse = ordering::inverse_permutation(&order);
        let (starts, rows) = ordering::upper_triangle(structure, &order, &inverse);
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows);
        let mut tree = vec![0i32; n];
        let mut counts = vec![0u32; n];
        let scratch = StackReq::or(
            simplicial::prefactorize_symbolic_cholesky_scratch::<u32>(n, rows.len()),
            supernodal::factorize_supernodal_symbolic_cholesky_scratch::<u32>(n),
        );
        let mut memory =
            MemBuffer::try_new(scratch).map_err(|_| failed("out of memory for the analysis".to_owned()))?;
        let stack = MemStack::new(&mut memory);
        let tree = simplicial::prefactorize_symbolic_cholesky(&mut tree, &mut counts, upper, stack);
        let params = SymbolicSupernodalParams::default();
        let symbolic =
            supernodal::factorize_supernodal_symbolic_cholesky(upper, tree, &counts, stack, params)
                .map_err(|e| failed(e.to_string()))?;
        let panels = Panels::new(&symbolic);
        let tasks = schedule::cut(&panels);
        let structure = Arc::clone(structure);
        Ok(Self { structure, order, inverse, panels, tasks, kept: Vec::new() })
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.order.len()
    }

    /// Stored entries of `L` and `D`.
    pub fn factor_entries(&self) -> usize {
        self.panels.iter().map(super::panels::Panel::entries).sum()
    }

    /// Multiply-adds of a numeric factorisation.
    pub fn multiplications(&self) -> f64 {
        (0..self.panels.len()).map(|p| self.panels.work(p)).sum()
    }

    /// Multiply-adds of one that takes over all panels that are kept.
    pub fn changing_multiplications(&self) -> f64 {
        (0..self.panels.len()).filter(|&p| !self.is_kept(p)).map(|p| self.panels.work(p)).sum()
    }

    /// Whether some panel is the same for every matrix.
    pub fn keeps_a_part(&self) -> bool {
        self.kept.contains(&true)
    }

    /// Whether a panel is the same for every matrix.
    pub(super) fn is_kept(&self, p: usize) -> bool {
        self.kept.get(p).is_some_and(|&kept| kept)
    }
}

fn is_permutation(order: &[u32], n: usize) -> bool {
    let mut seen = vec![false; n];
    let is_new = |&old: &u32| seen.get_mut(old as usize).is_some_and(|seen| !std::mem::replace(seen, true));
    order.len() == n && order.iter().all(is_new)
}

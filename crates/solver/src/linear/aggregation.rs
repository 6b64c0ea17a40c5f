//! The coarse space for linear nodal elements: the scalar potential in full, aggregates of each component of `A`.
//!
//! In a conductor much thicker than the skin depth the fields `(A, ψ) = (∇χ, −χ)` carry no current and almost no energy:
//! a component-wise or local preconditioner does not see them, and an incomplete factor needs thousands of iterations.
//! The unknowns of `ψ` therefore stay in the coarse space one by one; `A` is aggregated in conductors as elsewhere. In the air
//! the system is close to one Laplacian a component, for which piecewise constants on aggregates of about 2^passes strongly
//! coupled unknowns do (pairwise aggregation: Notay, Electron. Trans. Numer. Anal. 37 (2010) 123). The Galerkin product couples
//! the components.

use std::sync::Arc;

use fluxmorph_geometry::CarrierId;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, DofMap, c64};

use crate::unknowns::PSI;

/// Passes of pairing: 8 unknowns an aggregate. At a million tetrahedra one pass fewer saves a quarter of the iterations and takes
/// 2.7 times as long for the coarse factor; one more takes half as many iterations again.
pub(crate) const PASSES: usize = 3;

/// Share of the strongest coupling of an unknown below which another one is no partner: pairs across thin cells only.
const PARTNER: f64 = 0.25;

/// No aggregate.
const NONE: u32 = u32::MAX;

/// Couplings of every aggregate with the others, by number, `(other, −Re)`.
type Graph = Vec<Vec<(u32, f64)>>;

/// The prolongation from the coarse space; shape `(dofs.count(), n_coarse)`, one entry 1 a row.
///
/// The couplings are those of `matrix`: the coarse space is made once, on the reference mesh.
pub(crate) fn prolongation(dofs: &DofMap<4>, matrix: &CsrMatrix<c64>, passes: usize) -> CsrMatrix<f64> {
    let n = dofs.count();
    let mut component = vec![PSI; n];
    for node in (0..dofs.carrier_count()).map(CarrierId::new) {
        for c in 0..PSI {
            if let Some(equation) = dofs.equation(node, c) {
                component[equation] = c;
            }
        }
    }
    let mut graph = couplings(matrix, &component);
    let mut column: Vec<u32> = (0..n as u32).collect();
    for _ in 0..passes {
        let (aggregate, count) = pairs(&graph);
        column.iter_mut().for_each(|own| *own = aggregate[*own as usize]);
        graph = merge(&graph, &aggregate, count);
    }
    // Numbered in the order of their first unknown, so that neighbours stay neighbours.
    let mut number = vec![NONE; graph.len()];
    let mut coarse = 0;
    for own in &mut column {
        let number = &mut number[*own as usize];
        if *number == NONE {
            *number = coarse;
            coarse += 1;
        }
        *own = *number;
    }
    let row_starts = (0..=n as u32).collect();
    let structure = CsrStructure { column_count: coarse as usize, row_starts, columns: column };
    CsrMatrix { structure: Arc::new(structure), values: vec![1.0; n] }
}

/// Couplings of the unknowns of `A` within their component.
fn couplings(matrix: &CsrMatrix<c64>, component: &[usize]) -> Graph {
    let structure = &matrix.structure;
    let row = |i: usize| {
        let partner = |c: usize| c != i && component[i] != PSI && component[c] == component[i];
        let entries = structure.row(i).map(|k| (structure.columns[k], -matrix.values[k].re));
        entries.filter(|entry| partner(entry.0 as usize)).collect()
    };
    (0..structure.row_count()).map(row).collect()
}

/// Pairs everything with its strongest partner that is still free; the pair of each, and how many there are.
fn pairs(graph: &Graph) -> (Vec<u32>, usize) {
    let mut pair = vec![NONE; graph.len()];
    let mut count = 0;
    for (i, row) in graph.iter().enumerate() {
        if pair[i] != NONE {
            continue;
        }
        pair[i] = count;
        let strongest = row.iter().map(|entry| entry.1).fold(0.0, f64::max);
        let free = row.iter().filter(|entry| pair[entry.0 as usize] == NONE);
        // The first of equals: the choice does not depend on anything but the numbering.
        let best = free.reduce(|best, entry| if entry.1 > best.1 { entry } else { best });
        if let Some(&(partner, _)) = best.filter(|best| best.1 > PARTNER * strongest) {
            pair[partner as usize] = count;
        }
        count += 1;
    }
    (pair, count as usize)
}

/// The graph of the pairs.
fn merge(graph: &Graph, pair: &[u32], count: usize) -> Graph {
    let mut merged: Graph = vec![Vec::new(); count];
    for (row, &own) in graph.iter().zip(pair) {
        let others = row.iter().map(|&(other, weight)| (pair[other as usize], weight));
        merged[own as usize].extend(others.filter(|other| other.0 != own));
    }
    for row in &mut merged {
        row.sort_by_key(|entry| entry.0);
        row.dedup_by(|next, first| {
            let same = next.0 == first.0;
            if same {
                first.1 += next.1;
            }
            same
        });
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A column of 16 nodes with one component each; the last four have ψ.
    #[test]
    fn neighbours_are_joined_and_the_scalar_potential_stays() {
        let n = 16usize;
        let dofs = DofMap::<4>::new(n, |node, c| c == if node.index() < 12 { 0 } else { PSI });
        let entry = |i, c| (c, c64::new(if c == i { 2.0 } else { -1.0 }, 0.0));
        let row = |i: usize| (i.saturating_sub(1)..(i + 2).min(n)).map(|c| entry(i, c)).collect();
        let matrix = CsrMatrix::from_rows(n, (0..n).map(row));
        let p = prolongation(&dofs, &matrix, 2);
        assert_eq!(p.structure.columns, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 4, 5, 6]);
        assert_eq!(p.structure.column_count, 7);
    }
}

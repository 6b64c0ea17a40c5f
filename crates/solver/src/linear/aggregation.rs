//! The coarse space for linear elements where no factor of the whole system fits: conductors in full, aggregates elsewhere.
//!
//! In a conductor much thicker than the skin depth the fields `(A, ψ) = (∇χ, −χ)` carry no current and almost no energy:
//! a component-wise or local preconditioner does not see them, and an incomplete factor needs thousands of iterations.
//! The unknowns at the nodes of conductors therefore stay in the coarse space one by one. Elsewhere the system is close to
//! one Laplacian a component, for which piecewise constants on aggregates of about 2^passes strongly coupled unknowns
//! do (pairwise aggregation: Notay, Electron. Trans. Numer. Anal. 37 (2010) 123). The Galerkin product couples the two.

use std::sync::Arc;

use fluxmorph_geometry::CarrierId;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, DofMap, c64};

/// Passes of pairing: 16 unknowns an aggregate. One pass fewer saves a seventh of the iterations and costs as much of the
/// coarse factor; one more costs a sixth of the iterations (shields of 73 000 and 262 000 tetrahedra).
pub(crate) const PASSES: usize = 4;

/// Share of the strongest coupling of an unknown below which another one is no partner: pairs across thin cells only.
const PARTNER: f64 = 0.25;

/// No aggregate.
const NONE: u32 = u32::MAX;

/// Couplings of every aggregate with the others, by number, `(other, −Re)`.
type Graph = Vec<Vec<(u32, f64)>>;

/// The prolongation from the coarse space; shape `(dofs.count(), n_coarse)`, one entry 1 a row.
///
/// `kept(node)` says where unknowns stay one by one. The couplings are those of `matrix`: the coarse space is made once, on
/// the reference mesh.
pub(crate) fn prolongation(
    dofs: &DofMap<4>,
    matrix: &CsrMatrix<c64>,
    kept: impl Fn(CarrierId) -> bool,
    passes: usize,
) -> CsrMatrix<f64> {
    let n = dofs.count();
    let mut component = vec![0u8; n];
    let mut active = vec![false; n];
    for node in (0..dofs.carrier_count()).map(CarrierId::new) {
        for c in 0..4 {
            if let Some(equation) = dofs.equation(node, c) {
                component[equation] = c as u8;
                active[equation] = !kept(node);
            }
        }
    }
    let mut graph = couplings(matrix, &component, &active);
    let mut column: Vec<u32> = (0..n as u32).map(|i| if active[i as usize] { i } else { NONE }).collect();
    let mut count = n;
    let mut exists = active;
    for _ in 0..passes {
        let (aggregate, fewer) = pairs(&graph, &exists);
        for own in column.iter_mut().filter(|own| **own != NONE) {
            *own = aggregate[*own as usize];
        }
        graph = merge(&graph, &aggregate, fewer);
        count = fewer;
        exists = vec![true; count];
    }
    if passes == 0 {
        count = n;
    }
    // Numbered in the order of their first unknown, so that neighbours stay neighbours.
    let mut number = vec![NONE; count];
    let mut coarse = 0u32;
    for own in &mut column {
        let fresh = if *own == NONE { NONE } else { number[*own as usize] };
        let new = if fresh == NONE { coarse } else { fresh };
        coarse += u32::from(fresh == NONE);
        if *own != NONE {
            number[*own as usize] = new;
        }
        *own = new;
    }
    let row_starts = (0..=n as u32).collect();
    let structure = CsrStructure { column_count: coarse as usize, row_starts, columns: column };
    CsrMatrix { structure: Arc::new(structure), values: vec![1.0; n] }
}

/// Couplings of the active unknowns within their component.
fn couplings(matrix: &CsrMatrix<c64>, component: &[u8], active: &[bool]) -> Graph {
    let structure = &matrix.structure;
    let row = |i: usize| {
        let partner = |c: usize| c != i && active[i] && active[c] && component[c] == component[i];
        let entries = structure.row(i).map(|k| (structure.columns[k], -matrix.values[k].re));
        entries.filter(|entry| partner(entry.0 as usize)).collect()
    };
    (0..structure.row_count()).map(row).collect()
}

/// Pairs everything with its strongest partner that is still free; the pair of each, and how many there are.
fn pairs(graph: &Graph, exists: &[bool]) -> (Vec<u32>, usize) {
    let mut pair = vec![NONE; graph.len()];
    let mut count = 0;
    for (i, row) in graph.iter().enumerate() {
        if pair[i] != NONE || !exists[i] {
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
    for (row, &own) in graph.iter().zip(pair).filter(|(_, own)| **own != NONE) {
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

    /// A column of 16 nodes with one component each; the last four are kept.
    #[test]
    fn neighbours_are_joined_and_kept_nodes_stay() {
        let n = 16usize;
        let dofs = DofMap::<4>::new(n, |_, c| c == 0);
        let entry = |i, c| (c, c64::new(if c == i { 2.0 } else { -1.0 }, 0.0));
        let row = |i: usize| (i.saturating_sub(1)..(i + 2).min(n)).map(|c| entry(i, c)).collect();
        let matrix = CsrMatrix::from_rows(n, (0..n).map(row));
        let p = prolongation(&dofs, &matrix, |node| node.index() >= 12, 2);
        assert_eq!(p.structure.columns, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 4, 5, 6]);
        assert_eq!(p.structure.column_count, 7);
    }
}

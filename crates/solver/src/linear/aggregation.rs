//! The coarse space for nodal elements: of linear ones the scalar potential in full, aggregates of each component of `A`.
//!
//! In a conductor much thicker than the skin depth the fields `(A, ψ) = (∇χ, −χ)` carry no current and almost no energy:
//! a component-wise or local preconditioner does not see them, and an incomplete factor needs thousands of iterations.
//! The unknowns of `ψ` therefore stay in the coarse space one by one; `A` is aggregated in conductors as elsewhere. In the air
//! the system is close to one Laplacian a component, for which piecewise constants on aggregates of about 2^passes strongly
//! coupled unknowns do (pairwise aggregation: Notay, Electron. Trans. Numer. Anal. 37 (2010) 123). The Galerkin product couples
//! the components. Around iron that is not enough, and hats stand beside larger aggregates ([`hats`](super::hats)).
//!
//! For quadratic elements the linear functions of `A` can be joined in the same way. To a residual of 10⁻¹¹ that takes half as many
//! iterations again with pairs, and is not done; to the 10⁻³ of an error estimate it pays where the coarse factor is most of the
//! work.

use std::sync::Arc;

use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, DofMap, c64};

use super::transfer::Transfer;
use crate::unknowns::PSI;

/// Passes of pairing: 8 unknowns an aggregate. At a million tetrahedra one pass fewer saves a quarter of the iterations and takes
/// 2.7 times as long for the coarse factor; one more takes half as many iterations again.
pub(crate) const PASSES: usize = 3;

/// The same beside hats: 32 unknowns an aggregate.
pub(crate) const PASSES_BESIDE_HATS: usize = 5;

/// Passes of pairing of the linear functions of quadratic elements: four an aggregate.
const PASSES_OF_LINEAR_FUNCTIONS: usize = 2;

/// Share of the strongest coupling of an unknown below which another one is no partner: pairs across thin cells only.
const PARTNER: f64 = 0.25;

/// No aggregate.
const NONE: u32 = u32::MAX;

/// Couplings of every aggregate with the others, by number, `(other, −Re)`.
type Graph = Vec<Vec<(u32, f64)>>;

/// Piecewise constants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Aggregates {
    /// The aggregate of every row.
    pub(crate) of_row: Vec<u32>,
    /// How many there are.
    pub(crate) count: usize,
}

/// The prolongation from aggregates of all rows: one entry 1 a row.
pub(crate) fn prolongation(aggregates: Aggregates) -> CsrMatrix<f64> {
    let Aggregates { of_row: columns, count: column_count } = aggregates;
    let rows = columns.len() as u32;
    let structure = CsrStructure { column_count, row_starts: (0..=rows).collect(), columns };
    CsrMatrix { structure: Arc::new(structure), values: vec![1.0; rows as usize] }
}

/// The aggregate of every row of `matrix`, which are those of the equations `owned`; its columns are all equations, of which
/// only the owned ones are aggregated.
pub(crate) fn aggregates(
    dofs: &DofMap<4>,
    owned: &[u32],
    matrix: &CsrMatrix<c64>,
    passes: usize,
) -> Aggregates {
    let component: Vec<usize> = dofs.places().map(|place| place.1).collect();
    of_components(&component, owned, matrix, passes)
}

/// The prolongation onto quadratic elements from aggregates of the linear functions of `A`: `linear` with its columns joined, of
/// which the first are those of the linear functions, of these components, and the others those of ψ.
pub(crate) fn of_linear_functions(
    linear: CsrMatrix<f64>,
    mut component: Vec<usize>,
    matrix: &CsrMatrix<c64>,
) -> CsrMatrix<f64> {
    let n = linear.structure.column_count;
    component.resize(n, PSI);
    let transfer = Transfer::new(linear);
    let coarse = transfer.coarse_matrix(&transfer.coarse_structure(&matrix.structure), matrix);
    let all: Vec<u32> = (0..n as u32).collect();
    transfer.joined(&of_components(&component, &all, &coarse, PASSES_OF_LINEAR_FUNCTIONS))
}

/// The aggregates of unknowns of the given components.
fn of_components(component: &[usize], owned: &[u32], matrix: &CsrMatrix<c64>, passes: usize) -> Aggregates {
    let mut graph = couplings(matrix, owned, component);
    let mut of_row: Vec<u32> = (0..owned.len() as u32).collect();
    for _ in 0..passes {
        let (aggregate, count) = pairs(&graph);
        of_row.iter_mut().for_each(|own| *own = aggregate[*own as usize]);
        graph = merge(&graph, &aggregate, count);
    }
    // Numbered in the order of their first unknown, so that neighbours stay neighbours.
    let mut number = vec![NONE; graph.len()];
    let mut count = 0;
    for own in &mut of_row {
        let number = &mut number[*own as usize];
        if *number == NONE {
            *number = count;
            count += 1;
        }
        *own = *number;
    }
    Aggregates { of_row, count: count as usize }
}

/// Couplings of the owned unknowns of `A` within their component.
fn couplings(matrix: &CsrMatrix<c64>, owned: &[u32], component: &[usize]) -> Graph {
    let structure = &matrix.structure;
    let mut row_of = vec![NONE; component.len()];
    for (row, &equation) in (0..).zip(owned) {
        row_of[equation as usize] = row;
    }
    let row = |i: usize| {
        let own = component[owned[i] as usize];
        let entries = structure.row(i).map(|k| (structure.columns[k] as usize, -matrix.values[k].re));
        let partners = entries.filter(|&(c, _)| own != PSI && component[c] == own);
        let rows = partners.map(|(c, weight)| (row_of[c], weight));
        rows.filter(|&(c, _)| c != NONE && c as usize != i).collect()
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
        let all: Vec<u32> = (0..n as u32).collect();
        let aggregates = aggregates(&dofs, &all, &matrix, 2);
        assert_eq!(aggregates.of_row, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 4, 5, 6]);
        assert_eq!(aggregates.count, 7);
    }

    /// The same column over two ranks, which own every node of a half, and 5 besides the second.
    #[test]
    fn a_rank_aggregates_its_own_unknowns_alone() {
        let n = 16usize;
        let dofs = DofMap::<4>::new(n, |node, c| c == if node.index() < 12 { 0 } else { PSI });
        let entry = |i, c| (c, c64::new(if c == i { 2.0 } else { -1.0 }, 0.0));
        let row = |i: usize| (i.saturating_sub(1)..(i + 2).min(n)).map(|c| entry(i, c)).collect();
        let of_rank = |owned: &[u32]| {
            let matrix = CsrMatrix::from_rows(n, owned.iter().map(|&i| row(i as usize)));
            aggregates(&dofs, owned, &matrix, 2)
        };
        let first = of_rank(&[0, 1, 2, 3, 4, 6, 7]);
        assert_eq!((first.of_row, first.count), (vec![0, 0, 0, 0, 1, 2, 2], 3));
        let second = of_rank(&[5, 8, 9, 10, 11, 12, 13, 14, 15]);
        assert_eq!((second.of_row, second.count), (vec![0, 1, 1, 1, 1, 2, 3, 4, 5], 6));
    }
}

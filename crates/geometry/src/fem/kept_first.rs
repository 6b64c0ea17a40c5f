//! Nested dissection in two parts: first what stays as it is from one matrix to the next, then what changes.
//!
//! A column of the factor depends on those that are eliminated before it. Where elements rest while others move, the rows of
//! nodes among resting elements are the same in every matrix; eliminated first, their part of the factor is, too, and can be kept
//! ([`Ldlt::new_keeping`](super::Ldlt::new_keeping)). The price is fill: what is eliminated leaves everything around it coupled
//! (its *rim*), which the dissection of the second part is shown. Whether that pays is for the caller to see from both factors.

use fluxmorph_petsc::metis;

use super::csr::CsrStructure;
use super::strong_sets::StrongSets;

/// Edges within rims above which there is no order: METIS holds them all, in some 20 bytes each.
const MAX_RIM_EDGES: usize = 20_000_000;

/// Which rows of a matrix change from one to the next, and when that is worth an order of its own.
#[derive(Clone, Copy, Debug)]
pub struct Changes<'a> {
    /// By row.
    pub rows: &'a [bool],
    /// Multiply-adds that the factors of the rims alone, dense as they are, may take: a bound of what the second part costs, known
    /// before there is an order.
    pub max_rim_multiplications: f64,
}

/// The order `forward[new] = old` of the vertices of a graph, each counting by its weight or all the same; `None` where METIS
/// refuses, where all vertices are of one part, and where the rims are too large.
pub fn kept_first(
    graph: &CsrStructure,
    weights: Option<&[i32]>,
    Changes { rows: changes, max_rim_multiplications }: Changes<'_>,
) -> Option<Vec<u32>> {
    let (changing, kept): (Vec<u32>, Vec<u32>) =
        (0..graph.row_count() as u32).partition(|&vertex| changes[vertex as usize]);
    let rims = rims(graph, changes);
    let unknowns = |rim: &Vec<u32>| match weights {
        None => rim.len() as f64,
        Some(weights) => rim.iter().map(|&vertex| f64::from(weights[vertex as usize])).sum(),
    };
    let edges: usize = rims.iter().map(|rim| rim.len() * rim.len()).sum();
    let of_rims: f64 = rims.iter().map(|rim| unknowns(rim).powi(3) / 6.0).sum();
    if kept.is_empty() || changing.is_empty() || of_rims > max_rim_multiplications || edges > MAX_RIM_EDGES {
        return None;
    }
    let mut order = dissection_of(graph, weights, &kept, &[])?;
    order.extend(dissection_of(graph, weights, &changing, &rims)?);
    Some(order)
}

/// The changing vertices next to each connected set of others, ascending.
fn rims(graph: &CsrStructure, changes: &[bool]) -> Vec<Vec<u32>> {
    let stays = |vertex: u32| !changes[vertex as usize];
    let sets = StrongSets::new(graph, |row, k| stays(row as u32) && stays(graph.columns[k]));
    let parts = (0..sets.count()).map(|set| sets.rows(set)).filter(|part| stays(part[0]));
    let rim = |part: &[u32]| {
        let around = part.iter().flat_map(|&vertex| &graph.columns[graph.row(vertex as usize)]);
        let mut rim: Vec<u32> = around.copied().filter(|&next| !stays(next)).collect();
        rim.sort_unstable();
        rim.dedup();
        rim
    };
    parts.map(rim).collect()
}

/// Nested dissection of some vertices, ascending, each of the rims being coupled throughout.
fn dissection_of(
    graph: &CsrStructure,
    weights: Option<&[i32]>,
    vertices: &[u32],
    rims: &[Vec<u32>],
) -> Option<Vec<u32>> {
    let mut number = vec![u32::MAX; graph.row_count()];
    for (new, &old) in vertices.iter().enumerate() {
        number[old as usize] = new as u32;
    }
    let mut rims_of: Vec<Vec<u32>> = vec![Vec::new(); vertices.len()];
    for (k, rim) in rims.iter().enumerate() {
        rim.iter().for_each(|&vertex| rims_of[number[vertex as usize] as usize].push(k as u32));
    }
    let (mut row_starts, mut columns) = (vec![0u32], Vec::new());
    let mut row: Vec<u32> = Vec::new();
    for (&old, rims_of) in vertices.iter().zip(&rims_of) {
        let around = rims_of.iter().flat_map(|&k| &rims[k as usize]);
        let all = graph.columns[graph.row(old as usize)].iter().chain(around);
        row.clear();
        row.extend(all.map(|&c| number[c as usize]).filter(|&c| c != u32::MAX));
        row.sort_unstable();
        row.dedup();
        columns.extend_from_slice(&row);
        row_starts.push(columns.len() as u32);
    }
    let weights = weights.map(|weights| vertices.iter().map(|&old| weights[old as usize]).collect());
    let order = metis::nested_dissection(&row_starts, &columns, weights)?;
    Some(order.into_iter().map(|new| vertices[new as usize]).collect())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::fem::csr::CsrMatrix;

    /// A grid of `n` by `n` points, neighbours along both axes.
    fn grid(n: usize) -> Arc<CsrStructure> {
        let row = |v: usize| {
            let (x, y) = (v % n, v / n);
            let near = [
                (x > 0, v.wrapping_sub(1)),
                (x + 1 < n, v + 1),
                (y > 0, v.wrapping_sub(n)),
                (y + 1 < n, v + n),
            ];
            let mut row: Vec<_> = near.into_iter().filter(|near| near.0).map(|near| (near.1, 0.0)).collect();
            row.push((v, 0.0));
            row.sort_by_key(|entry| entry.0);
            row
        };
        CsrMatrix::from_rows(n * n, (0..n * n).map(row)).structure
    }

    fn of(rows: &[bool], max_rim_multiplications: f64) -> Changes<'_> {
        Changes { rows, max_rim_multiplications }
    }

    #[test]
    fn what_changes_comes_last_and_the_order_is_a_permutation() {
        let graph = grid(20);
        let changes: Vec<bool> = (0..400).map(|v| v % 20 < 4).collect();
        let mut order = kept_first(&graph, None, of(&changes, 2e3)).expect("METIS orders a grid");
        assert!(order[..320].iter().all(|&v| !changes[v as usize]));
        order.sort_unstable();
        assert!(order.into_iter().eq(0..400));
        // The rim is a column of 20: 1333 multiply-adds.
        assert!(kept_first(&graph, None, of(&changes, 1e3)).is_none());
    }

    #[test]
    fn a_rim_is_what_changes_next_to_a_connected_part() {
        // Columns 9 and 10 change: two parts, left and right of them.
        let changes: Vec<bool> = (0..400).map(|v| v % 20 == 9 || v % 20 == 10).collect();
        let rims = rims(&grid(20), &changes);
        let column = |x: u32| (0..20).map(|y| 20 * y + x).collect::<Vec<u32>>();
        assert_eq!(rims, [column(9), column(10)]);
    }

    #[test]
    fn one_part_alone_has_no_order() {
        let graph = grid(8);
        assert!(kept_first(&graph, None, of(&[false; 64], 1e9)).is_none());
        assert!(kept_first(&graph, None, of(&[true; 64], 1e9)).is_none());
    }
}

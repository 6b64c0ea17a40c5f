//! Nested dissection of a coarser graph, lifted to the unknowns of a matrix.
//!
//! The functions of quadratic elements belong to vertices and edges, but what separates two parts of the mesh is a set of
//! vertices. Every unknown has *hosts*: the vertex or the two ends of its edge, in its component where components do not
//! couple. A function lives on the tetrahedra around its edge, so that one with a host inside a part touches that part and its
//! separators alone: it is eliminated with the first eliminated of its hosts. The graph of the hosts has a seventh of the
//! vertices of the matrix graph and a fortieth of its edges, and costs METIS accordingly, for about the same fill.

use fluxmorph_petsc::metis;

use super::csr::CsrStructure;
use super::kept_first::{Changes, kept_first};
use super::ordering::inverse_permutation;

/// The hosts of every unknown.
#[derive(Clone, Debug)]
pub struct Hosts {
    count: usize,
    /// One host twice, or two; shape `(n_unknowns, 2)`.
    of: Vec<[u32; 2]>,
}

impl Hosts {
    /// From one host twice or two hosts of every unknown, under any numbers; those without an unknown are left out.
    pub fn new(mut of: Vec<[u32; 2]>) -> Self {
        let mut numbers: Vec<u32> = of.iter().flatten().copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        for host in of.iter_mut().flatten() {
            *host = numbers.binary_search(host).expect("it was collected") as u32;
        }
        Self { count: numbers.len(), of }
    }

    /// The different hosts of an unknown.
    fn of(&self, unknown: usize) -> impl Iterator<Item = u32> + '_ {
        let [first, second] = self.of[unknown];
        std::iter::once(first).chain((second != first).then_some(second))
    }

    /// The unknowns of every host, as rows of a pattern.
    fn unknowns(&self) -> CsrStructure {
        let mut row_starts = vec![0u32; self.count + 1];
        for host in (0..self.of.len()).flat_map(|unknown| self.of(unknown)) {
            row_starts[host as usize + 1] += 1;
        }
        for host in 0..self.count {
            row_starts[host + 1] += row_starts[host];
        }
        let mut next = row_starts.clone();
        let mut columns = vec![0u32; row_starts[self.count] as usize];
        for unknown in 0..self.of.len() {
            for host in self.of(unknown) {
                let place = &mut next[host as usize];
                columns[*place as usize] = unknown as u32;
                *place += 1;
            }
        }
        CsrStructure { column_count: self.of.len(), row_starts, columns }
    }

    /// Which hosts are coupled: those of coupled unknowns.
    fn graph(&self, matrix: &CsrStructure, unknowns: &CsrStructure) -> CsrStructure {
        let mut row_starts = vec![0u32];
        let mut columns = Vec::new();
        // The last host that a host was found to be coupled to.
        let mut seen = vec![u32::MAX; self.count];
        for host in 0..self.count {
            let first = columns.len();
            for &unknown in &unknowns.columns[unknowns.row(host)] {
                for &other in &matrix.columns[matrix.row(unknown as usize)] {
                    for coupled in self.of(other as usize) {
                        if std::mem::replace(&mut seen[coupled as usize], host as u32) != host as u32 {
                            columns.push(coupled);
                        }
                    }
                }
            }
            columns[first..].sort_unstable();
            row_starts.push(columns.len() as u32);
        }
        CsrStructure { column_count: self.count, row_starts, columns }
    }
}

/// Nested dissection of the hosts, each counting as many as it hosts, lifted to the unknowns; not postordered,
/// `forward[new] = old`. With `changes` hosts of unknowns that do not change come first. `None` where METIS refuses, or
/// there is no such order.
pub fn lifted_dissection(
    matrix: &CsrStructure,
    hosts: &Hosts,
    changes: Option<Changes<'_>>,
) -> Option<Vec<u32>> {
    let unknowns = hosts.unknowns();
    let graph = hosts.graph(matrix, &unknowns);
    let weights: Vec<i32> = (0..hosts.count).map(|host| unknowns.row(host).len() as i32).collect();
    let order = match changes {
        None => metis::nested_dissection(&graph.row_starts, &graph.columns, Some(weights))?,
        Some(changes) => {
            let of_host =
                |host| unknowns.columns[unknowns.row(host)].iter().any(|&u| changes.rows[u as usize]);
            let rows: Vec<bool> = (0..hosts.count).map(of_host).collect();
            kept_first(&graph, Some(&weights), Changes { rows: &rows, ..changes })?
        }
    };
    let position = inverse_permutation(&order);
    let eliminated_with = |&unknown: &u32| {
        let [first, second] = hosts.of[unknown as usize].map(|host| position[host as usize]);
        // The middle of an edge couples with fewer than its end does.
        (first.min(second), first == second)
    };
    let mut forward: Vec<u32> = (0..hosts.of.len() as u32).collect();
    forward.sort_by_key(eliminated_with);
    Some(forward)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::fem::csr::CsrMatrix;
    use crate::fem::{LdltAnalysis, ordering};

    /// Quadratic elements on a chain of `n` intervals: vertex `i` is unknown `2 i`, the middle of interval `i` is `2 i + 1`.
    fn chain(n: usize) -> (Arc<CsrStructure>, Hosts) {
        let last = 2 * n;
        let row = |i: usize| {
            let (low, high) = if i.is_multiple_of(2) { (i.saturating_sub(2), i + 2) } else { (i - 1, i + 1) };
            (low..=high.min(last)).map(|c| (c, 0.0)).collect::<Vec<_>>()
        };
        let matrix = CsrMatrix::from_rows(last + 1, (0..=last).map(row));
        (matrix.structure, Hosts::new((0..=last as u32).map(|i| [i / 2, i.div_ceil(2)]).collect()))
    }

    #[test]
    fn hosts_are_coupled_where_their_unknowns_are() {
        let (matrix, hosts) = chain(4);
        let graph = hosts.graph(&matrix, &hosts.unknowns());
        let rows: Vec<&[u32]> = (0..5).map(|host| &graph.columns[graph.row(host)]).collect();
        assert_eq!(rows, [&[0, 1][..], &[0, 1, 2], &[1, 2, 3], &[2, 3, 4], &[3, 4]]);
    }

    #[test]
    fn a_lifted_order_is_a_permutation_without_more_fill_than_the_matrix_graph_gives() {
        let (matrix, hosts) = chain(400);
        let lifted = lifted_dissection(&matrix, &hosts, None).expect("METIS orders a chain");
        let mut sorted = lifted.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..801));
        let entries = |order| LdltAnalysis::new(&matrix, Some(order)).expect("a pattern").factor_entries();
        let own = ordering::dissection(&matrix).expect("METIS orders a chain");
        // A chain has a factor without fill; separators of one vertex keep it below twice that.
        let (lifted, own) = (entries(lifted) as f64, entries(own) as f64);
        assert!(lifted <= 1.2 * own, "{lifted} {own}");
    }

    #[test]
    fn numbers_without_an_unknown_are_no_hosts() {
        let hosts = Hosts::new(vec![[7, 7], [7, 40], [9, 40]]);
        assert_eq!((hosts.count, hosts.of(0).collect::<Vec<_>>()), (3, vec![0]));
        assert_eq!(hosts.of(2).collect::<Vec<_>>(), [1, 2]);
    }
}

//! The pattern of an incomplete factor: the order of elimination, and its independent parts.
//!
//! Breadth-first levels of the matrix graph (as in Cuthill and McKee, Proc. 24th ACM Nat. Conf. (1969) 157) touch only
//! their neighbouring levels. Some of them are chosen as *separators*; what lies between two separators is a *slab*. No slab
//! touches another slab, and no separator another separator: all slabs are eliminated at once, and then all separators.
//! Their number follows from the size of the system alone, never from the threads there are.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::fem::csr::CsrStructure;
use crate::fem::ordering;
use crate::fem::strong_sets::StrongSets;

/// Rows a slab should have at least: below, a parallel task costs more than it brings.
const ROWS_PER_SLAB: usize = 4096;
/// Most slabs: enough to balance a handful of threads; every further separator costs iterations.
const MOST_SLABS: usize = 16;

/// Order of elimination and lower pattern of an incomplete factor, from the pattern of the matrix alone.
#[derive(Debug)]
pub struct IncompleteAnalysis {
    pub(super) structure: Arc<CsrStructure>,
    /// `order[new] = old`: slabs, then separators.
    pub(super) order: Vec<u32>,
    /// `inverse[old] = new`.
    pub(super) inverse: Vec<u32>,
    /// Rows of each slab, in the new order; the separator `t` lies between the slabs `t` and `t + 1`.
    pub(super) slabs: Vec<Range<usize>>,
    /// Rows of each separator.
    pub(super) separators: Vec<Range<usize>>,
    /// Start of each row of the strictly lower triangle in `columns`; shape `(n + 1)`.
    pub(super) row_starts: Vec<u32>,
    /// Columns of the strictly lower triangle, ascending within a row.
    pub(super) columns: Vec<u32>,
    /// In every row of a separator, the entries where the columns of its second slab and its own columns start.
    pub(super) splits: Vec<[u32; 2]>,
}

impl IncompleteAnalysis {
    /// Analyses a structurally symmetric pattern with a full diagonal; the order is that of the matrix, in one part.
    pub fn new(structure: &Arc<CsrStructure>) -> Arc<Self> {
        let n = structure.row_count();
        Self::with_parts(
            structure,
            Parts {
                order: (0..n as u32).collect(),
                slabs: std::iter::once(0..n).collect(),
                separators: Vec::new(),
            },
        )
    }

    /// Analyses a structurally symmetric pattern with a full diagonal, for several threads. `strong(row, k)` says whether the
    /// stored entry `k` of `row` couples strongly; it must be symmetric.
    ///
    /// A separator that cuts strong couplings doubles the iterations on skin-graded meshes, so rows that are coupled strongly
    /// stay together. Couplings above a quarter of the diagonal are those of the cells much thinner than wide.
    pub fn in_parts(structure: &Arc<CsrStructure>, strong: impl Fn(usize, usize) -> bool) -> Arc<Self> {
        Self::with_parts(structure, parts(structure, &StrongSets::new(structure, strong)))
    }

    fn with_parts(structure: &Arc<CsrStructure>, parts: Parts) -> Arc<Self> {
        let n = structure.row_count();
        let Parts { order, slabs, separators } = parts;
        let inverse = ordering::inverse_permutation(&order);
        let lower: Vec<Vec<u32>> = order
            .par_iter()
            .enumerate()
            .map(|(new, &old)| {
                let row = &structure.columns[structure.row(old as usize)];
                let mut lower: Vec<u32> =
                    row.iter().map(|&c| inverse[c as usize]).filter(|&c| (c as usize) < new).collect();
                lower.sort_unstable();
                lower
            })
            .collect();
        let mut row_starts = Vec::with_capacity(n + 1);
        row_starts.push(0u32);
        let mut columns = Vec::with_capacity(lower.iter().map(Vec::len).sum());
        for row in lower {
            columns.extend(row);
            row_starts.push(columns.len() as u32);
        }
        let interior = slabs.last().map_or(0, |slab| slab.end);
        let mut splits = Vec::with_capacity(n - interior);
        for (t, separator) in separators.iter().enumerate() {
            for row in separator.clone() {
                let (first, last) = (row_starts[row] as usize, row_starts[row + 1] as usize);
                let below =
                    |limit: usize| first + columns[first..last].partition_point(|&c| (c as usize) < limit);
                splits.push([below(slabs[t + 1].start) as u32, below(interior) as u32]);
            }
        }
        let structure = Arc::clone(structure);
        Arc::new(Self { structure, order, inverse, slabs, separators, row_starts, columns, splits })
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.order.len()
    }

    /// Entries of the strictly lower triangle of a factor.
    pub fn entry_count(&self) -> usize {
        self.columns.len()
    }

    /// Memory of this analysis and of one factor with entries of type `T` [bytes].
    pub fn bytes<T>(&self) -> usize {
        self.columns.len() * (size_of::<u32>() + size_of::<T>())
            + self.size() * (3 * size_of::<u32>() + 2 * size_of::<T>())
            + size_of_val(self.splits.as_slice())
    }

    /// Rows that belong to a slab; the rest is in separators.
    pub(super) fn interior(&self) -> usize {
        self.slabs.last().map_or(0, |slab| slab.end)
    }

    /// Entries of the strictly lower triangle in a range of rows.
    pub(super) fn entries(&self, rows: &Range<usize>) -> Range<usize> {
        self.row_starts[rows.start] as usize..self.row_starts[rows.end] as usize
    }
}

/// An order of elimination and its independent parts.
struct Parts {
    order: Vec<u32>,
    slabs: Vec<Range<usize>>,
    separators: Vec<Range<usize>>,
}

/// Cuts the levels of a graph into slabs with about equally many rows, and separators of one level each.
fn parts(structure: &CsrStructure, sets: &StrongSets) -> Parts {
    let n = structure.row_count();
    let level = levels(structure, sets);
    let level_count = level.iter().max().map_or(0, |&last| last as usize + 1);
    let mut sizes = vec![0usize; level_count];
    for &l in &level {
        sizes[l as usize] += 1;
    }
    let wanted = (n / ROWS_PER_SLAB).clamp(1, MOST_SLABS);
    // Part of every level: slabs are even, the separator behind a slab is odd.
    let mut part_of_level = vec![0usize; level_count];
    let (mut part, mut done) = (0, 0);
    for l in 0..level_count {
        let due = done * wanted >= n * (part / 2 + 1);
        if due && l + 1 < level_count && l > 0 && part_of_level[l - 1] == part {
            part_of_level[l] = part + 1;
            part += 2;
        } else {
            part_of_level[l] = part;
        }
        done += sizes[l];
    }
    let part_count = if n == 0 { 0 } else { part + 1 };
    let mut rows: Vec<Vec<u32>> = vec![Vec::new(); part_count];
    for row in 0..n {
        rows[part_of_level[level[row] as usize]].push(row as u32);
    }
    let mut order = Vec::with_capacity(n);
    let mut append = |rows: &[u32]| {
        let start = order.len();
        order.extend_from_slice(rows);
        start..order.len()
    };
    let slabs = rows.iter().step_by(2).map(|rows| append(rows)).collect();
    let separators = rows.iter().skip(1).step_by(2).map(|rows| append(rows)).collect();
    Parts { order, slabs, separators }
}

/// Distance of every row from the start of its connected component, in steps from set to set.
fn levels(structure: &CsrStructure, sets: &StrongSets) -> Vec<u32> {
    let count = sets.count();
    let mut level = vec![u32::MAX; count];
    let mut queue = Vec::with_capacity(count);
    let mut scratch = vec![u32::MAX; count];
    for set in 0..count {
        if level[set] != u32::MAX {
            continue;
        }
        // The last set that is reached is far out: levels from there are many and narrow.
        queue.clear();
        spread(structure, sets, set, &mut scratch, &mut queue);
        let start = queue.last().map_or(set, |&last| last as usize);
        queue.clear();
        spread(structure, sets, start, &mut level, &mut queue);
    }
    (0..structure.row_count()).map(|row| level[sets.of(row)]).collect()
}

/// Breadth-first search from one set; `queue` gets the sets in the order in which they are reached.
fn spread(
    structure: &CsrStructure,
    sets: &StrongSets,
    start: usize,
    level: &mut [u32],
    queue: &mut Vec<u32>,
) {
    level[start] = 0;
    queue.push(start as u32);
    let mut next = 0;
    while let Some(&set) = queue.get(next) {
        next += 1;
        for &row in sets.rows(set as usize) {
            for &c in &structure.columns[structure.row(row as usize)] {
                let other = sets.of(c as usize);
                if level[other] == u32::MAX {
                    level[other] = level[set as usize] + 1;
                    queue.push(other as u32);
                }
            }
        }
    }
}

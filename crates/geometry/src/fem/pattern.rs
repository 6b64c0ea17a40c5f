//! The sparsity pattern: which components at which carriers are coupled, from topology and couplings alone.
//!
//! Elements come in groups of one shape (tetrahedra, triangles …), each element with the [`Coupling`] of components
//! that it can produce. An entry is stored where at least one element couples it: never by looking at values, so that
//! the pattern does not change while the mesh moves. The stored components of carrier `a` against carrier `b` are a *block*.

use std::sync::Arc;

use rayon::prelude::*;

use crate::fem::csr::CsrStructure;
use crate::fem::dofs::DofMap;
use crate::fem::scalar::Scalar;
use crate::ids::{CarrierId, ElementId};
use crate::incidence::Incidence;

/// Carriers of one assembly task at least: a smaller one is not worth the elements on its border, which are computed twice.
const CARRIERS_PER_TASK: usize = 2048;
/// Tasks a thread: enough to even out their cost. The bits do not depend on the tasks, so the number of threads may
/// decide.
const TASKS_PER_THREAD: usize = 4;

/// A set of component pairs `(row i, column j)` of a block with up to four components a carrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coupling(u16);

impl Coupling {
    /// No pair.
    pub const NONE: Self = Self(0);

    /// This set and the pair `(i, j)`, `i, j < 4`.
    pub const fn with(self, i: usize, j: usize) -> Self {
        assert!(i < 4 && j < 4, "a block has at most four components");
        Self(self.0 | 1 << (4 * i + j))
    }

    /// All pairs of the first `n` components.
    pub const fn full(n: usize) -> Self {
        let mut set = Self::NONE;
        let mut i = 0;
        while i < n {
            let mut j = 0;
            while j < n {
                set = set.with(i, j);
                j += 1;
            }
            i += 1;
        }
        set
    }

    /// Each of the first `n` components with itself.
    pub const fn diagonal(n: usize) -> Self {
        let mut set = Self::NONE;
        let mut i = 0;
        while i < n {
            set = set.with(i, i);
            i += 1;
        }
        set
    }

    /// Pairs in either set.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The pairs whose row bit and column bit are set.
    fn restrict(self, rows: u16, columns: u16) -> Self {
        let mut bits = 0;
        for i in 0..4 {
            if rows >> i & 1 == 1 {
                bits |= self.0 & (columns & 0xf) << (4 * i);
            }
        }
        Self(bits)
    }

    /// Columns coupled with row `i`, as bits.
    #[inline]
    fn row(self, i: usize) -> u16 {
        self.0 >> (4 * i) & 0xf
    }
}

/// Elements of one shape with `N` carriers, and what each couples.
#[derive(Clone, Debug)]
pub struct ElementGroup<const N: usize> {
    connectivity: Vec<[CarrierId; N]>,
    couplings: Vec<Coupling>,
    incidence: Incidence,
}

impl<const N: usize> ElementGroup<N> {
    /// A group on `carrier_count` carriers; one coupling per element.
    ///
    /// # Panics
    /// If the lengths differ or a carrier is out of range.
    pub fn new<I: Into<CarrierId>>(
        carrier_count: usize,
        connectivity: Vec<[I; N]>,
        couplings: Vec<Coupling>,
    ) -> Self {
        assert_eq!(connectivity.len(), couplings.len(), "one coupling an element");
        let connectivity: Vec<[CarrierId; N]> =
            connectivity.into_iter().map(|of| of.map(Into::into)).collect();
        let incidence = Incidence::new(carrier_count, &connectivity);
        Self { connectivity, couplings, incidence }
    }
}

/// What the pattern asks of a group of elements of any shape.
trait Couples: Sync {
    /// Appends every carrier that elements of the group couple with `carrier`, and how; carriers may repeat.
    fn couple(&self, carrier: CarrierId, row: &mut Vec<(CarrierId, Coupling)>);
}

impl<const N: usize> Couples for ElementGroup<N> {
    fn couple(&self, carrier: CarrierId, row: &mut Vec<(CarrierId, Coupling)>) {
        for e in self.incidence.around(carrier) {
            let coupling = self.couplings[e.index()];
            row.extend(self.connectivity[e.index()].iter().map(|&other| (other, coupling)));
        }
    }
}

/// The stored components of one carrier against another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    carrier: CarrierId,
    coupling: Coupling,
    /// Entries of each row that come before this block.
    before: [u16; 4],
    /// Entries of each row that come before the one of the same component, or [`NO_ENTRY`].
    diagonal: [u16; 3],
}

/// An entry that is not stored.
const NO_ENTRY: u16 = u16::MAX;

/// Where the rows of a carrier start, counted from the first entry of a task; meaningless for what is not an unknown.
pub(super) type RowStarts = [usize; 4];

/// Sparsity pattern of a system with `C ≤ 4` components a carrier.
#[derive(Debug)]
pub struct BlockPattern<const C: usize> {
    rows: DofMap<C>,
    structure: Arc<CsrStructure>,
    block_starts: Vec<u32>,
    blocks: Vec<Block>,
    /// Carriers of each assembly task.
    pub(super) tasks: Vec<std::ops::Range<usize>>,
}

impl<const C: usize> BlockPattern<C> {
    /// The pattern of the square system in the unknowns `dofs`, from tetrahedra and boundary triangles.
    pub fn symmetric<const N: usize, const M: usize>(
        dofs: &DofMap<C>,
        volumes: &ElementGroup<N>,
        surfaces: &ElementGroup<M>,
    ) -> Self {
        Self::of_rows(dofs, dofs, volumes, surfaces)
    }

    /// The pattern of some rows of that system: `rows` has the unknowns of some carriers only, `columns` all.
    pub fn of_rows<const N: usize, const M: usize>(
        rows: &DofMap<C>,
        columns: &DofMap<C>,
        volumes: &ElementGroup<N>,
        surfaces: &ElementGroup<M>,
    ) -> Self {
        Self::new(rows, columns, &[volumes, surfaces])
    }

    /// The pattern of a rectangular part: rows in the unknowns `rows`, columns in those of `columns`.
    pub fn rectangular<const N: usize>(
        rows: &DofMap<C>,
        columns: &DofMap<C>,
        volumes: &ElementGroup<N>,
    ) -> Self {
        Self::new(rows, columns, &[volumes])
    }

    fn new(rows: &DofMap<C>, columns: &DofMap<C>, groups: &[&dyn Couples]) -> Self {
        let carrier_count = rows.carrier_count();
        let row_blocks: Vec<Vec<Block>> = (0..carrier_count)
            .into_par_iter()
            .map_init(Vec::new, |found, a| blocks_of(CarrierId::new(a), rows, columns, groups, found))
            .collect();

        let mut row_starts = vec![0u32];
        let mut column_indices = Vec::new();
        let mut block_starts = vec![0u32];
        let mut blocks = Vec::with_capacity(row_blocks.iter().map(Vec::len).sum());
        for (a, row) in row_blocks.into_iter().enumerate() {
            for i in 0..C {
                if rows.equation(CarrierId::new(a), i).is_none() {
                    continue;
                }
                for block in &row {
                    let coupled = block.coupling.row(i);
                    column_indices.extend(
                        (0..C)
                            .filter(|j| coupled >> j & 1 == 1)
                            .filter_map(|j| columns.equation(block.carrier, j))
                            .map(|equation| equation as u32),
                    );
                }
                let end = u32::try_from(column_indices.len()).expect("fewer than 2³² stored entries");
                row_starts.push(end);
            }
            blocks.extend(row);
            block_starts.push(u32::try_from(blocks.len()).expect("fewer than 2³² blocks"));
        }
        let structure =
            Arc::new(CsrStructure { column_count: columns.count(), row_starts, columns: column_indices });
        let most = TASKS_PER_THREAD * rayon::current_num_threads();
        let task_count = (carrier_count / CARRIERS_PER_TASK).clamp(1, most);
        let tasks = (0..task_count)
            .map(|t| t * carrier_count / task_count..(t + 1) * carrier_count / task_count)
            .collect();
        Self { rows: rows.clone(), structure, block_starts, blocks, tasks }
    }

    /// The structure of the scalar matrix.
    pub fn structure(&self) -> &Arc<CsrStructure> {
        &self.structure
    }

    /// The equation numbers of the rows.
    pub fn rows(&self) -> &DofMap<C> {
        &self.rows
    }

    /// Finds the block of every pair of carriers of every element, once for all assemblies.
    ///
    /// # Panics
    /// If the group was not among those the pattern was made of.
    pub fn bind<const N: usize>(&self, group: &ElementGroup<N>) -> BoundGroup<N> {
        let block_of = |a: CarrierId, b: CarrierId| {
            let row = self.blocks_at(a);
            row.binary_search_by_key(&b, |block| block.carrier).map_or(NO_BLOCK, |p| p as u16)
        };
        let blocks = group
            .connectivity
            .par_iter()
            .map(|carriers| {
                std::array::from_fn(|a| std::array::from_fn(|b| block_of(carriers[a], carriers[b])))
            })
            .collect();
        let elements = self
            .tasks
            .par_iter()
            .map(|carriers| {
                let mut touched: Vec<ElementId> = carriers
                    .clone()
                    .flat_map(|a| group.incidence.around(CarrierId::new(a)))
                    .copied()
                    .collect();
                touched.sort_unstable();
                touched.dedup();
                touched
            })
            .collect();
        BoundGroup { connectivity: group.connectivity.clone(), blocks, elements }
    }

    pub(super) fn blocks_at(&self, carrier: CarrierId) -> &[Block] {
        let i = carrier.index();
        &self.blocks[self.block_starts[i] as usize..self.block_starts[i + 1] as usize]
    }

    /// Where the rows of a carrier start, counted from the entry `first`.
    #[inline]
    pub(super) fn row_starts_of(&self, carrier: CarrierId, first: usize) -> RowStarts {
        let mut starts = [0; 4];
        for (i, start) in starts.iter_mut().enumerate().take(C) {
            if let Some(equation) = self.rows.equation(carrier, i) {
                *start = self.structure.row_starts[equation] as usize - first;
            }
        }
        starts
    }

    /// The block at a position among those of a carrier.
    #[inline]
    pub(super) fn block(&self, carrier: CarrierId, position: u16) -> Option<&Block> {
        if position == NO_BLOCK {
            return None;
        }
        self.blocks.get(self.block_starts[carrier.index()] as usize + position as usize)
    }

    /// Range of the stored entries of the rows of a range of carriers.
    pub(super) fn entries_of(&self, carriers: &std::ops::Range<usize>) -> std::ops::Range<usize> {
        let first_equation_from = |start: usize| {
            (start..self.rows.carrier_count())
                .flat_map(|a| (0..C).map(move |c| (a, c)))
                .find_map(|(a, c)| self.rows.equation(CarrierId::new(a), c))
                .unwrap_or(self.rows.count())
        };
        let start = self.structure.row_starts[first_equation_from(carriers.start)] as usize;
        let end = self.structure.row_starts[first_equation_from(carriers.end)] as usize;
        start..end
    }
}

impl Block {
    /// Adds `entry(i, j)` to every stored entry; `values` are those of a task, `rows` the starts in them.
    #[inline]
    pub(super) fn add<T: Scalar>(
        &self,
        rows: &RowStarts,
        values: &mut [T],
        entry: impl Fn(usize, usize) -> T,
    ) {
        for i in 0..4 {
            let mut coupled = self.coupling.row(i);
            if coupled == 0 {
                continue;
            }
            let mut slot = rows[i] + self.before[i] as usize;
            while coupled != 0 {
                values[slot] += entry(i, coupled.trailing_zeros() as usize);
                slot += 1;
                coupled &= coupled - 1;
            }
        }
    }

    /// Adds a real number to the entries of the first three components against themselves.
    #[inline]
    pub(super) fn add_scalar<T: Scalar>(&self, rows: &RowStarts, values: &mut [T], scalar: f64) {
        for (row, &before) in rows.iter().zip(&self.diagonal) {
            if before != NO_ENTRY {
                values[row + before as usize].add_real(scalar);
            }
        }
    }
}

/// A pair of carriers of which nothing is stored.
const NO_BLOCK: u16 = u16::MAX;

/// A group of elements with the places of its blocks in one pattern.
#[derive(Debug)]
pub struct BoundGroup<const N: usize> {
    pub(super) connectivity: Vec<[CarrierId; N]>,
    pub(super) blocks: Vec<[[u16; N]; N]>,
    /// Elements that touch the carriers of each task.
    pub(super) elements: Vec<Vec<ElementId>>,
}

impl<const N: usize> BoundGroup<N> {
    /// Carriers of an element of the group.
    #[inline]
    pub fn carriers_of(&self, e: ElementId) -> [CarrierId; N] {
        self.connectivity[e.index()]
    }
}

/// The blocks of one carrier, ascending by carrier.
fn blocks_of<const C: usize>(
    a: CarrierId,
    rows: &DofMap<C>,
    columns: &DofMap<C>,
    groups: &[&dyn Couples],
    found: &mut Vec<(CarrierId, Coupling)>,
) -> Vec<Block> {
    let row_bits = rows.unknown_bits(a);
    if row_bits == 0 {
        return Vec::new();
    }
    found.clear();
    for group in groups {
        group.couple(a, found);
    }
    found.sort_unstable_by_key(|&(carrier, _)| carrier);
    let mut blocks = Vec::new();
    let mut before = [0u16; 4];
    for same in found.chunk_by(|x, y| x.0 == y.0) {
        let carrier = same[0].0;
        let coupling = same
            .iter()
            .fold(Coupling::NONE, |set, &(_, c)| set.union(c))
            .restrict(row_bits, columns.unknown_bits(carrier));
        if coupling == Coupling::NONE {
            continue;
        }
        let diagonal = std::array::from_fn(|i| {
            let row = coupling.row(i);
            let lower = row & ((1 << i) - 1);
            if row >> i & 1 == 1 { before[i] + lower.count_ones() as u16 } else { NO_ENTRY }
        });
        blocks.push(Block { carrier, coupling, before, diagonal });
        for (i, before) in before.iter_mut().enumerate() {
            *before += coupling.row(i).count_ones() as u16;
        }
        // Four more entries would have to be counted after the last block.
        assert!(before.iter().all(|&b| b < NO_ENTRY - 4), "fewer than 65531 entries a row");
    }
    assert!(blocks.len() < NO_BLOCK as usize, "fewer than 65535 neighbours a carrier");
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn couplings_are_sets_of_component_pairs() {
        let set = Coupling::diagonal(3).with(0, 3);
        assert_eq!(set.row(0), 0b1001);
        assert_eq!(set.row(3), 0);
        assert_eq!(Coupling::full(4), Coupling(u16::MAX));
        assert_eq!(set.restrict(0b0001, 0b1111), Coupling::NONE.with(0, 0).with(0, 3));
        assert_eq!(set.restrict(0b1111, 0b0100), Coupling::NONE.with(2, 2));
    }
}

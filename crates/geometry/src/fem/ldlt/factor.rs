//! The numeric factorisation: every panel gathers what the panels before it change, then is factored.
//!
//! Panel `s` with the columns `J` and rows `R ⊇ J`, from its descendants `d`:
//! `A[R, J] − Σ_d L_d[R, :] D_d L_d[J, :]ᵀ`, in ascending order of `d`; then `L_s D_s L_sᵀ` of the square on top and
//! `X ← X L_s⁻ᵀ D_s⁻¹` of the rows below. The rows are cut into tiles of fixed size that gather without each other. A panel that
//! another factor has of the same matrix entries, and of panels that it has as well, is taken over from there.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use faer::mat::{MatMut, MatRef};
use faer::prelude::{Reborrow, ReborrowMut};

use super::analysis::LdltAnalysis;
use super::dense;
use super::multiply::{Packing, Shape, Store, multiply};
use super::panels::Update;
use super::scalar::PanelScalar;
use super::schedule::{Branch, Task, for_each_in_parallel, indices_in_parallel};
use crate::error::MeshError;
use crate::fem::workspace;

/// Rows of a tile. Every tile reads the columns' rows of an update again, each from another page of memory: tiles of half the
/// size cost up to a fifth of the time, larger ones leave too few of them to work on at the same time.
const TILE_ROWS: usize = 512;

/// The values of a matrix: `entry(row, k)` is the stored entry `k` of the structure, which lies in `row`.
pub type Entry<'a, T> = dyn Fn(usize, usize) -> T + Sync + 'a;

/// A numeric factor `P A Pᵀ = L D Lᵀ`.
#[derive(Debug)]
pub struct Ldlt<T> {
    pub(super) analysis: Arc<LdltAnalysis>,
    pub(super) panels: Vec<Arc<FactoredPanel<T>>>,
}

impl<T> Ldlt<T> {
    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.analysis.size()
    }

    /// Memory of the factor [bytes], without the analysis.
    pub fn bytes(&self) -> usize {
        let of_panel = |panel: &Arc<FactoredPanel<T>>| {
            let FactoredPanel { entries, pivots, inverse_pivots, assembled } = &**panel;
            entries.capacity() + pivots.capacity() + inverse_pivots.capacity() + assembled.capacity()
        };
        let numbers: usize = self.panels.iter().map(of_panel).sum();
        numbers * size_of::<T>()
            + self.panels.len() * (size_of::<Arc<FactoredPanel<T>>>() + size_of::<FactoredPanel<T>>())
    }

    /// The factor, if its matrix is positive definite: if all pivots are positive.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] at the first pivot that is not.
    pub(super) fn of_positive_definite(self) -> Result<Self, MeshError>
    where
        T: PanelScalar + PartialOrd,
    {
        let pivots = self.panels.iter().flat_map(|panel| &panel.pivots);
        let lost = self.analysis.order.iter().zip(pivots).find(|&(_, &pivot)| pivot <= T::default());
        let failed = |(unknown, pivot)| MeshError::Factorisation {
            unknowns: self.size(),
            cause: format!("the pivot of unknown {unknown} is {pivot}: the matrix is not positive definite"),
        };
        match lost.map(failed) {
            Some(error) => Err(error),
            None => Ok(self),
        }
    }

    /// What the factor of another matrix may begin with: the panels that the analysis says are kept, if it has some.
    pub fn kept(&self) -> Option<KeptPanels<T>> {
        let analysis = &self.analysis;
        let of = |p: usize| analysis.is_kept(p).then(|| Arc::clone(&self.panels[p]));
        let panels = || (0..self.panels.len()).map(of).collect();
        analysis.keeps_a_part().then(|| KeptPanels { analysis: Arc::clone(analysis), panels: panels() })
    }
}

/// Panels of a factor that others of the same analysis may have, too.
#[derive(Debug)]
pub struct KeptPanels<T> {
    analysis: Arc<LdltAnalysis>,
    pub(super) panels: Vec<Option<Arc<FactoredPanel<T>>>>,
}

impl<T> KeptPanels<T> {
    /// Whether a factor of this analysis may have them.
    pub fn are_of(&self, analysis: &Arc<LdltAnalysis>) -> bool {
        Arc::ptr_eq(&self.analysis, analysis)
    }

    /// How many of them a factor has.
    pub fn found_in(&self, factor: &Ldlt<T>) -> usize {
        let is_found = |(kept, own): &(&Option<Arc<_>>, &Arc<_>)| {
            kept.as_ref().is_some_and(|kept| Arc::ptr_eq(kept, own))
        };
        self.panels.iter().zip(&factor.panels).filter(is_found).count()
    }
}

/// The work of [`Ldlt::new`].
pub(super) fn factor<T: PanelScalar>(
    analysis: &Arc<LdltAnalysis>,
    entry: &Entry<'_, T>,
    kept: Option<&KeptPanels<T>>,
) -> Result<Ldlt<T>, MeshError> {
    let count = analysis.panels.len();
    workspace::check(analysis.factor_entries() * size_of::<T>())
        .map_err(|cause| MeshError::Factorisation { unknowns: analysis.size(), cause })?;
    let factorisation = Factorisation {
        analysis,
        entry,
        kept: kept.filter(|kept| kept.are_of(analysis)),
        panels: (0..count).map(|_| OnceLock::new()).collect(),
        workspaces: Mutex::new(Vec::new()),
    };
    factorisation.branch(&analysis.tasks)?;
    let finished =
        |panel: OnceLock<Finished<T>>| panel.into_inner().expect("every panel belongs to a task").panel;
    let panels = factorisation.panels.into_iter().map(finished).collect();
    Ok(Ldlt { analysis: Arc::clone(analysis), panels })
}

/// A finished panel.
#[derive(Debug)]
pub(super) struct FactoredPanel<T> {
    /// The rectangle, column-major.
    pub(super) entries: Vec<T>,
    /// `D` once more: on the diagonal of the entries every pivot is a cache line of its own.
    pivots: Vec<T>,
    /// `1 / D`.
    pub(super) inverse_pivots: Vec<T>,
    /// What the matrix has in its columns on and below the diagonal, where the panel may be kept.
    assembled: Vec<T>,
}

/// A panel of this factor.
struct Finished<T> {
    panel: Arc<FactoredPanel<T>>,
    /// Whether it was found, and not computed.
    is_found: bool,
}

/// Scratch memory of one thread.
struct Workspace<T: PanelScalar> {
    /// Position in the panel at work of every row of the matrix that it has; other entries are left from other panels.
    position: Vec<u32>,
    tile: TileScratch<T>,
}

struct TileScratch<T: PanelScalar> {
    /// Where the rows of an update go.
    pieces: Vec<Piece>,
    /// `L_d[J, :] D_d`.
    scaled: Vec<T>,
    product: Vec<T>,
    packing: Packing<T>,
}

struct Factorisation<'a, T: PanelScalar> {
    analysis: &'a LdltAnalysis,
    entry: &'a Entry<'a, T>,
    kept: Option<&'a KeptPanels<T>>,
    panels: Vec<OnceLock<Finished<T>>>,
    workspaces: Mutex<Vec<Workspace<T>>>,
}

/// How the tiles of a panel are gathered.
#[derive(Clone, Copy)]
enum Tiles {
    InOrder,
    InParallel,
}

impl<T: PanelScalar> Factorisation<'_, T> {
    /// The error of the first task that fails, whatever finishes first.
    fn branch(&self, branch: &Branch) -> Result<(), MeshError> {
        let done: Vec<OnceLock<Result<(), MeshError>>> =
            branch.tasks.iter().map(|_| OnceLock::new()).collect();
        indices_in_parallel(done.len(), &|i| {
            done[i].get_or_init(|| self.task(&branch.tasks[i]));
        });
        done.into_iter().filter_map(OnceLock::into_inner).collect::<Result<(), _>>()?;
        branch
            .chain
            .iter()
            .try_for_each(|&p| self.with_workspace(|workspace| self.panel(p, Tiles::InParallel, workspace)))
    }

    fn task(&self, task: &Task) -> Result<(), MeshError> {
        match task {
            Task::Branch(branch) => self.branch(branch),
            Task::Run(panels) => self.with_workspace(|workspace| {
                panels.clone().try_for_each(|p| self.panel(p, Tiles::InOrder, workspace))
            }),
        }
    }

    /// Lends a workspace that no one uses.
    fn with_workspace<R>(&self, work: impl FnOnce(&mut Workspace<T>) -> R) -> R {
        let lock = || self.workspaces.lock().unwrap_or_else(PoisonError::into_inner);
        let idle = lock().pop();
        let mut workspace = idle.unwrap_or_else(|| Workspace {
            position: vec![0; self.analysis.size()],
            tile: TileScratch {
                pieces: Vec::new(),
                scaled: Vec::new(),
                product: Vec::new(),
                packing: Packing::new(),
            },
        });
        let result = work(&mut workspace);
        lock().push(workspace);
        result
    }

    fn failed(&self, cause: String) -> MeshError {
        MeshError::Factorisation { unknowns: self.analysis.size(), cause }
    }

    /// The panel as another factor has it: where the matrix is the same there, and in all that changes it.
    fn found(&self, p: usize) -> Option<Arc<FactoredPanel<T>>> {
        let before = self.kept?.panels[p].as_ref()?;
        let is_found = |source: usize| self.panels[source].get().is_some_and(|source| source.is_found);
        let is_same = self.analysis.panels.updates(p).iter().all(|update| is_found(update.source as usize))
            && self.entries_of_matrix(p).map(|(_, _, value)| value).eq(before.assembled.iter().copied());
        is_same.then(|| Arc::clone(before))
    }

    fn panel(&self, p: usize, tiles: Tiles, workspace: &mut Workspace<T>) -> Result<(), MeshError> {
        let found = self.found(p);
        let is_found = found.is_some();
        let panel = match found {
            Some(found) => found,
            None => Arc::new(self.factored(p, tiles, workspace)?),
        };
        let finished = self.panels[p].set(Finished { panel, is_found });
        assert!(finished.is_ok(), "a panel belongs to one task");
        Ok(())
    }

    fn factored(
        &self,
        p: usize,
        tiles: Tiles,
        workspace: &mut Workspace<T>,
    ) -> Result<FactoredPanel<T>, MeshError> {
        let panel = self.analysis.panels.get(p);
        let rows = self.analysis.panels.rows(p);
        let (height, width) = (panel.height(), panel.width);
        let mut entries = Vec::new();
        entries
            .try_reserve_exact(height * width)
            .map_err(|_| self.failed("out of memory for the factor".to_owned()))?;
        entries.resize(height * width, T::default());
        for (i, &row) in rows.iter().enumerate() {
            workspace.position[row as usize] = i as u32;
        }
        self.assemble(p, &workspace.position, &mut entries);

        let mut block = MatMut::from_column_major_slice_mut(&mut entries, height, width);
        let position = &workspace.position;
        match tiles {
            Tiles::InParallel if height > TILE_ROWS => {
                for_each_in_parallel(tiles_of(block.rb_mut(), 0), |(first, tile)| {
                    self.with_workspace(|own| self.gather(p, first, tile, position, &mut own.tile));
                });
            }
            _ => {
                for (first, tile) in tiles_of(block.rb_mut(), 0) {
                    self.gather(p, first, tile, position, &mut workspace.tile);
                }
            }
        }

        let (mut diagonal, below) = block.split_at_row_mut(width);
        let lost = |column: usize, pivot: T| {
            let unknown = self.analysis.order[panel.start + column];
            self.failed(format!("the pivot of unknown {unknown} is {pivot}: the matrix is singular"))
        };
        let TileScratch { product, packing, .. } = &mut workspace.tile;
        dense::factor_diagonal(diagonal.rb_mut(), product, packing)
            .map_err(|column| lost(column, diagonal[(column, column)]))?;
        let diagonal = diagonal.rb();
        let inverse_pivots = (0..width)
            .map(|j| diagonal[(j, j)].inverse().ok_or_else(|| lost(j, diagonal[(j, j)])))
            .collect::<Result<Vec<T>, _>>()?;
        let pivots = (0..width).map(|j| diagonal[(j, j)]).collect();
        let divide = |tile: MatMut<'_, T>, packing: &mut Packing<T>| {
            dense::divide_by_diagonal_block(diagonal, &inverse_pivots, tile, packing);
        };
        match tiles {
            Tiles::InParallel if height > TILE_ROWS => {
                for_each_in_parallel(tiles_of(below, width), |(_, tile)| {
                    self.with_workspace(|own| divide(tile, &mut own.tile.packing));
                });
            }
            _ => tiles_of(below, width).into_iter().for_each(|(_, tile)| divide(tile, packing)),
        }
        let assembled = if self.analysis.is_kept(p) {
            self.entries_of_matrix(p).map(|(_, _, value)| value).collect()
        } else {
            Vec::new()
        };
        Ok(FactoredPanel { entries, pivots, inverse_pivots, assembled })
    }

    /// The entries of the matrix in a panel's columns on and below the diagonal: column in the panel, row, value.
    fn entries_of_matrix(&self, p: usize) -> impl Iterator<Item = (usize, usize, T)> {
        let LdltAnalysis { structure, order, inverse, panels, .. } = self.analysis;
        let panel = panels.get(p);
        (0..panel.width).flat_map(move |j| {
            let column = panel.start + j;
            let old = order[column] as usize;
            structure.row(old).filter_map(move |k| {
                let row = inverse[structure.columns[k] as usize] as usize;
                (row >= column).then(|| (j, row, (self.entry)(old, k)))
            })
        })
    }

    /// Adds them.
    fn assemble(&self, p: usize, position: &[u32], entries: &mut [T]) {
        let height = self.analysis.panels.get(p).height();
        for (j, row, value) in self.entries_of_matrix(p) {
            entries[j * height + position[row] as usize] += value;
        }
    }

    /// Subtracts all updates from one tile, the rows of panel `p` from position `first` on.
    fn gather(
        &self,
        p: usize,
        first: usize,
        mut tile: MatMut<'_, T>,
        position: &[u32],
        scratch: &mut TileScratch<T>,
    ) {
        let rows = &self.analysis.panels.rows(p)[first..first + tile.nrows()];
        let (Some(&lowest), Some(&highest)) = (rows.first(), rows.last()) else { return };
        let whole = tile.nrows() == self.analysis.panels.get(p).height();
        for update in self.analysis.panels.updates(p) {
            let source_rows = self.analysis.panels.rows(update.source as usize);
            let from = update.first as usize;
            let range = if whole {
                from..source_rows.len()
            } else {
                from + source_rows[from..].partition_point(|&r| r < lowest)
                    ..from + source_rows[from..].partition_point(|&r| r <= highest)
            };
            if !range.is_empty() {
                let target = Target { column: self.analysis.panels.get(p).start, row: first, position };
                self.subtract(*update, range, &target, tile.rb_mut(), scratch);
            }
        }
    }

    /// Subtracts one update from a tile; `range` are the rows of the source that the tile has.
    fn subtract(
        &self,
        update: Update,
        range: std::ops::Range<usize>,
        target: &Target<'_>,
        mut tile: MatMut<'_, T>,
        scratch: &mut TileScratch<T>,
    ) {
        let source = update.source as usize;
        let panel = self.analysis.panels.get(source);
        let source_rows = self.analysis.panels.rows(source);
        let Finished { panel: finished, .. } =
            self.panels[source].get().expect("descendants are factored first");
        let FactoredPanel { entries, pivots, .. } = &**finished;
        let block = MatRef::from_column_major_slice(entries, panel.height(), panel.width);

        let (from, to) = (update.first as usize, update.last as usize);
        let columns = to - from;
        scratch.scaled.clear();
        for (&pivot, values) in pivots.iter().zip(entries.chunks_exact(panel.height())) {
            scratch.scaled.extend(values[from..to].iter().map(|&value| value * pivot));
        }
        let scaled = MatRef::from_column_major_slice(&scratch.scaled, columns, panel.width);
        let factor_rows = block.subrows(range.start, range.len());
        let shape = if range.start == from && range.end >= to { Shape::LowerTrapezoid } else { Shape::Full };

        let place = |i: usize| target.position[source_rows[i] as usize] as usize - target.row;
        let first_column = source_rows[from] as usize - target.column;
        let (first_row, last_row) = (place(range.start), place(range.end - 1));
        let adjacent = source_rows[to - 1] - source_rows[from] == (columns - 1) as u32
            && last_row - first_row == range.len() - 1;
        if adjacent {
            let tile = tile.submatrix_mut(first_row, first_column, range.len(), columns);
            multiply(tile, Store::Subtract, shape, factor_rows, scaled, &mut scratch.packing);
            return;
        }
        let height = range.len();
        find_pieces(range.clone().map(place), &mut scratch.pieces);
        if scratch.product.len() < height * columns {
            scratch.product.resize(height * columns, T::default());
        }
        let product = &mut scratch.product[..height * columns];
        let product_block = MatMut::from_column_major_slice_mut(product, height, columns);
        multiply(product_block, Store::Overwrite, shape, factor_rows, scaled, &mut scratch.packing);
        for (j, values) in product.chunks_exact(height).enumerate() {
            let own = dense::column_mut(&mut tile, source_rows[from + j] as usize - target.column);
            let start = if shape == Shape::LowerTrapezoid { j } else { 0 };
            for piece in scratch.pieces.iter().filter(|piece| piece.to > start) {
                piece.subtract(values, start, own);
            }
        }
    }
}

/// Rows of a product that lie next to each other in the tile.
struct Piece {
    /// First row in the tile.
    row: usize,
    /// Rows of the product.
    from: usize,
    to: usize,
}

impl Piece {
    /// Subtracts a column of the product, from row `start` of it on, from that of the tile.
    #[inline]
    fn subtract<T: PanelScalar>(&self, values: &[T], start: usize, own: &mut [T]) {
        let begin = self.from.max(start);
        let own = &mut own[self.row + begin - self.from..];
        for (own, &value) in own.iter_mut().zip(&values[begin..self.to]) {
            *own -= value;
        }
    }
}

/// The pieces that the rows of a product make in the tile.
fn find_pieces(rows: impl Iterator<Item = usize>, pieces: &mut Vec<Piece>) {
    pieces.clear();
    for (i, row) in rows.enumerate() {
        match pieces.last_mut() {
            Some(piece) if row == piece.row + i - piece.from => piece.to = i + 1,
            _ => pieces.push(Piece { row, from: i, to: i + 1 }),
        }
    }
}

/// Where a tile lies.
struct Target<'a> {
    /// First column of the panel.
    column: usize,
    /// First row of the tile within the panel.
    row: usize,
    /// Of the rows of the matrix within the panel.
    position: &'a [u32],
}

/// Cuts the rows of a block that starts at row `first` of its panel where the panel's tiles end; each with its first row.
fn tiles_of<T>(block: MatMut<'_, T>, first: usize) -> Vec<(usize, MatMut<'_, T>)> {
    let mut tiles = Vec::new();
    let (mut rest, mut row) = (block, first);
    while rest.nrows() > 0 {
        let height = rest.nrows().min(TILE_ROWS - row % TILE_ROWS);
        let (tile, next) = rest.split_at_row_mut(height);
        tiles.push((row, tile));
        row += height;
        rest = next;
    }
    tiles
}

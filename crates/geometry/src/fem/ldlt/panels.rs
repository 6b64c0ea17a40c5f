//! Panels: the supernodes of the factor, cut into pieces of bounded width, and who updates whom.
//!
//! A panel is stored as one column-major rectangle, `rows × width`, its own columns' rows first. A wide supernode as one
//! rectangle would waste its upper triangle and be indivisible work; its panels share one list of rows, each the tail of the
//! one before.

use std::ops::Range;

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// Most columns of a panel: wide enough for the dense kernels to run at their speed, narrow enough that the unused upper
/// triangle of the diagonal blocks stays a few percent of the factor.
pub(super) const PANEL_WIDTH: usize = 128;

/// Contiguous columns of the factor with one list of rows.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    /// First column.
    pub(super) start: usize,
    /// Number of columns.
    pub(super) width: usize,
    /// Its rows in [`Panels::rows`], the first `width` being its own columns.
    rows: Range<usize>,
}

impl Panel {
    /// Number of rows of the rectangle, own columns included.
    pub(super) fn height(&self) -> usize {
        self.rows.len()
    }

    /// Stored entries.
    pub(super) fn entries(&self) -> usize {
        self.height() * self.width
    }
}

/// Panel `source` changes the columns `rows[first..last]` of a later panel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Update {
    pub(super) source: u32,
    pub(super) first: u32,
    pub(super) last: u32,
}

/// All panels in elimination order.
#[derive(Debug)]
pub(super) struct Panels {
    list: Vec<Panel>,
    rows: Vec<u32>,
    update_starts: Vec<usize>,
    updates: Vec<Update>,
}

impl Panels {
    /// Cuts the supernodes of a postordered matrix.
    pub(super) fn new(symbolic: &SymbolicSupernodalCholesky<u32>) -> Self {
        let mut list = Vec::new();
        let mut rows: Vec<u32> = Vec::new();
        for (s, &end) in symbolic.supernode_end().iter().enumerate() {
            let supernode = symbolic.supernode(s);
            let columns = supernode.start()..end as usize;
            let first_row = rows.len();
            rows.extend(columns.clone().map(|c| c as u32));
            rows.extend(supernode.pattern());
            let pieces = columns.len().div_ceil(PANEL_WIDTH);
            for piece in 0..pieces {
                let from = piece * columns.len() / pieces;
                let width = (piece + 1) * columns.len() / pieces - from;
                list.push(Panel { start: columns.start + from, width, rows: first_row + from..rows.len() });
            }
        }
        let mut panels = Self { list, rows, update_starts: Vec::new(), updates: Vec::new() };
        panels.find_updates(symbolic.nrows());
        panels
    }

    /// Lists the updates of every panel by ascending source.
    fn find_updates(&mut self, columns: usize) {
        let mut owner = vec![0u32; columns];
        for (p, panel) in self.list.iter().enumerate() {
            owner[panel.start..panel.start + panel.width].fill(p as u32);
        }
        let mut starts = vec![0; self.list.len() + 1];
        for p in 0..self.list.len() {
            self.targets(p, &owner, |target, _, _| starts[target + 1] += 1);
        }
        for p in 0..self.list.len() {
            starts[p + 1] += starts[p];
        }
        let mut next = starts.clone();
        let mut updates =
            vec![Update { source: 0, first: 0, last: 0 }; starts.last().copied().unwrap_or_default()];
        for source in 0..self.list.len() {
            self.targets(source, &owner, |target, first, last| {
                updates[next[target]] =
                    Update { source: source as u32, first: first as u32, last: last as u32 };
                next[target] += 1;
            });
        }
        self.update_starts = starts;
        self.updates = updates;
    }

    /// Calls `found(target, first, last)` for every panel that owns rows `first..last` of panel `p`.
    fn targets(&self, p: usize, owner: &[u32], mut found: impl FnMut(usize, usize, usize)) {
        let rows = self.rows(p);
        let mut first = self.list[p].width;
        while first < rows.len() {
            let target = owner[rows[first] as usize];
            let own = rows[first..].iter().take_while(|&&r| owner[r as usize] == target).count();
            found(target as usize, first, first + own);
            first += own;
        }
    }

    /// Number of panels.
    pub(super) fn len(&self) -> usize {
        self.list.len()
    }

    /// A panel.
    pub(super) fn get(&self, p: usize) -> &Panel {
        &self.list[p]
    }

    /// All panels in order.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Panel> {
        self.list.iter()
    }

    /// The rows of a panel, ascending, its own columns first.
    pub(super) fn rows(&self, p: usize) -> &[u32] {
        &self.rows[self.list[p].rows.clone()]
    }

    /// What changes a panel before it can be factored, in the order of summation.
    pub(super) fn updates(&self, p: usize) -> &[Update] {
        &self.updates[self.update_starts[p]..self.update_starts[p + 1]]
    }

    /// The parent of every panel in the elimination tree; `None` for roots.
    pub(super) fn parents(&self) -> Vec<Option<usize>> {
        let mut parents = vec![None; self.len()];
        for target in (0..self.len()).rev() {
            for update in self.updates(target) {
                if update.first as usize == self.list[update.source as usize].width {
                    parents[update.source as usize] = Some(target);
                }
            }
        }
        parents
    }

    /// Multiply-adds that gathering and factoring a panel take.
    pub(super) fn work(&self, p: usize) -> f64 {
        let panel = &self.list[p];
        let (width, height) = (panel.width as f64, panel.height() as f64);
        let below = height - width;
        let own = width * width * (width / 6.0 + below / 2.0);
        let gathered = |update: &Update| {
            let source = &self.list[update.source as usize];
            let columns = f64::from(update.last - update.first);
            let rows = source.height() as f64 - f64::from(update.first) - 0.5 * columns;
            source.width as f64 * columns * rows
        };
        own + self.updates(p).iter().map(gathered).sum::<f64>()
    }
}

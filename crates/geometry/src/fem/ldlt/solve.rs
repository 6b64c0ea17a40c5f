//! Solves with a factor: `L` forwards, `D`, `Lᵀ` backwards, over the tasks of the elimination tree.
//!
//! A task owns the unknowns of its columns. Forwards, what it subtracts from unknowns outside is collected apart, handed to
//! the branch above and added there in the order of the tasks; backwards, it reads those unknowns and changes its own only.
//! Right sides are interleaved, `x[unknown · count + side]`, and set apart for the work on a panel
//! ([`panel_solve`](super::panel_solve)).

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::analysis::LdltAnalysis;
use super::factor::{FactoredPanel, Ldlt};
use super::panel_solve::{Backward, Block, Forward, Subtract, SubtractTransposed, by_pairs};
use super::panels::Panel;
use super::scalar::PanelScalar;
use super::schedule::{Branch, Task, for_each_in_parallel};

/// Entries above which the parts of a panel of a chain are parallel tasks: some 50 µs of memory traffic.
const LARGE_PANEL: usize = 1 << 16;

/// Unknowns whose values are brought into the order of elimination, or out of it, by one task.
const UNKNOWNS: usize = 4096;

/// Rows, respectively columns, of the parts of a large panel.
const PART_ROWS: usize = 256;
const PART_COLUMNS: usize = 32;

/// The work of [`Ldlt::solve_in_place`].
pub(super) fn solve_in_place<T: PanelScalar>(factor: &Ldlt<T>, columns: &mut [T]) {
    let n = factor.size();
    if n == 0 {
        return;
    }
    assert_eq!(columns.len() % n, 0, "whole columns");
    let count = columns.len() / n;
    let LdltAnalysis { order, inverse, tasks, .. } = &*factor.analysis;
    let mut x = vec![T::default(); n * count];
    let parts = x.chunks_mut(UNKNOWNS * count).zip(order.chunks(UNKNOWNS)).collect();
    for_each_in_parallel(parts, |(x, order): (&mut [T], &[u32])| {
        for (x, &old) in x.chunks_exact_mut(count).zip(order) {
            x.iter_mut().enumerate().for_each(|(side, x)| *x = columns[side * n + old as usize]);
        }
    });
    let sweep = Sweep { factor, count, workspaces: Mutex::new(Vec::new()) };
    sweep.forward_branch(tasks, &mut x);
    sweep.backward_branch(tasks, &mut x, &[]);
    let column_parts = columns.chunks_exact_mut(n).enumerate();
    let parts = column_parts.flat_map(|(side, column)| {
        column.chunks_mut(UNKNOWNS).zip(inverse.chunks(UNKNOWNS)).map(move |part| (side, part))
    });
    for_each_in_parallel(parts.collect(), |(side, (column, inverse)): (usize, (&mut [T], &[u32]))| {
        column.iter_mut().zip(inverse).for_each(|(value, &new)| *value = x[new as usize * count + side]);
    });
}

/// Scratch memory of one thread.
struct Workspace<T> {
    /// By unknown and side: what is subtracted from, or known of, unknowns outside the task. Zero between forward tasks.
    outside: Vec<T>,
    /// The unknowns of a panel, one side after the other.
    sides: Vec<T>,
}

struct Sweep<'a, T> {
    factor: &'a Ldlt<T>,
    count: usize,
    workspaces: Mutex<Vec<Workspace<T>>>,
}

/// Whether a large panel is taken in parts, as the panels of chains are, whatever the number of threads.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Parts {
    Whole,
    InParallel,
}

impl<T: PanelScalar> Sweep<'_, T> {
    fn panel(&self, p: usize) -> &Panel {
        self.factor.analysis.panels.get(p)
    }

    fn rows(&self, p: usize) -> &[u32] {
        self.factor.analysis.panels.rows(p)
    }

    /// The unknowns of contiguous panels.
    fn unknowns(&self, panels: &Range<usize>) -> Range<usize> {
        let start = |p: usize| {
            if p < self.factor.panels.len() { self.panel(p).start } else { self.factor.size() }
        };
        start(panels.start)..start(panels.end)
    }

    /// The unknowns outside that panels with their subtrees have to do with, some of them repeatedly: the rows of the roots.
    fn outer_rows(&self, panels: Range<usize>) -> impl Iterator<Item = usize> {
        let end = self.unknowns(&panels).end;
        let below = panels.map(|p| &self.rows(p)[self.panel(p).width..]);
        let roots = below.filter(move |rows| rows.first().is_some_and(|&row| row as usize >= end));
        roots.flatten().map(|&row| row as usize)
    }

    /// Each task with its part of the unknowns `x` of the branch.
    fn shares<'t, 'x>(&self, branch: &'t Branch, x: &'x mut [T]) -> Vec<(&'t Task, &'x mut [T])> {
        let mut rest = x;
        let mut next = self.unknowns(&branch.panels).start;
        let share = |task: &'t Task| {
            let unknowns = self.unknowns(&task.panels());
            let (_, from) = std::mem::take(&mut rest).split_at_mut((unknowns.start - next) * self.count);
            let (own, after) = from.split_at_mut(unknowns.len() * self.count);
            rest = after;
            next = unknowns.end;
            (task, own)
        };
        branch.tasks.iter().map(share).collect()
    }

    fn with_workspace<R>(&self, work: impl FnOnce(&mut Workspace<T>) -> R) -> R {
        let lock = || self.workspaces.lock().unwrap_or_else(PoisonError::into_inner);
        let idle = lock().pop();
        let mut workspace = idle.unwrap_or_else(|| Workspace {
            outside: vec![T::default(); self.factor.size() * self.count],
            sides: Vec::new(),
        });
        let result = work(&mut workspace);
        lock().push(workspace);
        result
    }

    /// Forward through a task; returns what it adds to its outer rows, in their order.
    fn forward(&self, task: &Task, x: &mut [T]) -> Vec<T> {
        match task {
            Task::Branch(branch) => self.forward_branch(branch, x),
            Task::Run(panels) => self.with_workspace(|workspace| {
                let own = self.unknowns(panels);
                for p in panels.clone() {
                    self.forward_panel(p, Parts::Whole, x, &own, workspace);
                }
                self.take_outer(panels, workspace)
            }),
        }
    }

    fn forward_branch(&self, branch: &Branch, x: &mut [T]) -> Vec<T> {
        let shares = self.shares(branch, x);
        let mut contributions: Vec<Vec<T>> = vec![Vec::new(); shares.len()];
        let each = shares.into_iter().zip(&mut contributions).collect();
        for_each_in_parallel(each, |((task, x), own)| *own = self.forward(task, x));
        let own = self.unknowns(&branch.panels);
        self.with_workspace(|workspace| {
            for (task, contribution) in branch.tasks.iter().zip(contributions) {
                let rows = self.outer_rows(task.panels());
                for (row, values) in rows.zip(contribution.chunks_exact(self.count)) {
                    let target = self.at_mut(row, x, &own, &mut workspace.outside);
                    target.iter_mut().zip(values).for_each(|(target, &value)| *target += value);
                }
            }
            for &p in &branch.chain {
                self.forward_panel(p, Parts::InParallel, x, &own, workspace);
            }
            self.take_outer(&branch.panels, workspace)
        })
    }

    /// The values at the outer rows, which become zero again: a row that comes twice is taken once.
    fn take_outer(&self, panels: &Range<usize>, workspace: &mut Workspace<T>) -> Vec<T> {
        let mut values = Vec::new();
        for row in self.outer_rows(panels.clone()) {
            let at_row = &mut workspace.outside[row * self.count..(row + 1) * self.count];
            values.extend_from_slice(at_row);
            at_row.fill(T::default());
        }
        values
    }

    /// Backward through a task; `outer` are the solutions at its outer rows.
    fn backward(&self, task: &Task, x: &mut [T], outer: &[T]) {
        match task {
            Task::Branch(branch) => self.backward_branch(branch, x, outer),
            Task::Run(panels) => self.with_workspace(|workspace| {
                let own = self.unknowns(panels);
                self.put_outer(panels, outer, workspace);
                for p in panels.clone().rev() {
                    self.backward_panel(p, Parts::Whole, x, &own, workspace);
                }
            }),
        }
    }

    fn backward_branch(&self, branch: &Branch, x: &mut [T], outer: &[T]) {
        let own = self.unknowns(&branch.panels);
        let known: Vec<Vec<T>> = self.with_workspace(|workspace| {
            self.put_outer(&branch.panels, outer, workspace);
            for &p in branch.chain.iter().rev() {
                self.backward_panel(p, Parts::InParallel, x, &own, workspace);
            }
            let at = |row| self.at(row, x, &own, &workspace.outside).iter().copied();
            branch.tasks.iter().map(|task| self.outer_rows(task.panels()).flat_map(at).collect()).collect()
        });
        let shares = self.shares(branch, x).into_iter().zip(known).collect();
        for_each_in_parallel(shares, |((task, x), known): ((_, _), Vec<T>)| self.backward(task, x, &known));
    }

    fn put_outer(&self, panels: &Range<usize>, outer: &[T], workspace: &mut Workspace<T>) {
        for (row, values) in self.outer_rows(panels.clone()).zip(outer.chunks_exact(self.count)) {
            workspace.outside[row * self.count..][..self.count].copy_from_slice(values);
        }
    }

    /// All sides at an unknown, be it one of the task's `own` or outside.
    fn at<'v>(&self, row: usize, x: &'v [T], own: &Range<usize>, outside: &'v [T]) -> &'v [T] {
        if row < own.end {
            &x[(row - own.start) * self.count..][..self.count]
        } else {
            &outside[row * self.count..][..self.count]
        }
    }

    fn at_mut<'v>(
        &self,
        row: usize,
        x: &'v mut [T],
        own: &Range<usize>,
        outside: &'v mut [T],
    ) -> &'v mut [T] {
        if row < own.end {
            &mut x[(row - own.start) * self.count..][..self.count]
        } else {
            &mut outside[row * self.count..][..self.count]
        }
    }

    /// `x_J ← L_J⁻¹ x_J`, then `x_R −= L_R x_J`.
    fn forward_panel(
        &self,
        p: usize,
        parts: Parts,
        x: &mut [T],
        own: &Range<usize>,
        workspace: &mut Workspace<T>,
    ) {
        let panel = self.panel(p);
        let entries = self.factor.panels[p].entries.as_slice();
        let (width, height, count) = (panel.width, panel.height(), self.count);
        let columns = &mut x[(panel.start - own.start) * count..][..width * count];
        let Workspace { outside, sides } = workspace;
        sides.clear();
        sides.resize(height * count, T::default());
        for (side, values) in sides.chunks_exact_mut(height).enumerate() {
            let own = columns.iter().skip(side).step_by(count);
            values.iter_mut().zip(own).for_each(|(value, &x)| *value = x);
        }
        let cut = parts == Parts::InParallel && entries.len() > LARGE_PANEL;
        let block = Block { entries, height, first_row: 0, rows: if cut { width } else { height } };
        let arch = pulp::Arch::new();
        by_pairs(
            sides,
            height,
            |[one, other]| {
                arch.dispatch(Forward { block, x: [&mut one[..block.rows], &mut other[..block.rows]] })
            },
            |[one]| arch.dispatch(Forward { block, x: [&mut one[..block.rows]] }),
        );
        if cut {
            subtract_in_parts(block, sides);
        }
        for (side, values) in sides.chunks_exact(height).enumerate() {
            let (solved, changes) = values.split_at(width);
            let own_unknowns = x[(panel.start - own.start) * count..].iter_mut().skip(side).step_by(count);
            own_unknowns.zip(solved).for_each(|(x, &solved)| *x = solved);
            for (&row, &change) in self.rows(p)[width..].iter().zip(changes) {
                self.at_mut(row as usize, x, own, outside)[side] += change;
            }
        }
    }

    /// `x_J ← D_J⁻¹ x_J`, `x_J −= L_Rᵀ x_R`, then `x_J ← L_J⁻ᵀ x_J`.
    fn backward_panel(
        &self,
        p: usize,
        parts: Parts,
        x: &mut [T],
        own: &Range<usize>,
        workspace: &mut Workspace<T>,
    ) {
        let panel = self.panel(p);
        let FactoredPanel { entries, inverse_pivots, .. } = &*self.factor.panels[p];
        let entries = entries.as_slice();
        let (width, height, count) = (panel.width, panel.height(), self.count);
        let Workspace { outside, sides } = workspace;
        sides.clear();
        for side in 0..count {
            let own_unknowns = x[(panel.start - own.start) * count..].iter().skip(side).step_by(count);
            sides.extend(own_unknowns.zip(inverse_pivots).map(|(&x, &inverse)| x * inverse));
            let rows = self.rows(p)[width..].iter();
            sides.extend(rows.map(|&row| self.at(row as usize, x, own, outside)[side]));
        }
        let cut = parts == Parts::InParallel && entries.len() > LARGE_PANEL;
        let block = Block { entries, height, first_row: 0, rows: if cut { width } else { height } };
        let arch = pulp::Arch::new();
        if cut {
            subtract_transposed_in_parts(block, sides);
        }
        by_pairs(
            sides,
            height,
            |[one, other]| {
                arch.dispatch(Backward { block, x: [&mut one[..block.rows], &mut other[..block.rows]] })
            },
            |[one]| arch.dispatch(Backward { block, x: [&mut one[..block.rows]] }),
        );
        for (side, values) in sides.chunks_exact(height).enumerate() {
            let own_unknowns = x[(panel.start - own.start) * count..].iter_mut().skip(side).step_by(count);
            own_unknowns.zip(&values[..width]).for_each(|(x, &solved)| *x = solved);
        }
    }
}

/// Other rows of the same columns.
fn below<T>(block: Block<'_, T>, first_row: usize, rows: usize) -> Block<'_, T> {
    Block { first_row, rows, ..block }
}

/// `x_R −= L_R x_J` for every side, by parts of the rows; `block` is the square on top of the panel.
fn subtract_in_parts<T: PanelScalar>(block: Block<'_, T>, sides: &mut [T]) {
    let (arch, height, width) = (pulp::Arch::new(), block.height, block.rows);
    let rows_of = |part: usize, rows: usize| below(block, width + part * PART_ROWS, rows);
    by_pairs(
        sides,
        height,
        |[one, other]| {
            let ((x0, y0), (x1, y1)) = (one.split_at_mut(width), other.split_at_mut(width));
            let x = [&*x0, &*x1];
            let parts = y0.chunks_mut(PART_ROWS).zip(y1.chunks_mut(PART_ROWS)).enumerate();
            for_each_in_parallel(parts.collect(), |(part, (y0, y1)): (_, (&mut [T], _))| {
                arch.dispatch(Subtract { block: rows_of(part, y0.len()), x, y: [y0, y1] });
            });
        },
        |[one]| {
            let (x, y) = one.split_at_mut(width);
            let x = [&*x];
            for_each_in_parallel(y.chunks_mut(PART_ROWS).enumerate().collect(), |(part, y)| {
                arch.dispatch(Subtract { block: rows_of(part, y.len()), x, y: [y] });
            });
        },
    );
}

/// `x_J −= L_Rᵀ x_R` for every side, by parts of the columns; `block` is the square on top of the panel.
fn subtract_transposed_in_parts<T: PanelScalar>(block: Block<'_, T>, sides: &mut [T]) {
    let (arch, height, width) = (pulp::Arch::new(), block.height, block.rows);
    let outer = below(block, width, height - width);
    by_pairs(
        sides,
        height,
        |[one, other]| {
            let ((x0, y0), (x1, y1)) = (one.split_at_mut(width), other.split_at_mut(width));
            let y = [&*y0, &*y1];
            let parts = x0.chunks_mut(PART_COLUMNS).zip(x1.chunks_mut(PART_COLUMNS)).enumerate();
            for_each_in_parallel(parts.collect(), |(part, (x0, x1))| {
                let first = part * PART_COLUMNS;
                arch.dispatch(SubtractTransposed { block: outer, first, x: [x0, x1], y });
            });
        },
        |[one]| {
            let (x, y) = one.split_at_mut(width);
            let y = [&*y];
            for_each_in_parallel(x.chunks_mut(PART_COLUMNS).enumerate().collect(), |(part, x)| {
                let first = part * PART_COLUMNS;
                arch.dispatch(SubtractTransposed { block: outer, first, x: [x], y });
            });
        },
    );
}

//! Which panels may be worked on at the same time: the elimination tree, cut into tasks.
//!
//! A panel waits for its subtree only. Subtrees of little work are taken panel by panel, in *runs*; above them the tree is
//! a *branch*: tasks that do not know of each other, then the chain of panels that needs them all. The cut depends on the
//! pattern and never on the threads.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::panels::Panels;

/// Subtrees below this part of the whole work are not divided further: a few dozen tasks, enough to keep several threads
/// busy below the top separators.
const PART_OF_ALL: f64 = 1.0 / 64.0;

/// Subtrees of fewer multiply-adds are not divided either: about a millisecond, against microseconds for a task.
const LEAST_WORK: f64 = 3e6;

/// A part of the elimination tree.
#[derive(Debug)]
pub(super) enum Task {
    /// Whole subtrees next to each other, taken in order.
    Run(Range<usize>),
    /// A subtree whose parts are tasks themselves.
    Branch(Branch),
}

/// Independent tasks, then panels in order.
#[derive(Debug)]
pub(super) struct Branch {
    /// First panel of the subtree, and one past its last.
    pub(super) panels: Range<usize>,
    /// In the order of their panels.
    pub(super) tasks: Vec<Task>,
    /// Panels that follow all tasks, ascending.
    pub(super) chain: Vec<usize>,
}

impl Task {
    /// The panels of the task.
    pub(super) fn panels(&self) -> Range<usize> {
        match self {
            Self::Run(panels) => panels.clone(),
            Self::Branch(branch) => branch.panels.clone(),
        }
    }
}

struct Tree {
    /// First panel of the subtree of every panel: subtrees are contiguous in a postorder.
    first: Vec<usize>,
    children: Vec<Vec<usize>>,
    /// Work of the subtree of every panel.
    work: Vec<f64>,
    least: f64,
}

/// Cuts the elimination tree; the branch that is returned has all panels.
pub(super) fn cut(panels: &Panels) -> Branch {
    let count = panels.len();
    let mut tree = Tree {
        first: (0..count).collect(),
        children: vec![Vec::new(); count],
        work: (0..count).map(|p| panels.work(p)).collect(),
        least: LEAST_WORK,
    };
    tree.least = tree.least.max(PART_OF_ALL * tree.work.iter().sum::<f64>());
    let mut roots = Vec::new();
    for (p, parent) in panels.parents().into_iter().enumerate() {
        match parent {
            Some(parent) => {
                tree.children[parent].push(p);
                tree.first[parent] = tree.first[parent].min(tree.first[p]);
                tree.work[parent] += tree.work[p];
            }
            None => roots.push(p),
        }
    }
    let heavy = roots.iter().filter(|&&p| tree.is_heavy(p)).map(|&p| Task::Branch(tree.branch(p))).collect();
    let light = roots.iter().copied().filter(|&p| !tree.is_heavy(p)).collect();
    Branch { panels: 0..count, tasks: tree.with_runs(heavy, light), chain: Vec::new() }
}

impl Tree {
    fn is_heavy(&self, p: usize) -> bool {
        self.work[p] > self.least
    }

    /// The subtree of a heavy panel. The recursion divides at every level a subtree with two heavy parts, so it is no
    /// deeper than there are heavy leaves.
    fn branch(&self, root: usize) -> Branch {
        let mut chain = vec![root];
        let mut light = Vec::new();
        let heavy = loop {
            let children = &self.children[chain[chain.len() - 1]];
            light.extend(children.iter().copied().filter(|&c| !self.is_heavy(c)));
            let mut heavy = children.iter().copied().filter(|&c| self.is_heavy(c));
            match (heavy.next(), heavy.next()) {
                (Some(only), None) => chain.push(only),
                (first, second) => break first.into_iter().chain(second).chain(heavy).collect::<Vec<_>>(),
            }
        };
        chain.reverse();
        let heavy = heavy.into_iter().map(|p| Task::Branch(self.branch(p))).collect();
        Branch { panels: self.first[root]..root + 1, tasks: self.with_runs(heavy, light), chain }
    }

    /// Heavy tasks and the subtrees of light roots, neighbours joined to runs of enough work, all in order.
    fn with_runs(&self, mut tasks: Vec<Task>, mut light: Vec<usize>) -> Vec<Task> {
        light.sort_unstable();
        let mut work = 0.0;
        let mut open: Option<Range<usize>> = None;
        for root in light {
            match &mut open {
                Some(run) if run.end == self.first[root] && work + self.work[root] <= self.least => {
                    run.end = root + 1;
                    work += self.work[root];
                }
                _ => {
                    tasks.extend(open.replace(self.first[root]..root + 1).map(Task::Run));
                    work = self.work[root];
                }
            }
        }
        tasks.extend(open.map(Task::Run));
        tasks.sort_by_key(|task| task.panels().start);
        tasks
    }
}

/// `work` of every item, each a task of its own.
///
/// The items are handed out by their numbers, so that the scheduler is compiled once and not for every kind of item.
pub(super) fn for_each_in_parallel<I: Send>(items: Vec<I>, work: impl Fn(I) + Sync) {
    let items: Vec<Mutex<Option<I>>> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    indices_in_parallel(items.len(), &|i| {
        let item = items[i].lock().unwrap_or_else(PoisonError::into_inner).take();
        item.into_iter().for_each(&work);
    });
}

/// `work` of every index below `count`, each a task of its own.
pub(super) fn indices_in_parallel(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().with_max_len(1).for_each(work);
}

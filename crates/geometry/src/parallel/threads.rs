//! An engine of threads in one process: every thread is a rank.
//!
//! It has the work of ranks tested where there is no MPI, and shows what an engine must do. Its solver gathers the matrix at
//! rank 0 and factors it there: nothing is gained by it.

use std::sync::{Arc, Barrier, Mutex, PoisonError};

use super::communicator::{Communicator, DistributedSolver, Rows, Solved, SolverOptions};
use super::layout::RowLayout;
use super::{complex_of, numbers_of};
use crate::fem::csr::CsrStructure;
use crate::fem::{CsrMatrix, Ldlt, LdltAnalysis, c64, norm, ordering};

/// What the ranks meet at.
#[derive(Debug)]
struct Exchange {
    barrier: Barrier,
    slots: Mutex<Vec<Vec<f64>>>,
}

/// One rank of a process.
#[derive(Clone, Debug)]
struct ThreadRank {
    exchange: Arc<Exchange>,
    rank: usize,
    size: usize,
}

/// Runs so many ranks, each on a thread of its own; what they return, by rank.
///
/// # Panics
/// If a rank does.
pub fn run<T: Send>(size: usize, work: impl Fn(Box<dyn Communicator>) -> T + Sync) -> Vec<T> {
    let exchange =
        Arc::new(Exchange { barrier: Barrier::new(size), slots: Mutex::new(vec![Vec::new(); size]) });
    std::thread::scope(|scope| {
        let begun: Vec<_> = (0..size)
            .map(|rank| {
                let own = Box::new(ThreadRank { exchange: Arc::clone(&exchange), rank, size });
                scope.spawn(|| work(own))
            })
            .collect();
        begun.into_iter().map(|rank| rank.join().expect("a rank does not panic")).collect()
    })
}

impl ThreadRank {
    /// Puts the own numbers where all see them, and lets `read` look at everyone's.
    fn exchange<T>(&self, own: &[f64], read: impl FnOnce(&[Vec<f64>]) -> T) -> T {
        let slots = || self.exchange.slots.lock().unwrap_or_else(PoisonError::into_inner);
        slots()[self.rank] = own.to_vec();
        self.exchange.barrier.wait();
        let seen = read(&slots());
        self.exchange.barrier.wait();
        seen
    }
}

impl Communicator for ThreadRank {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn broadcast(&self, numbers: &mut [f64]) {
        let first = self.exchange(numbers, |all| all[0].clone());
        numbers.copy_from_slice(&first);
    }

    fn gather(&self, own: &[f64]) -> Vec<Vec<f64>> {
        self.exchange(own, |all| if self.rank == 0 { all.to_vec() } else { Vec::new() })
    }

    fn sum(&self, numbers: &mut [f64]) {
        let all = self.gather(numbers);
        for other in all.iter().skip(1) {
            for (sum, number) in numbers.iter_mut().zip(other) {
                *sum += number;
            }
        }
    }

    fn solver(&self, rows: Rows, _: &SolverOptions) -> Result<Box<dyn DistributedSolver>, String> {
        let pattern: Vec<f64> = (0..rows.structure.row_count())
            .flat_map(|row| {
                let columns = &rows.structure.columns[rows.structure.row(row)];
                std::iter::once(columns.len() as f64).chain(columns.iter().map(|&c| f64::from(c)))
            })
            .collect();
        let gathered = match self.gather(&pattern) {
            all if all.is_empty() => None,
            all => Some(GatheredMatrix::new(&rows.layout, &all)),
        };
        let outcome = gathered.as_ref().map(|whole| whole.as_ref().map(|_| Vec::new()).map_err(Clone::clone));
        let whole = gathered.and_then(Result::ok);
        let solver = GatheredSolver { ranks: self.clone(), layout: rows.layout, whole };
        solver.broadcast_outcome(outcome)?;
        Ok(Box::new(solver))
    }

    fn abort(&self, cause: Option<&str>) -> ! {
        eprintln!("rank {} of {}: {}", self.rank, self.size, cause.unwrap_or("aborted"));
        std::process::abort()
    }
}

/// The whole matrix at rank 0.
#[derive(Debug)]
struct GatheredMatrix {
    analysis: Arc<LdltAnalysis>,
    matrix: CsrMatrix<c64>,
    /// Place in the gathered values of every entry.
    place: Vec<usize>,
    factor: Option<Ldlt<c64>>,
}

impl GatheredMatrix {
    fn new(layout: &RowLayout, parts: &[Vec<f64>]) -> Result<Self, String> {
        // Rows of all ranks in the order of the ranks, and where their values begin among all.
        let mut rows: Vec<(usize, Vec<u32>)> = Vec::new();
        let mut begin = 0;
        for part in parts {
            let mut rest = part.as_slice();
            while let Some((&count, others)) = rest.split_first() {
                let (columns, others) = others.split_at(count as usize);
                rows.push((begin, columns.iter().map(|&c| c as u32).collect()));
                begin += columns.len();
                rest = others;
            }
        }
        let mut structure =
            CsrStructure { column_count: layout.count(), row_starts: vec![0], columns: Vec::new() };
        let mut place = Vec::with_capacity(begin);
        for equation in 0..layout.count() {
            let (begin, columns) = &rows[layout.row_of(equation) as usize];
            place.extend(*begin..begin + columns.len());
            structure.columns.extend_from_slice(columns);
            structure.row_starts.push(structure.columns.len() as u32);
        }
        let structure = Arc::new(structure);
        let order = ordering::dissection(&structure);
        let analysis = LdltAnalysis::new(&structure, order).map_err(|error| error.to_string())?;
        Ok(Self { analysis, matrix: CsrMatrix::zeros(&structure), place, factor: None })
    }

    fn set(&mut self, parts: &[Vec<f64>]) -> Result<(), String> {
        let values: Vec<c64> = parts.iter().flat_map(|part| complex_of(part)).collect();
        for (value, &place) in self.matrix.values.iter_mut().zip(&self.place) {
            *value = values[place];
        }
        let factor =
            Ldlt::new(&self.analysis, |_, k| self.matrix.values[k]).map_err(|error| error.to_string())?;
        self.factor = Some(factor);
        Ok(())
    }

    /// The solution, and its residual as the last number.
    fn solve(&self, right_side: &[c64]) -> Result<Vec<f64>, String> {
        let factor = self.factor.as_ref().ok_or("there is no matrix")?;
        let mut x = right_side.to_vec();
        factor.solve_in_place(&mut x);
        let mut residual = vec![c64::default(); x.len()];
        self.matrix.mul(&x, &mut residual);
        for (r, b) in residual.iter_mut().zip(right_side) {
            *r -= b;
        }
        let mut answer: Vec<f64> = numbers_of(&x).collect();
        answer.push(norm(&residual) / norm(right_side));
        Ok(answer)
    }
}

/// A matrix that rank 0 holds for all.
#[derive(Debug)]
struct GatheredSolver {
    ranks: ThreadRank,
    layout: Arc<RowLayout>,
    whole: Option<GatheredMatrix>,
}

impl GatheredSolver {
    /// What rank 0 found, at every rank.
    fn broadcast_outcome(&self, outcome: Option<Result<Vec<f64>, String>>) -> Result<Vec<f64>, String> {
        let outcome = outcome.unwrap_or(Ok(Vec::new()));
        let mut length = [outcome.as_ref().map_or(-1.0, |numbers| numbers.len() as f64)];
        self.ranks.broadcast(&mut length);
        if length[0] < 0.0 {
            return Err(outcome.err().unwrap_or_else(|| "rank 0 failed".to_owned()));
        }
        let mut numbers = outcome.unwrap_or_default();
        numbers.resize(length[0] as usize, 0.0);
        self.ranks.broadcast(&mut numbers);
        Ok(numbers)
    }
}

impl DistributedSolver for GatheredSolver {
    fn set_matrix(&mut self, values: &[c64]) -> Result<(), String> {
        let own: Vec<f64> = numbers_of(values).collect();
        let parts = self.ranks.gather(&own);
        let outcome = self.whole.as_mut().map(|whole| whole.set(&parts).map(|()| Vec::new()));
        self.broadcast_outcome(outcome).map(|_| ())
    }

    fn solve(&mut self, right_side: &[c64], solution: &mut [c64]) -> Result<Solved, String> {
        let own: Vec<f64> = numbers_of(right_side).collect();
        let parts = self.ranks.gather(&own);
        let outcome = self.whole.as_ref().map(|whole| whole.solve(&self.layout.join(&parts)));
        let mut numbers = self.broadcast_outcome(outcome)?;
        let residual = numbers.pop().unwrap_or(f64::NAN);
        solution.copy_from_slice(&self.layout.restrict(&numbers));
        Ok(Solved { iterations: 1, residual })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::parallel::rank_group::{Command, CommandChannel, CommandHandler, RankGroup, Role};

    /// Adds the ranks' shares of the numbers, and fails where the command says so.
    struct Adding;

    impl CommandHandler for Adding {
        fn handle(&mut self, command: &Command, ranks: &dyn Communicator) -> Result<Vec<f64>, String> {
            if command.kind == 100 + ranks.rank() as u32 {
                return Err("the disk is full".to_owned());
            }
            let share = ranks.rank()..command.numbers.len();
            let mut sum = [share.step_by(ranks.size()).map(|i| command.numbers[i]).sum()];
            ranks.sum(&mut sum);
            Ok(sum.to_vec())
        }
    }

    /// What the leader of a group of so many ranks, with one handler, does with its channel.
    fn lead<T: Send>(size: usize, work: impl Fn(CommandChannel) -> T + Sync) -> T {
        let results = run(size, |ranks| {
            let group = RankGroup::new(ranks, Arc::default());
            let channel = group.register(Box::new(Adding));
            if group.role() == Role::Leader {
                let result = work(channel);
                group.shut_down();
                return Some(result);
            }
            group.serve(Ok(()));
            None
        });
        results.into_iter().flatten().next().expect("rank 0 leads")
    }

    #[test]
    fn every_rank_does_its_share_of_a_command() {
        for size in [1, 2, 5] {
            let numbers: Vec<f64> = (0..17).map(f64::from).collect();
            let sums = lead(size, |channel| [0, 1].map(|kind| channel.execute(kind, numbers.clone())));
            assert_eq!(sums, [Ok(vec![136.0]), Ok(vec![136.0])]);
        }
    }

    #[test]
    fn a_rank_that_is_not_ready_is_named_with_the_first_command() {
        let outcomes = run(3, |ranks| {
            let group = RankGroup::new(ranks, Arc::default());
            let channel = group.register(Box::new(Adding));
            if group.role() == Role::Leader {
                let outcome = channel.execute(0, vec![1.0]);
                group.shut_down();
                return Some(outcome);
            }
            let ready = if group.rank() == 2 { Err("no such file".to_owned()) } else { Ok(()) };
            group.serve(ready);
            None
        });
        let error = outcomes[0].clone().expect("rank 0 leads").expect_err("rank 2 is not ready");
        assert_eq!(error.to_string(), "rank 2 of 3: no such file");
    }

    #[test]
    fn a_rank_with_another_problem_is_named() {
        let outcomes = run(2, |ranks| {
            let group = RankGroup::new(ranks, Arc::default());
            let channel = group.register(Box::new(Adding));
            group.set_identity(7 + group.rank() as u64);
            if group.role() == Role::Leader {
                let outcome = channel.execute(0, vec![1.0]);
                group.shut_down();
                return Some(outcome);
            }
            group.serve(Ok(()));
            None
        });
        let error = outcomes[0].clone().expect("rank 0 leads").expect_err("rank 1 differs").to_string();
        assert!(error.starts_with("rank 1 of 2: it has set up another problem"), "{error}");
    }

    #[test]
    fn a_signal_at_one_rank_is_known_to_the_leader_with_the_next_command() {
        let seen = run(3, |ranks| {
            let signal = Arc::new(AtomicUsize::new(if ranks.rank() == 1 { 15 } else { 0 }));
            let group = RankGroup::new(ranks, signal);
            let channel = group.register(Box::new(Adding));
            if group.role() == Role::Leader {
                let before = group.signal();
                channel.execute(0, vec![1.0]).expect("a command is executed");
                group.shut_down();
                return [before, group.signal()];
            }
            group.serve(Ok(()));
            [group.signal(); 2]
        });
        assert_eq!(seen, [[0, 15], [15, 15], [15, 15]]);
    }
}

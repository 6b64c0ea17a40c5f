//! A distributed matrix as a rank holds it: its rows, and the solver of all.

use super::communicator::{Communicator, DistributedSolver, Rows, Solved, SolverOptions};
use super::{complex_of, numbers_of};
use crate::fem::c64;

/// The own rows of a distributed system, solved with right sides that come from rank 0 and solutions that go there.
#[derive(Debug)]
pub struct DistributedMatrix {
    rows: Rows,
    options: SolverOptions,
    /// Created with the first values: the engine may not be there before.
    solver: Option<Box<dyn DistributedSolver>>,
}

impl DistributedMatrix {
    /// The rows of this rank, without values.
    pub fn new(rows: Rows, options: SolverOptions) -> Self {
        Self { rows, options, solver: None }
    }

    /// Takes the values of the own rows, and factors. Collective.
    ///
    /// # Errors
    /// What the engine says.
    pub fn set(&mut self, values: &[c64], ranks: &dyn Communicator) -> Result<(), String> {
        if self.solver.is_none() {
            self.solver = Some(ranks.solver(self.rows.clone(), &self.options)?);
        }
        self.solver.as_mut().map_or(Ok(()), |solver| solver.set_matrix(values))
    }

    /// Solves for a right side of all equations, given as pairs of numbers; [`solution_of`] reads the answer at rank 0.
    /// Collective.
    ///
    /// # Errors
    /// What the engine says.
    pub fn solve(&mut self, right_side: &[f64], ranks: &dyn Communicator) -> Result<Vec<f64>, String> {
        let layout = &self.rows.layout;
        let solver = self.solver.as_mut().ok_or("there is no matrix yet")?;
        let own = layout.restrict(right_side);
        let mut solution = vec![c64::default(); own.len()];
        let Solved { iterations, residual } = solver.solve(&own, &mut solution)?;
        let own: Vec<f64> = numbers_of(&solution).collect();
        let parts = ranks.gather(&own);
        if ranks.rank() != 0 {
            return Ok(Vec::new());
        }
        let mut answer: Vec<f64> = numbers_of(&layout.join(&parts)).collect();
        answer.extend([iterations as f64, residual]);
        Ok(answer)
    }
}

/// The solution of all equations, and how it was reached, from what [`DistributedMatrix::solve`] answers at rank 0.
///
/// # Panics
/// If it is no such answer.
pub fn solution_of(answer: &[f64]) -> (Vec<c64>, Solved) {
    let (numbers, &[iterations, residual]) =
        answer.split_last_chunk().expect("an answer ends with two numbers");
    (complex_of(numbers), Solved { iterations: iterations as usize, residual })
}

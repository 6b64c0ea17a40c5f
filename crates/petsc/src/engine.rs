//! The ranks of MPI as the program asks for them.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use fluxmorph_geometry::ranks::{Communicator, DistributedSolver, Rows, SolverOptions};

use crate::solver::PetscSolver;
use crate::{bridge, options};

/// This process as a rank of MPI, with PETSc behind it; one in a process. Both end where it is dropped, on the thread that
/// has started them.
#[derive(Debug)]
pub struct Petsc {
    rank: usize,
    size: usize,
    here: usize,
    /// The user's options for solvers of the field, with their values.
    of_field: Arc<[(String, String)]>,
    /// How many of these there are.
    solvers: AtomicUsize,
}

impl Petsc {
    /// Starts MPI and PETSc; `further` are a user's options, which come before those of the program.
    ///
    /// # Errors
    /// What the libraries say.
    pub fn start(further: &str) -> Result<Self, String> {
        bridge::start()?;
        bridge::insert_options(further)?;
        let (rank, size, here) = bridge::places();
        let of_field = options::pairs(further).into_iter().filter(|(name, _)| options::is_of_field(name));
        let of_field = of_field.map(|(name, value)| (name.to_owned(), value.to_owned())).collect();
        Ok(Self { rank, size, here, of_field, solvers: AtomicUsize::new(0) })
    }

    /// How many ranks this machine has.
    pub fn size_here(&self) -> usize {
        self.here
    }
}

impl Drop for Petsc {
    fn drop(&mut self) {
        bridge::finish();
    }
}

impl Communicator for Petsc {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn broadcast(&self, numbers: &mut [f64]) {
        bridge::broadcast(numbers);
    }

    fn gather(&self, own: &[f64]) -> Vec<Vec<f64>> {
        bridge::gather(own, (self.rank, self.size))
    }

    fn sum(&self, numbers: &mut [f64]) {
        bridge::sum(numbers);
    }

    fn solver(&self, rows: Rows, options: &SolverOptions) -> Result<Box<dyn DistributedSolver>, String> {
        // Settings of one field problem are none of another's: each has a name of its own.
        let (prefix, own) = if options.prefix.is_empty() {
            let number = self.solvers.fetch_add(1, Ordering::SeqCst);
            (format!("field{number}_"), Arc::clone(&self.of_field))
        } else {
            (options.prefix.to_owned(), Arc::default())
        };
        Ok(Box::new(PetscSolver::new(rows, options, prefix, own)?))
    }

    fn abort(&self, exit_code: i32) -> ! {
        bridge::abort(exit_code)
    }
}

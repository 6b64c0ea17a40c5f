//! The program under `mpirun` with PETSc: the results of one process, runs that ranks or signals break off, options and
//! faults. Needs PETSc and MPI (`just setup-petsc`); `just test-mpi` runs it.

#[path = "../support/mod.rs"]
mod support;

mod faults;
mod launch;
mod results;
mod scale;
mod stops;

//! What a parallel launcher (`mpirun`, `srun`) says to the processes that it starts, by their environment.

use std::env::{var, var_os};

/// Variables that hold the number of this rank: Open MPI, MPICH and Intel, SLURM with PMIx, MVAPICH.
const RANK: [&str; 4] = ["OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "MV2_COMM_WORLD_RANK"];

/// Variables that hold the number of all ranks.
const SIZE: [&str; 4] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS", "MV2_COMM_WORLD_SIZE"];

/// All of them, for what must not take itself for a rank.
pub(crate) fn variables() -> impl Iterator<Item = &'static str> {
    RANK.into_iter().chain(SIZE)
}

/// Whether a launcher has started this process.
pub(crate) fn is_launched() -> bool {
    RANK.iter().any(|name| var_os(name).is_some())
}

/// Number of this rank; 0 without a launcher.
pub(crate) fn rank() -> usize {
    number(&RANK).unwrap_or(0)
}

/// How many ranks the launcher has started; 1 without one.
pub(crate) fn size() -> usize {
    // Slurm says how many there are also where it has no part in MPI.
    number(&SIZE).unwrap_or(1)
}

fn number(names: &[&str]) -> Option<usize> {
    names.iter().find_map(|name| var(name).ok()?.parse().ok())
}

//! A command on several ranks: who leads, who works, and how all end together.
//!
//! Started by `mpirun`, every rank reads the configuration and sets the problem up; rank 0 then does what the command says,
//! the others execute its commands ([`fluxmorph_geometry::parallel`]) and print nothing. PETSc is the engine where the program was
//! built with it; without, more than one rank is refused, since each would do the whole work and write into the same files.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use fluxmorph_geometry::parallel::{RankGroup, Role};

use super::args::WorkArgs;
use super::interrupt::Signal;
#[cfg(feature = "petsc")]
use super::petsc::PetscRank;
use super::{launcher, observer, with_threads};
use crate::build::Mode;
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::system_disk;
use crate::run::{self, Options};
use crate::show::RunObserver;

/// The ranks that this process belongs to. Dropped at the first rank, it ends the others: cleanly, or where this one panics
/// at once, since they may wait for it in the middle of their work. So it is at a worker that leaves before it was shut down.
#[derive(Debug)]
struct Ranks {
    group: Option<RankGroup>,
    /// Threads that a rank takes by default.
    threads: Option<usize>,
}

impl Ranks {
    /// Joins the other ranks, where a launcher has started several processes; `signal` is what an outside signal sets.
    #[cfg(feature = "petsc")]
    fn join(config: &Config, signal: &Arc<AtomicUsize>) -> Result<Self, Error> {
        if !launcher::is_launched() {
            return match launcher::size() {
                0 | 1 => Ok(Self { group: None, threads: None }),
                size => Err(Error::Ranks {
                    cause: format!(
                        "{size} processes were started without an MPI that numbers them: start them with mpirun, or \
                         with srun --mpi=pmix"
                    ),
                }),
            };
        }
        let engine =
            PetscRank::start(&config.analysis.petsc.options).map_err(|cause| Error::Ranks { cause })?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = Some((cores / engine.size_here().max(1)).max(1));
        Ok(Self { group: Some(RankGroup::new(Box::new(engine), Arc::clone(signal))), threads })
    }

    /// Joins the other ranks, where a launcher has started several processes; `signal` is what an outside signal sets.
    #[cfg(not(feature = "petsc"))]
    fn join(_: &Config, _: &Arc<AtomicUsize>) -> Result<Self, Error> {
        match launcher::size() {
            0 | 1 => Ok(Self { group: None, threads: None }),
            size => Err(Error::Ranks {
                cause: format!(
                    "this program was built for one process, and was started as {size}: build it with `cargo build --release \
                     --features petsc` where PETSc of complex numbers is installed (docs/howto/cluster.md), or start it \
                     without mpirun"
                ),
            }),
        }
    }

    /// Whether an outside signal has asked any rank to end; `signal` then has its number.
    fn are_signalled(&self, signal: &AtomicUsize) -> bool {
        let number = self.group.as_ref().map_or(0, RankGroup::signal);
        let _ = signal.compare_exchange(0, number, Ordering::SeqCst, Ordering::SeqCst);
        number != 0
    }
}

/// Does a command on the threads of all ranks: the first one does `work`, the others set the problem up and execute commands
/// until it ends.
pub(super) fn on_all(
    (config, source, mode): (&Config, &SourceMap, Mode),
    args: &WorkArgs,
    signal: &Signal,
    work: impl FnOnce(Options<'_>, Box<dyn RunObserver>) -> Result<ExitCode, Error> + Send,
) -> Result<ExitCode, Error> {
    let ranks = Ranks::join(config, signal.number())?;
    let outcome = with_threads(args.threads.or(ranks.threads), |threads| {
        let group = ranks.group.as_ref();
        if let Some(group) = group.filter(|group| group.role() == Role::Worker) {
            run::serve(group, config, source, mode);
            return Ok(ExitCode::Success);
        }
        let interrupted = || signal.received().is_some() || ranks.are_signalled(signal.number());
        let (disk, overwrite_policy) = (system_disk(), args.overwrite_policy());
        let options = Options {
            disk: &disk,
            overwrite_policy,
            threads,
            ranks: group,
            interrupted: &interrupted,
            searched: &|_| None,
        };
        work(options, observer(args))
    });
    signal.exit_code_of(outcome)
}

impl Drop for Ranks {
    fn drop(&mut self) {
        let Some(group) = &self.group else { return };
        match group.role() {
            Role::Leader if !std::thread::panicking() => group.shut_down(),
            Role::Worker if group.is_shut_down() => {}
            _ => group.abort(None),
        }
    }
}

/// Whether this process is a rank that says nothing, and has nothing to do in a command of one process.
pub(super) fn is_worker() -> bool {
    launcher::rank() != 0
}

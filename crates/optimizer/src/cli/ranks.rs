//! A command on several ranks: who leads, who follows, and how all end together.
//!
//! Started by `mpirun`, every rank reads the configuration and sets the problem up; rank 0 then does what the command says,
//! the others follow its orders ([`fluxmorph_geometry::ranks`]) and print nothing. PETSc is the engine where the program was
//! built with it; without, more than one rank is refused, since each would do the whole work and write into the same files.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use fluxmorph_geometry::ranks::{Member, Team};

use super::exit::ExitCode;
use super::launcher;
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::session;
use crate::setup::Purpose;

/// The ranks that this process belongs to. Dropped at the first rank, it ends the others: cleanly, or where this one panics
/// at once, since they may wait for it in the middle of their work. So it is at a rank that leaves before it was sent home.
#[derive(Debug)]
pub(super) struct Ranks {
    team: Option<Team>,
    /// Threads that a rank takes without being told.
    threads: Option<usize>,
}

impl Ranks {
    /// Joins the other ranks, where a launcher has started several processes; `signal` is what an outside signal sets.
    ///
    /// # Errors
    /// [`Error::Ranks`] where the program was built without PETSc, or that does not start.
    #[cfg(feature = "petsc")]
    pub(super) fn joined(config: &Config, signal: &Arc<AtomicUsize>) -> Result<Self, Error> {
        if !launcher::is_launched() {
            return match launcher::size() {
                0 | 1 => Ok(Self { team: None, threads: None }),
                size => Err(Error::Ranks {
                    cause: format!(
                        "{size} processes were started without an MPI that tells them their numbers: start them with mpirun, or \
                         with srun --mpi=pmix"
                    ),
                }),
            };
        }
        let engine = fluxmorph_petsc::Petsc::start(&config.analysis.petsc.options)
            .map_err(|cause| Error::Ranks { cause })?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = Some((cores / engine.size_here().max(1)).max(1));
        Ok(Self { team: Some(Team::new(Box::new(engine), Arc::clone(signal))), threads })
    }

    /// Joins the other ranks, where a launcher has started several processes; `signal` is what an outside signal sets.
    ///
    /// # Errors
    /// [`Error::Ranks`] where the program was built without PETSc, or that does not start.
    #[cfg(not(feature = "petsc"))]
    pub(super) fn joined(_: &Config, _: &Arc<AtomicUsize>) -> Result<Self, Error> {
        match launcher::size() {
            0 | 1 => Ok(Self { team: None, threads: None }),
            size => Err(Error::Ranks {
                cause: format!(
                    "this program was built for one process, and was started as {size}: build it with `cargo build --release \
                     --features petsc` where PETSc of complex numbers is installed (docs/howto/cluster.md), or start it \
                     without mpirun"
                ),
            }),
        }
    }

    /// The team; `None` for one process.
    pub(super) fn team(&self) -> Option<&Team> {
        self.team.as_ref()
    }

    /// Threads to take: as many as asked for, or this rank's share of the machine.
    pub(super) fn threads(&self, asked: Option<usize>) -> Option<usize> {
        asked.or(self.threads)
    }

    /// Whether an outside signal has asked any rank to end; `signal` then has its number.
    pub(super) fn are_signalled(&self, signal: &AtomicUsize) -> bool {
        let number = self.team.as_ref().map_or(0, Team::signal);
        let _ = signal.compare_exchange(0, number, Ordering::SeqCst, Ordering::SeqCst);
        number != 0
    }

    /// Where this rank only follows: sets the problem up, follows until the first rank ends, and says how this one ended.
    pub(super) fn followed(&self, config: &Config, source: &SourceMap, purpose: Purpose) -> Option<ExitCode> {
        let team = self.team.as_ref().filter(|team| team.member() == Member::Follower)?;
        session::follow(team, config, source, purpose);
        Some(ExitCode::Success)
    }
}

impl Drop for Ranks {
    fn drop(&mut self) {
        let Some(team) = &self.team else { return };
        match team.member() {
            Member::Leader if !std::thread::panicking() => team.end(),
            Member::Follower if team.has_ended() => {}
            _ => team.abort(ExitCode::Numerical as i32),
        }
    }
}

/// Whether this process has nothing to do and to say in a command that one process does.
pub(super) fn is_idle() -> bool {
    launcher::rank() != 0
}

//! Rank 0 sends commands, all ranks execute them: the one way in which work is distributed.
//!
//! A [`CommandHandler`] is what a rank holds of a distributed object (its rows of a matrix, its elements). Every rank
//! registers the same handlers in the same order while it sets up ([`RankGroup::register`]). [`CommandChannel::execute`] is
//! called at rank 0 alone: the command goes to every rank, whose [`CommandHandler::handle`] does its share, with collective
//! operations where it needs the others; then all agree whether it succeeded. A rank that fails inside a command names
//! itself and its cause, and rank 0 has an error like any other. A rank that panics, or gets a command for a handler that it
//! does not have, aborts all ranks: there is nothing left that they could agree on.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::communicator::Communicator;

/// What all ranks are to execute.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Command {
    /// Which work, as the handler names it.
    pub kind: u32,
    /// What it needs.
    pub numbers: Vec<f64>,
}

/// What a rank holds of a distributed object.
pub trait CommandHandler: Send {
    /// Does this rank's share of a command; what it returns counts at rank 0 only.
    ///
    /// # Errors
    /// What went wrong; before a collective operation it must be found on every rank.
    fn handle(&mut self, command: &Command, ranks: &dyn Communicator) -> Result<Vec<f64>, String>;
}

/// A command failed at one rank.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("rank {rank} of {ranks}: {cause}")]
pub struct RankError {
    /// The first rank that failed.
    pub rank: usize,
    /// How many there are.
    pub ranks: usize,
    /// What it says.
    pub cause: String,
}

/// The ranks of a program, and what this one holds of distributed objects.
#[derive(Clone, Debug)]
pub struct RankGroup {
    inner: Arc<Inner>,
}

struct Inner {
    handlers: Mutex<Vec<Option<Box<dyn CommandHandler>>>>,
    /// What an outside signal asked this rank for; zero for nothing.
    signal: Arc<AtomicUsize>,
    /// The same of all ranks, as of the last command.
    signal_of_all: AtomicUsize,
    /// Why this rank cannot execute commands.
    unready: Mutex<Option<String>>,
    /// Whether the workers have left their loops.
    is_shut_down: AtomicBool,
    /// What this rank has set up, as a number: that of all ranks must be the same.
    identity: AtomicU64,
    /// One command at a time.
    commands: Mutex<()>,
    /// Dropped last: handlers hold solvers of its engine.
    communicator: Box<dyn Communicator>,
}

impl std::fmt::Debug for Inner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RankGroup").field("communicator", &self.communicator).finish_non_exhaustive()
    }
}

/// A distributed object as rank 0 holds it: commands for its handlers. Where it is dropped there, every rank drops its
/// handler.
#[derive(Debug)]
pub struct CommandChannel {
    group: RankGroup,
    id: usize,
}

/// What this process does in the group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Rank 0: runs the program and sends commands.
    Leader,
    /// Any other rank: executes commands.
    Worker,
}

/// Numbers of the head of a message: what, which handler, which kind, how many numbers.
const HEAD: usize = 4;

/// What a head announces.
const EXECUTE: f64 = 1.0;
const RELEASE: f64 = 2.0;
const SHUT_DOWN: f64 = 3.0;

/// What a rank says after its share.
const SUCCEEDED: f64 = 0.0;
const FAILED: f64 = 1.0;

impl RankGroup {
    /// The group of an engine's ranks; `signal` is what an outside signal asks this rank for, zero for nothing.
    pub fn new(communicator: Box<dyn Communicator>, signal: Arc<AtomicUsize>) -> Self {
        let inner = Inner {
            communicator,
            handlers: Mutex::default(),
            signal,
            signal_of_all: AtomicUsize::new(0),
            unready: Mutex::default(),
            is_shut_down: AtomicBool::new(false),
            identity: AtomicU64::new(0),
            commands: Mutex::default(),
        };
        Self { inner: Arc::new(inner) }
    }

    /// Number of this rank.
    pub fn rank(&self) -> usize {
        self.inner.communicator.rank()
    }

    /// How many ranks there are.
    pub fn size(&self) -> usize {
        self.inner.communicator.size()
    }

    /// Whether this rank leads or works.
    pub fn role(&self) -> Role {
        if self.rank() == 0 { Role::Leader } else { Role::Worker }
    }

    /// Registers this rank's handler of a distributed object. All ranks register the same ones in the same order.
    pub fn register(&self, handler: Box<dyn CommandHandler>) -> CommandChannel {
        let mut handlers = self.handlers();
        handlers.push(Some(handler));
        CommandChannel { group: self.clone(), id: handlers.len() - 1 }
    }

    /// Says what this rank has set up, as a number of at most 53 bits; a rank with another one than the first cannot execute
    /// its commands, and is named with the next.
    pub fn set_identity(&self, identity: u64) {
        self.inner.identity.store(identity & ((1 << 53) - 1), Ordering::SeqCst);
    }

    /// What an outside signal has asked any rank for, as far as a command has reported it; zero for nothing.
    pub fn signal(&self) -> usize {
        self.inner.signal_of_all.load(Ordering::SeqCst)
    }

    /// The loop of a worker: executes commands until the leader shuts the group down. `ready` is how this rank's set-up
    /// went, which is reported with the first command.
    pub fn serve(&self, ready: Result<(), String>) {
        *self.inner.unready.lock().unwrap_or_else(PoisonError::into_inner) = ready.err();
        loop {
            let mut head = [0.0; HEAD];
            self.ranks().broadcast(&mut head);
            let [what, id, kind, length] = head;
            if what == SHUT_DOWN {
                self.inner.is_shut_down.store(true, Ordering::SeqCst);
                // In the order in which all ranks have registered them.
                self.handlers().clear();
                return;
            }
            if what == RELEASE {
                self.release(id as usize);
                continue;
            }
            let mut command = Command { kind: kind as u32, numbers: vec![0.0; length as usize] };
            self.ranks().broadcast(&mut command.numbers);
            // The leader has the error.
            let _ = self.execute(id as usize, &command);
        }
    }

    /// Ends the loops of all workers; called by the leader.
    pub fn shut_down(&self) {
        if self.inner.is_shut_down.swap(true, Ordering::SeqCst) {
            return;
        }
        self.ranks().broadcast(&mut [SHUT_DOWN, 0.0, 0.0, 0.0]);
        self.handlers().clear();
    }

    /// Whether the leader has shut the group down.
    pub fn is_shut_down(&self) -> bool {
        self.inner.is_shut_down.load(Ordering::SeqCst)
    }

    /// Ends the processes of all ranks at once, because of `cause` where there is something to say.
    pub fn abort(&self, cause: Option<&str>) -> ! {
        self.ranks().abort(cause)
    }

    fn ranks(&self) -> &dyn Communicator {
        &*self.inner.communicator
    }

    fn handlers(&self) -> MutexGuard<'_, Vec<Option<Box<dyn CommandHandler>>>> {
        self.inner.handlers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn release(&self, id: usize) {
        let handler = self.handlers().get_mut(id).and_then(Option::take);
        drop(handler);
    }

    /// This rank's share of a command, and whether all did theirs.
    fn execute(&self, id: usize, command: &Command) -> Result<Vec<f64>, RankError> {
        let unready = self.inner.unready.lock().unwrap_or_else(PoisonError::into_inner).clone();
        // All ranks hear of it before any begins: a share needs the others'.
        self.agree(unready.map_or(Ok(()), Err))?;
        let outcome = {
            let mut handlers = self.handlers();
            let Some(Some(handler)) = handlers.get_mut(id) else {
                self.abort(Some(&format!("there is no handler {id}")))
            };
            catch_unwind(AssertUnwindSafe(|| handler.handle(command, self.ranks())))
                .unwrap_or_else(|_| self.abort(Some("its share of a command panicked")))
        };
        let (numbers, own) = match outcome {
            Ok(numbers) => (numbers, Ok(())),
            Err(cause) => (Vec::new(), Err(cause)),
        };
        self.agree(own).map(|()| numbers)
    }

    /// Whether all ranks did their share; the first that did not is named at rank 0, and every rank knows that one did not.
    fn agree(&self, own: Result<(), String>) -> Result<(), RankError> {
        let signal = self.inner.signal.load(Ordering::SeqCst) as f64;
        let message = own.as_ref().err().cloned().unwrap_or_default();
        let identity = self.inner.identity.load(Ordering::SeqCst) as f64;
        let mut report = vec![if own.is_ok() { SUCCEEDED } else { FAILED }, signal, identity];
        report.extend(message.bytes().map(f64::from));
        let all = self.ranks().gather(&report);
        let differs = |report: &[f64]| report[2] != all[0][2];
        let failed = all.iter().position(|report| report[0] == FAILED || differs(report));
        let signal = all.iter().map(|report| report[1]).fold(0.0, f64::max);
        let mut verdict = [failed.map_or(-1.0, |rank| rank as f64), signal];
        self.ranks().broadcast(&mut verdict);
        self.inner.signal_of_all.fetch_max(verdict[1] as usize, Ordering::SeqCst);
        if verdict[0] < 0.0 {
            return Ok(());
        }
        let rank = verdict[0] as usize;
        let cause = match all.get(rank) {
            Some(report) if report[0] != FAILED => {
                "it has set up another problem than rank 0: configuration, mesh file and program must be the same on all \
                 machines"
                    .to_owned()
            }
            Some(report) => {
                let bytes: Vec<u8> = report[3..].iter().map(|&byte| byte as u8).collect();
                String::from_utf8_lossy(&bytes).into_owned()
            }
            None => own.err().unwrap_or_else(|| "another rank failed".to_owned()),
        };
        Err(RankError { rank, ranks: self.size(), cause })
    }
}

impl CommandChannel {
    /// Has every rank do its share; what that of rank 0 returned.
    ///
    /// # Errors
    /// [`RankError`] of the first rank that failed.
    ///
    /// # Panics
    /// At any rank but 0, whose set-up must not send commands.
    pub fn execute(&self, kind: u32, numbers: Vec<f64>) -> Result<Vec<f64>, RankError> {
        let group = &self.group;
        assert_eq!(group.role(), Role::Leader, "only rank 0 sends commands");
        if group.is_shut_down() {
            let cause = "the workers have been shut down".to_owned();
            return Err(RankError { rank: 0, ranks: group.size(), cause });
        }
        let _one = group.inner.commands.lock().unwrap_or_else(PoisonError::into_inner);
        let mut command = Command { kind, numbers };
        let length = command.numbers.len() as f64;
        group.ranks().broadcast(&mut [EXECUTE, self.id as f64, f64::from(kind), length]);
        group.ranks().broadcast(&mut command.numbers);
        group.execute(self.id, &command)
    }

    /// The group.
    pub fn group(&self) -> &RankGroup {
        &self.group
    }
}

impl Drop for CommandChannel {
    fn drop(&mut self) {
        let group = &self.group;
        // A panic may have left the others in the middle of a command: then no more is said, and the process ends them.
        let is_served = !group.is_shut_down() && !std::thread::panicking();
        if group.role() == Role::Leader && is_served {
            let _one = group.inner.commands.lock().unwrap_or_else(PoisonError::into_inner);
            group.ranks().broadcast(&mut [RELEASE, self.id as f64, 0.0, 0.0]);
            group.release(self.id);
        }
    }
}

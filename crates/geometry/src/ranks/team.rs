//! Rank 0 gives orders, all ranks follow: the one way in which work is shared out.
//!
//! A [`Part`] is what a rank holds of something shared out (its rows of a matrix, its elements). Every rank makes the same
//! parts in the same order while it sets up ([`Team::share`]). [`Shared::order`] is called at rank 0 alone: the order goes to
//! every rank, which does its share in [`Part::work`], with collective operations where it needs the others; then all agree
//! whether it went well. A rank that fails inside an order names itself and its cause, and rank 0 has an error like any
//! other. A rank that panics, or is told of a part that it does not have, ends all ranks: there is nothing left that
//! they could agree on.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::ranks::communicator::Communicator;

/// What a rank is told to do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Order {
    /// Which work, as the part names it.
    pub kind: u32,
    /// What it needs.
    pub numbers: Vec<f64>,
}

/// What a rank holds of something shared out.
pub trait Part: Send {
    /// Does this rank's share of an order; what it returns counts at rank 0 only.
    ///
    /// # Errors
    /// What went wrong; before a collective operation it must be found on every rank.
    fn work(&mut self, order: &Order, ranks: &dyn Communicator) -> Result<Vec<f64>, String>;
}

/// An order failed at one rank.
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

/// The ranks of a program, and what this one holds of what is shared out.
#[derive(Clone, Debug)]
pub struct Team {
    inner: Arc<Inner>,
}

struct Inner {
    parts: Mutex<Vec<Option<Box<dyn Part>>>>,
    /// What an outside signal asked this rank for; zero for nothing.
    signal: Arc<AtomicUsize>,
    /// The same of all ranks, as of the last order.
    signal_of_all: AtomicUsize,
    /// Why this rank cannot follow orders.
    unready: Mutex<Option<String>>,
    /// Whether nobody follows any more.
    ended: AtomicBool,
    /// What this rank has set up, as a number: that of all ranks must be the same.
    identity: AtomicU64,
    /// One order at a time.
    orders: Mutex<()>,
    /// Dropped last: parts hold solvers of its engine.
    communicator: Box<dyn Communicator>,
}

impl std::fmt::Debug for Inner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Team").field("communicator", &self.communicator).finish_non_exhaustive()
    }
}

/// Something shared out, as rank 0 holds it; where it is dropped there, every rank drops its part.
#[derive(Debug)]
pub struct Shared {
    team: Team,
    id: usize,
}

/// Which end of the team this process is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Member {
    /// Rank 0.
    Leader,
    /// Any other.
    Follower,
}

/// Numbers of the head of an order: what, which part, which kind, how many numbers.
const HEAD: usize = 4;

/// What a head announces.
const WORK: f64 = 1.0;
const DROP: f64 = 2.0;
const END: f64 = 3.0;

/// What a rank says when its share is done.
const DONE: f64 = 0.0;
const FAILED: f64 = 1.0;

/// The exit code of ranks that cannot go on, where the engine lets them have one.
const LOST: i32 = 4;

impl Team {
    /// The team of an engine's ranks; `signal` is what an outside signal asks this rank for, zero for nothing.
    pub fn new(communicator: Box<dyn Communicator>, signal: Arc<AtomicUsize>) -> Self {
        let inner = Inner {
            communicator,
            parts: Mutex::default(),
            signal,
            signal_of_all: AtomicUsize::new(0),
            unready: Mutex::default(),
            ended: AtomicBool::new(false),
            identity: AtomicU64::new(0),
            orders: Mutex::default(),
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

    /// Whether this rank leads.
    pub fn member(&self) -> Member {
        if self.rank() == 0 { Member::Leader } else { Member::Follower }
    }

    /// Shares something out: the part of this rank. All ranks share the same things in the same order.
    pub fn share(&self, part: Box<dyn Part>) -> Shared {
        let mut parts = self.parts();
        parts.push(Some(part));
        Shared { team: self.clone(), id: parts.len() - 1 }
    }

    /// Says what this rank has set up, as a number of at most 53 bits; a rank with another one than the first cannot follow
    /// its orders, and is named with the next.
    pub fn identify(&self, identity: u64) {
        self.inner.identity.store(identity & ((1 << 53) - 1), Ordering::SeqCst);
    }

    /// What an outside signal has asked any rank for, as far as it was told with an order; zero for nothing.
    pub fn signal(&self) -> usize {
        self.inner.signal_of_all.load(Ordering::SeqCst)
    }

    /// Follows orders until the leader ends the work; `ready` is how this rank's set-up went, which the leader is told with
    /// its first order.
    pub fn follow(&self, ready: Result<(), String>) {
        *self.inner.unready.lock().unwrap_or_else(PoisonError::into_inner) = ready.err();
        loop {
            let mut head = [0.0; HEAD];
            self.ranks().broadcast(&mut head);
            let [what, id, kind, length] = head;
            if what == END {
                self.inner.ended.store(true, Ordering::SeqCst);
                // In the order in which all ranks have made them.
                self.parts().clear();
                return;
            }
            if what == DROP {
                self.forget(id as usize);
                continue;
            }
            let mut order = Order { kind: kind as u32, numbers: vec![0.0; length as usize] };
            self.ranks().broadcast(&mut order.numbers);
            // The leader has the error.
            let _ = self.carry_out(id as usize, &order);
        }
    }

    /// Ends the work of all followers; called by the leader.
    pub fn end(&self) {
        if self.inner.ended.swap(true, Ordering::SeqCst) {
            return;
        }
        self.ranks().broadcast(&mut [END, 0.0, 0.0, 0.0]);
        self.parts().clear();
    }

    /// Whether the leader has ended the work.
    pub fn has_ended(&self) -> bool {
        self.inner.ended.load(Ordering::SeqCst)
    }

    /// Ends the processes of all ranks at once.
    pub fn abort(&self, exit_code: i32) -> ! {
        self.ranks().abort(exit_code)
    }

    fn ranks(&self) -> &dyn Communicator {
        &*self.inner.communicator
    }

    fn parts(&self) -> MutexGuard<'_, Vec<Option<Box<dyn Part>>>> {
        self.inner.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn forget(&self, id: usize) {
        let part = self.parts().get_mut(id).and_then(Option::take);
        drop(part);
    }

    /// This rank's share of an order, and whether all did theirs.
    fn carry_out(&self, id: usize, order: &Order) -> Result<Vec<f64>, RankError> {
        let unready = self.inner.unready.lock().unwrap_or_else(PoisonError::into_inner).clone();
        // All ranks hear of it before any begins: a share needs the others'.
        self.agree(unready.map_or(Ok(()), Err))?;
        let outcome = {
            let mut parts = self.parts();
            let Some(Some(part)) = parts.get_mut(id) else { self.lost(&format!("there is no part {id}")) };
            catch_unwind(AssertUnwindSafe(|| part.work(order, self.ranks())))
                .unwrap_or_else(|_| self.lost("its share of an order panicked"))
        };
        let (numbers, own) = match outcome {
            Ok(numbers) => (numbers, Ok(())),
            Err(cause) => (Vec::new(), Err(cause)),
        };
        self.agree(own).map(|()| numbers)
    }

    /// Says why and ends all ranks.
    fn lost(&self, cause: &str) -> ! {
        let line = format!("rank {} of {} cannot go on: {cause}\n", self.rank(), self.size());
        let _ = std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes());
        self.abort(LOST)
    }

    /// Whether all ranks did their share; the first that did not is named at rank 0, and every rank knows that one did not.
    fn agree(&self, own: Result<(), String>) -> Result<(), RankError> {
        let signal = self.inner.signal.load(Ordering::SeqCst) as f64;
        let said = own.as_ref().err().cloned().unwrap_or_default();
        let identity = self.inner.identity.load(Ordering::SeqCst) as f64;
        let mut words = vec![if own.is_ok() { DONE } else { FAILED }, signal, identity];
        words.extend(said.bytes().map(f64::from));
        let all = self.ranks().gather(&words);
        let differs = |words: &[f64]| words[2] != all[0][2];
        let failed = all.iter().position(|words| words[0] == FAILED || differs(words));
        let signal = all.iter().map(|words| words[1]).fold(0.0, f64::max);
        let mut verdict = [failed.map_or(-1.0, |rank| rank as f64), signal];
        self.ranks().broadcast(&mut verdict);
        self.inner.signal_of_all.fetch_max(verdict[1] as usize, Ordering::SeqCst);
        if verdict[0] < 0.0 {
            return Ok(());
        }
        let rank = verdict[0] as usize;
        let cause = match all.get(rank) {
            Some(words) if words[0] != FAILED => {
                "it has set up another problem than rank 0: configuration, mesh file and program \
                                                  must be the same on all machines"
                    .to_owned()
            }
            Some(words) => {
                let bytes: Vec<u8> = words[3..].iter().map(|&byte| byte as u8).collect();
                String::from_utf8_lossy(&bytes).into_owned()
            }
            None => own.err().unwrap_or_else(|| "another rank failed".to_owned()),
        };
        Err(RankError { rank, ranks: self.size(), cause })
    }
}

impl Shared {
    /// Has every rank do its share; what rank 0's share returned.
    ///
    /// # Errors
    /// [`RankError`] of the first rank that failed.
    ///
    /// # Panics
    /// At any rank but 0, whose set-up must not give orders.
    pub fn order(&self, kind: u32, numbers: Vec<f64>) -> Result<Vec<f64>, RankError> {
        let team = &self.team;
        assert_eq!(team.member(), Member::Leader, "only rank 0 gives orders");
        if team.inner.ended.load(Ordering::SeqCst) {
            let cause = "the ranks have been sent home".to_owned();
            return Err(RankError { rank: 0, ranks: team.size(), cause });
        }
        let _one = team.inner.orders.lock().unwrap_or_else(PoisonError::into_inner);
        let mut order = Order { kind, numbers };
        let length = order.numbers.len() as f64;
        team.ranks().broadcast(&mut [WORK, self.id as f64, f64::from(kind), length]);
        team.ranks().broadcast(&mut order.numbers);
        team.carry_out(self.id, &order)
    }

    /// The team.
    pub fn team(&self) -> &Team {
        &self.team
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // A panic may have left the others in the middle of an order: then no more is said, and the process ends them.
        let followed = !self.team.inner.ended.load(Ordering::SeqCst) && !std::thread::panicking();
        if self.team.member() == Member::Leader && followed {
            let _one = self.team.inner.orders.lock().unwrap_or_else(PoisonError::into_inner);
            self.team.ranks().broadcast(&mut [DROP, self.id as f64, 0.0, 0.0]);
            self.team.forget(self.id);
        }
    }
}

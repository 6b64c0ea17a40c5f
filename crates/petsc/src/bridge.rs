//! The functions of `bridge.c` as safe ones: lengths are checked here, and one call is made at a time.
//!
//! PETSc is not made for several threads. MPI is started so that any thread may call it, one at a time: a lock sees to that.

#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_double, c_int};
use std::sync::{Mutex, MutexGuard, PoisonError};

use fluxmorph_geometry::ranks::{Krylov, SolverOptions};

/// A solver of `bridge.c`, which alone knows what is in it.
#[repr(C)]
struct RawSolver {
    _private: [u8; 0],
}

unsafe extern "C" {
    fn fm_message() -> *const c_char;
    fn fm_start() -> c_int;
    fn fm_finish() -> c_int;
    fn fm_rank() -> c_int;
    fn fm_size() -> c_int;
    fn fm_size_here() -> c_int;
    fn fm_abort(code: c_int);
    fn fm_broadcast(numbers: *mut c_double, count: i64);
    fn fm_sum(numbers: *mut c_double, count: i64);
    fn fm_gather_counts(own: i64, all: *mut i64);
    fn fm_gather(own: *const c_double, count: i64, all: *mut c_double, counts: *const i64);
    fn fm_options(text: *const c_char) -> c_int;
    fn fm_option_default(name: *const c_char, value: *const c_char) -> c_int;
    fn fm_option_used(name: *const c_char) -> c_int;
    fn fm_solver_create(
        own: i64,
        count: i64,
        inside: *const i32,
        outside: *const i32,
        prefix: *const c_char,
        tolerance: c_double,
        max_iterations: c_int,
        symmetric: c_int,
        created: *mut *mut RawSolver,
    ) -> c_int;
    fn fm_solver_set(
        solver: *mut RawSolver,
        starts: *const u32,
        columns: *const u32,
        values: *const c_double,
    ) -> c_int;
    fn fm_solver_solve(
        solver: *mut RawSolver,
        right_side: *const c_double,
        solution: *mut c_double,
        tolerance: c_double,
        iterations: *mut c_int,
        residual: *mut c_double,
        reason: *mut c_int,
    ) -> c_int;
    fn fm_reason(reason: c_int) -> *const c_char;
    fn fm_solver_destroy(solver: *mut RawSolver);
}

/// One call at a time.
static CALLS: Mutex<()> = Mutex::new(());

fn calling() -> MutexGuard<'static, ()> {
    CALLS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The outcome that a code stands for.
fn outcome(code: c_int) -> Result<(), String> {
    if code == 0 {
        return Ok(());
    }
    // SAFETY: the function returns a static buffer that is always terminated; the lock of the caller keeps it unchanged.
    let text = unsafe { CStr::from_ptr(fm_message()) }.to_string_lossy().into_owned();
    Err(if text.is_empty() { format!("PETSc ended with the error {code}") } else { text })
}

/// A text as C has it; what follows a zero byte is left out.
fn text(text: &str) -> CString {
    let bytes = text.split('\0').next().unwrap_or_default();
    CString::new(bytes).expect("there is no zero byte left")
}

/// Starts MPI and PETSc; once in a process.
pub(crate) fn start() -> Result<(), String> {
    let _one = calling();
    // SAFETY: takes nothing; the caller starts once.
    outcome(unsafe { fm_start() })
}

/// Ends PETSc and MPI; nothing of this module may be called after it.
pub(crate) fn finish() {
    let _one = calling();
    // SAFETY: takes nothing; the caller has started, and calls nothing after.
    unsafe { fm_finish() };
}

/// Number of this rank, how many there are, and how many on this machine.
pub(crate) fn places() -> (usize, usize, usize) {
    let _one = calling();
    // SAFETY: takes nothing; MPI is started.
    let [rank, size, here] = unsafe { [fm_rank(), fm_size(), fm_size_here()] };
    let number = |n: c_int| usize::try_from(n).unwrap_or(0);
    (number(rank), number(size), number(here))
}

/// Ends all ranks; does not wait for a call of another thread, which may never end.
pub(crate) fn abort(code: i32) -> ! {
    // SAFETY: takes a number; MPI ends the process.
    unsafe { fm_abort(code) };
    std::process::exit(code)
}

/// Overwrites the numbers of every rank by those of rank 0.
pub(crate) fn broadcast(numbers: &mut [f64]) {
    let _one = calling();
    // SAFETY: pointer and length are those of a slice that outlives the call.
    unsafe { fm_broadcast(numbers.as_mut_ptr(), numbers.len() as i64) }
}

/// Overwrites the numbers of rank 0 by the sums over all ranks.
pub(crate) fn sum(numbers: &mut [f64]) {
    let _one = calling();
    // SAFETY: pointer and length are those of a slice that outlives the call.
    unsafe { fm_sum(numbers.as_mut_ptr(), numbers.len() as i64) }
}

/// The numbers of every rank, at rank 0, of which there are `size` in all; empty elsewhere.
pub(crate) fn gather(own: &[f64], (rank, size): (usize, usize)) -> Vec<Vec<f64>> {
    let _one = calling();
    let mut counts = vec![0i64; if rank == 0 { size } else { 0 }];
    // SAFETY: at rank 0 there is room for one count a rank; elsewhere the pointer is not used.
    unsafe { fm_gather_counts(own.len() as i64, counts.as_mut_ptr()) };
    let total: i64 = counts.iter().sum();
    let mut all = vec![0.0; usize::try_from(total).unwrap_or(0)];
    // SAFETY: at rank 0 there is room for all that the counts, known since, say; elsewhere neither pointer is used.
    unsafe { fm_gather(own.as_ptr(), own.len() as i64, all.as_mut_ptr(), counts.as_ptr()) };
    let mut rest = all.as_slice();
    counts
        .iter()
        .map(|&count| {
            let (first, others) = rest.split_at(count as usize);
            rest = others;
            first.to_vec()
        })
        .collect()
}

/// Puts a user's options into the database.
pub(crate) fn insert_options(options: &str) -> Result<(), String> {
    let _one = calling();
    let options = text(options);
    // SAFETY: a terminated text that outlives the call.
    outcome(unsafe { fm_options(options.as_ptr()) })
}

/// Sets an option unless it is set.
pub(crate) fn option_default(name: &str, value: &str) -> Result<(), String> {
    let _one = calling();
    let (name, value) = (text(name), text(value));
    // SAFETY: terminated texts that outlive the call.
    outcome(unsafe { fm_option_default(name.as_ptr(), value.as_ptr()) })
}

/// Whether a solver has asked for an option.
pub(crate) fn option_used(name: &str) -> bool {
    let _one = calling();
    let name = text(name);
    // SAFETY: a terminated text that outlives the call.
    unsafe { fm_option_used(name.as_ptr()) != 0 }
}

/// What the rows of a rank are like when a solver is made.
pub(crate) struct Shape<'a> {
    /// Equations of all ranks.
    pub(crate) count: usize,
    /// Entries of every own row in columns of this rank.
    pub(crate) inside: &'a [i32],
    /// Entries of every own row in columns of other ranks.
    pub(crate) outside: &'a [i32],
}

/// A solver of PETSc.
#[derive(Debug)]
pub(crate) struct Solver {
    raw: *mut RawSolver,
    own: usize,
}

// SAFETY: nothing in it belongs to a thread, and the lock allows one call at a time.
unsafe impl Send for Solver {}

impl Solver {
    /// Collective.
    ///
    /// # Panics
    /// Unless `inside` and `outside` have one number a row.
    pub(crate) fn new(shape: &Shape<'_>, prefix: &str, options: &SolverOptions) -> Result<Self, String> {
        assert_eq!(shape.inside.len(), shape.outside.len(), "one number a row");
        let _one = calling();
        let prefix = text(prefix);
        let (tolerance, symmetric) = (options.tolerance, c_int::from(options.krylov == Krylov::Cocg));
        let own = shape.inside.len();
        let mut raw = std::ptr::null_mut();
        let limit = c_int::try_from(options.max_iterations).unwrap_or(c_int::MAX);
        // SAFETY: both arrays have one number for each of `own` rows, as asserted; all pointers outlive the call.
        let code = unsafe {
            let (inside, outside) = (shape.inside.as_ptr(), shape.outside.as_ptr());
            let (own, count) = (own as i64, shape.count as i64);
            fm_solver_create(
                own,
                count,
                inside,
                outside,
                prefix.as_ptr(),
                tolerance,
                limit,
                symmetric,
                &mut raw,
            )
        };
        let outcome = outcome(code);
        drop(_one);
        // Dropped, it is destroyed, made to its end or not.
        let solver = Self { raw, own };
        outcome.map(|()| solver)
    }

    /// Takes the values of the own rows, pairs of numbers, and factors. Collective.
    ///
    /// # Panics
    /// Unless the rows are as many as the solver has, and the columns and values those of the rows.
    pub(crate) fn set(&mut self, starts: &[u32], columns: &[u32], values: &[[f64; 2]]) -> Result<(), String> {
        assert_eq!(starts.len(), self.own + 1, "one start a row, and the end");
        assert!(starts.is_sorted(), "rows follow each other");
        let entries = starts[self.own] as usize;
        assert!(columns.len() == entries && values.len() == entries, "one column and value an entry");
        let _one = calling();
        // SAFETY: the solver is one that was created; the arrays have the lengths that the starts say, as asserted.
        outcome(unsafe {
            fm_solver_set(self.raw, starts.as_ptr(), columns.as_ptr(), values.as_flattened().as_ptr())
        })
    }

    /// Solves; iterations, true relative residual, and the name of what the iteration ended with. Collective.
    ///
    /// # Panics
    /// Unless both vectors have one pair of numbers a row.
    pub(crate) fn solve(
        &mut self,
        right_side: &[[f64; 2]],
        solution: &mut [[f64; 2]],
        tolerance: f64,
    ) -> Result<(usize, f64, String), String> {
        assert!(right_side.len() == self.own && solution.len() == self.own, "one pair a row");
        let _one = calling();
        let (mut iterations, mut residual, mut reason): (c_int, c_double, c_int) = (0, f64::NAN, 0);
        // SAFETY: the solver is one that was created; both vectors have a pair for each of its rows, as asserted.
        outcome(unsafe {
            let (b, x) = (right_side.as_flattened().as_ptr(), solution.as_flattened_mut().as_mut_ptr());
            fm_solver_solve(self.raw, b, x, tolerance, &mut iterations, &mut residual, &mut reason)
        })?;
        // SAFETY: the reason is one that the library gave, and its name a static text that is terminated.
        let reason = unsafe { CStr::from_ptr(fm_reason(reason)) }.to_string_lossy().into_owned();
        Ok((usize::try_from(iterations).unwrap_or(0), residual, reason))
    }
}

impl Drop for Solver {
    /// Collective.
    fn drop(&mut self) {
        let _one = calling();
        // SAFETY: created once, destroyed once; null is allowed.
        unsafe { fm_solver_destroy(self.raw) }
    }
}

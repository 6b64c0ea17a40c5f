//! MPI and PETSc through the functions of `bridge.c`: lengths are checked here, and one call is made at a time.
//!
//! PETSc is not made for several threads. MPI is started so that any thread may call it, one at a time: a lock sees to that.
//! All functions but those that say otherwise are *collective*: every rank calls them, in the same order. Complex numbers are
//! pairs of real ones, real part first, as C has them.

#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_double, c_int};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use num_complex::Complex64;

/// A solver of `bridge.c`, which alone knows what is in it.
#[repr(C)]
struct RawSolver {
    _private: [u8; 0],
}

/// A [`Coarse`] as `bridge.c` has it.
#[repr(C)]
struct RawCoarse {
    starts: *const u32,
    columns: *const u32,
    weights: *const c_double,
    own: i64,
    shared: i64,
    diagonal_factor: c_double,
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
        coarse: *const RawCoarse,
        created: *mut *mut RawSolver,
    ) -> c_int;
    fn fm_solver_set(
        solver: *mut RawSolver,
        starts: *const u32,
        columns: *const u32,
        numbers: *const u32,
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

/// Whether MPI was started: it can be once in a process.
static STARTED: AtomicBool = AtomicBool::new(false);

/// This process as a rank of MPI, with PETSc behind it; one in a process. Both end where it and all its solvers are dropped,
/// which must be on the thread that has started them.
#[derive(Debug)]
pub struct Petsc {
    session: Arc<Session>,
    rank: usize,
    size: usize,
    size_here: usize,
}

/// The two libraries between their start and their end.
#[derive(Debug)]
struct Session;

impl Drop for Session {
    fn drop(&mut self) {
        let _one = calling();
        // SAFETY: takes nothing; the libraries were started, and whoever calls them holds the session.
        unsafe { fm_finish() };
    }
}

impl Petsc {
    /// Starts MPI and PETSc; `options`, in the form of PETSc's command line, come before those of
    /// [`Petsc::set_option_default`].
    ///
    /// # Errors
    /// What the libraries say; a second start in a process.
    pub fn start(options: &str) -> Result<Self, String> {
        if STARTED.swap(true, Ordering::SeqCst) {
            return Err("MPI was started before in this process".to_owned());
        }
        let one = calling();
        // SAFETY: takes nothing, and is called once, as checked above.
        outcome(unsafe { fm_start() })?;
        let options = text(options);
        // SAFETY: takes nothing; MPI is started.
        let [rank, size, size_here] = unsafe { [fm_rank(), fm_size(), fm_size_here()] }
            .map(|number| usize::try_from(number).unwrap_or(0));
        // SAFETY: a terminated text that outlives the call.
        let inserted = outcome(unsafe { fm_options(options.as_ptr()) });
        drop(one);
        let petsc = Self { session: Arc::new(Session), rank, size, size_here };
        inserted.map(|()| petsc)
    }

    /// Number of this rank. Not collective.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// How many ranks there are. Not collective.
    pub fn size(&self) -> usize {
        self.size
    }

    /// How many of them this machine has. Not collective.
    pub fn size_here(&self) -> usize {
        self.size_here
    }

    /// Ends the processes of all ranks; does not wait for a call of another thread, which may never end. Not collective.
    pub fn abort(&self, code: i32) -> ! {
        // SAFETY: takes a number; MPI ends the process.
        unsafe { fm_abort(code) };
        std::process::exit(code)
    }

    /// Overwrites the numbers of every rank by those of rank 0.
    pub fn broadcast(&self, numbers: &mut [f64]) {
        let _one = calling();
        // SAFETY: pointer and length are those of a slice that outlives the call.
        unsafe { fm_broadcast(numbers.as_mut_ptr(), numbers.len() as i64) }
    }

    /// Overwrites the numbers of rank 0 by the sums over all ranks.
    pub fn sum(&self, numbers: &mut [f64]) {
        let _one = calling();
        // SAFETY: pointer and length are those of a slice that outlives the call.
        unsafe { fm_sum(numbers.as_mut_ptr(), numbers.len() as i64) }
    }

    /// The numbers of every rank, at rank 0; empty elsewhere.
    pub fn gather(&self, own: &[f64]) -> Vec<Vec<f64>> {
        let _one = calling();
        let mut counts = vec![0i64; if self.rank == 0 { self.size } else { 0 }];
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

    /// Sets an option unless it is set. Not collective.
    ///
    /// # Errors
    /// What PETSc says.
    pub fn set_option_default(&self, name: &str, value: &str) -> Result<(), String> {
        let _one = calling();
        let (name, value) = (text(name), text(value));
        // SAFETY: terminated texts that outlive the call.
        outcome(unsafe { fm_option_default(name.as_ptr(), value.as_ptr()) })
    }

    /// A solver for rows as `shape` says, called `prefix` in the options.
    ///
    /// # Errors
    /// What PETSc says.
    ///
    /// # Panics
    /// Unless `inside`, `outside` and the coarse space have the same rows, and all columns of this one are below
    /// `own + shared`.
    pub fn solver(&self, shape: &Shape<'_>, prefix: &str, settings: &Settings) -> Result<Solver, String> {
        Solver::new(Arc::clone(&self.session), shape, prefix, settings)
    }
}

/// How a solver iterates.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Relative residual at which the iteration stops [1].
    pub tolerance: f64,
    /// Iterations at most.
    pub max_iterations: usize,
    /// Whether the iteration is that of the bridge for complex symmetric matrices (conjugate orthogonal conjugate gradients),
    /// and not the one that the options name.
    pub is_complex_symmetric: bool,
}

/// What the rows of a rank are like when a solver is created.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'a> {
    /// Equations of all ranks.
    pub count: usize,
    /// Entries of every own row in columns of this rank.
    pub inside: &'a [i32],
    /// Entries of every own row in columns of other ranks.
    pub outside: &'a [i32],
    /// Where there is a second level.
    pub coarse: Option<Coarse<'a>>,
}

/// The prolongation from a coarse space onto the rows of a rank: real, compressed by rows.
#[derive(Clone, Copy, Debug)]
pub struct Coarse<'a> {
    /// Where the entries of every row begin, and where the last ones end.
    pub row_starts: &'a [u32],
    /// The column of every entry: first those that this rank has for itself, then those that all ranks have.
    pub columns: &'a [u32],
    /// Its weight.
    pub weights: &'a [f64],
    /// Columns that this rank has for itself.
    pub own: usize,
    /// Columns that all ranks have.
    pub shared: usize,
    /// What the diagonal entries of these are multiplied by in the coarse matrix.
    pub diagonal_factor: f64,
}

impl Coarse<'_> {
    /// The same for `bridge.c`; it must not outlive what this refers to.
    fn raw(&self, rows: usize) -> RawCoarse {
        let entries = self.row_starts.last().map_or(0, |&end| end as usize);
        assert!(self.row_starts.len() == rows + 1 && self.row_starts.is_sorted(), "one range a row");
        assert_eq!(
            (self.columns.len(), self.weights.len()),
            (entries, entries),
            "one column and weight an entry"
        );
        assert!(
            self.columns.iter().all(|&column| (column as usize) < self.own + self.shared),
            "columns there are"
        );
        RawCoarse {
            starts: self.row_starts.as_ptr(),
            columns: self.columns.as_ptr(),
            weights: self.weights.as_ptr(),
            own: self.own as i64,
            shared: self.shared as i64,
            diagonal_factor: self.diagonal_factor,
        }
    }
}

/// A solver of PETSc.
#[derive(Debug)]
pub struct Solver {
    raw: *mut RawSolver,
    own: usize,
    /// The libraries must not end before.
    _session: Arc<Session>,
}

// SAFETY: nothing in it belongs to a thread, and the lock allows one call at a time.
unsafe impl Send for Solver {}

impl Solver {
    fn new(
        session: Arc<Session>,
        shape: &Shape<'_>,
        prefix: &str,
        settings: &Settings,
    ) -> Result<Self, String> {
        assert_eq!(shape.inside.len(), shape.outside.len(), "one number a row");
        let coarse = shape.coarse.map(|coarse| coarse.raw(shape.inside.len()));
        let _one = calling();
        let prefix = text(prefix);
        let (tolerance, symmetric) = (settings.tolerance, c_int::from(settings.is_complex_symmetric));
        let own = shape.inside.len();
        let mut raw = std::ptr::null_mut();
        let limit = c_int::try_from(settings.max_iterations).unwrap_or(c_int::MAX);
        // SAFETY: all arrays have one number for each of `own` rows, as asserted, or those of the coarse space, which is null where
        // there is none, as many as its ranges say; all pointers outlive the call.
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
                coarse.as_ref().map_or(std::ptr::null(), std::ptr::from_ref),
                &mut raw,
            )
        };
        let outcome = outcome(code);
        drop(_one);
        // Dropped, it is destroyed, complete or not.
        let solver = Self { raw, own, _session: session };
        outcome.map(|()| solver)
    }

    /// Takes the values of the own rows, and factors; `columns` are those of the caller, with their numbers in the distributed
    /// matrix in `numbers`.
    ///
    /// # Errors
    /// What PETSc says.
    ///
    /// # Panics
    /// Unless the rows are as many as the solver has, the columns and values those of the rows, and all columns numbered.
    pub fn set(
        &mut self,
        starts: &[u32],
        columns: &[u32],
        numbers: &[u32],
        values: &[Complex64],
    ) -> Result<(), String> {
        assert_eq!(starts.len(), self.own + 1, "one start a row, and the end");
        assert!(starts.is_sorted(), "rows follow each other");
        let entries = starts[self.own] as usize;
        assert!(columns.len() == entries && values.len() == entries, "one column and value an entry");
        assert!(columns.iter().all(|&c| (c as usize) < numbers.len()), "every column has a number");
        let _one = calling();
        // SAFETY: the solver is one that was created; the arrays have the lengths that the starts say, and every column a number,
        // as asserted; a complex number is two doubles in C's order.
        outcome(unsafe {
            let (starts, columns, numbers) = (starts.as_ptr(), columns.as_ptr(), numbers.as_ptr());
            fm_solver_set(self.raw, starts, columns, numbers, values.as_ptr().cast())
        })
    }

    /// Solves until the true relative residual is at most `tolerance`: the iterations, that residual, and the name of what
    /// the iteration ended with.
    ///
    /// # Errors
    /// What PETSc says.
    ///
    /// # Panics
    /// Unless both vectors have one number a row.
    pub fn solve(
        &mut self,
        right_side: &[Complex64],
        solution: &mut [Complex64],
        tolerance: f64,
    ) -> Result<(usize, f64, String), String> {
        assert!(right_side.len() == self.own && solution.len() == self.own, "one number a row");
        let _one = calling();
        let (mut iterations, mut residual, mut reason): (c_int, c_double, c_int) = (0, f64::NAN, 0);
        // SAFETY: the solver is one that was created; both vectors have a number for each of its rows, as asserted;
        // a complex number is two doubles in C's order.
        outcome(unsafe {
            let (b, x) = (right_side.as_ptr().cast(), solution.as_mut_ptr().cast());
            fm_solver_solve(self.raw, b, x, tolerance, &mut iterations, &mut residual, &mut reason)
        })?;
        // SAFETY: the reason is one that the library gave, and its name a static text that is terminated.
        let reason = unsafe { CStr::from_ptr(fm_reason(reason)) }.to_string_lossy().into_owned();
        Ok((usize::try_from(iterations).unwrap_or(0), residual, reason))
    }
}

impl Solver {
    /// Whether a solver of any rank has asked for an option.
    pub fn is_option_used(&self, name: &str) -> bool {
        let _one = calling();
        let name = text(name);
        // SAFETY: a terminated text that outlives the call.
        unsafe { fm_option_used(name.as_ptr()) != 0 }
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

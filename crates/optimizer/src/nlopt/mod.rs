//! NLopt: the only folder that names the library. `gradient` has the methods that take derivatives, `derivative_free` those
//! that do not; both see scaled variables, and neither lets a panic cross the C boundary.

mod derivative_free;
mod first_step;
mod gradient;
mod level;
mod scaling;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

pub use derivative_free::{Search, maximise};
pub(crate) use first_step::ROUNDING;
pub use gradient::{Algorithm, CONSTRAINT_TOLERANCE, Ending, Minimisation, Outcome, Sample, minimise};

/// Below every objective: returning less makes NLopt stop.
const STOP_VALUE: f64 = -1e300;

/// Calls closures for the library: a panic is caught at the C boundary, and resumed after the library has returned.
#[derive(Default)]
struct PanicGuard {
    caught: Option<Box<dyn Any + Send>>,
}

impl PanicGuard {
    /// The closure's value; `None` where it panics.
    fn call<T>(&mut self, closure: impl FnOnce() -> T) -> Option<T> {
        catch_unwind(AssertUnwindSafe(closure)).map_err(|panic| self.caught = Some(panic)).ok()
    }

    fn has_caught(&self) -> bool {
        self.caught.is_some()
    }

    /// Resumes a caught panic.
    fn resume(self) {
        if let Some(panic) = self.caught {
            resume_unwind(panic);
        }
    }
}

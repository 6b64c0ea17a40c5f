//! NLopt: the only folder that names the library. `gradient` has the methods that take derivatives, `derivative_free` those
//! that do not; both see scaled variables, and neither lets a panic cross the C boundary.

mod derivative_free;
mod gradient;

pub use derivative_free::{Search, maximise};
pub use gradient::{Algorithm, CONSTRAINT_TOLERANCE, Ending, Minimisation, Outcome, Sample, minimise};

/// Below every objective: returning less makes NLopt stop.
const STOP_VALUE: f64 = -1e300;

//! Mesh regeneration alone: the prescribed motion of `[morph]`, and what becomes of the elements.
//!
//! [`path`] says where the moved nodes go, `moved` takes the mesh along, `report` measures what
//! comes out of it, `table` shows it, `session` writes the run directory, and `tune` searches for better elastic
//! parameters. Quality is that of the elements of the elastic body; those outside it do not move.

mod moved;
pub mod path;
mod report;
mod session;
mod table;
mod tune;

pub use moved::{MovedMesh, move_mesh};
pub use report::{CaseReport, CaseResult, Inversion, MorphReport, QualityShares, WorstElement};
pub use session::{MotionSummary, inspect, morph};
pub use table::{csv, text};
pub use tune::{Parameters, TuneReport, TunedRegion};

//! `[accuracy]`: what is done to know how exact the objective is.

use crate::config::table::table;

table! {
    /// What is done to know how exact the objective is. `docs/theory.md` tells how the error is estimated.
    ///
    /// ```toml
    /// [accuracy]
    /// estimate = true
    /// ```
    pub struct Accuracy: Default {
        /// Whether the error of the objective that comes from the mesh is estimated: by `solve`, and by `run` at the first and
        /// the best design, unless `output.verify_refinement` is 0. With elements of first order and linear materials alone, and
        /// in one process. Default: where it costs no more than three evaluations, or two seconds.
        estimate: Option<bool> = FLAG;
    }
}

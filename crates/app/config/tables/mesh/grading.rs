//! Ranges that the generators share: how cells grow, and how all of them are refined.

use crate::config::value::range::Range;

/// Ratios of neighbouring cells.
pub(super) const GROWTHS: Range = Range::closed(1.0, 100.0);
/// Factors that all sizes of a mesh are divided by.
pub(super) const REFINEMENTS: Range = Range::closed(0.25, 20.0);

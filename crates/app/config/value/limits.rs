//! Bounds of everything that is read.

/// Longest list that is read: far beyond any use, and small enough to keep messages and memory bounded.
pub(in crate::config) const LONGEST_LIST: usize = 100_000;

/// Longest length and farthest coordinate of a device [m]: far beyond any use, and its powers stay far from overflow.
pub(crate) const LONGEST_LENGTH: f64 = 1e6;

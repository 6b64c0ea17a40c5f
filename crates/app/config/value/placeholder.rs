//! What stands in for values that are missing or faulty.

use super::choice::Choice;

/// What stands in for a required value that is missing or faulty. A configuration with a fault is never handed out, so no
/// caller ever sees one; that of numbers is NaN, with which no later comparison holds.
pub(in crate::config) trait Placeholder {
    /// The value.
    fn placeholder() -> Self;
}

impl Placeholder for usize {
    fn placeholder() -> Self {
        0
    }
}

impl Placeholder for f64 {
    fn placeholder() -> Self {
        f64::NAN
    }
}

impl<T: Placeholder, const N: usize> Placeholder for [T; N] {
    fn placeholder() -> Self {
        std::array::from_fn(|_| T::placeholder())
    }
}

impl Placeholder for String {
    fn placeholder() -> Self {
        Self::new()
    }
}

impl<T: Choice> Placeholder for T {
    fn placeholder() -> Self {
        Self::choices()[0].1
    }
}

impl<T> Placeholder for Vec<T> {
    fn placeholder() -> Self {
        Self::new()
    }
}

//! The bound on all terms of a worst case, which is a variable of the method.

use super::scaling::SCALED_SPAN;

/// The bound `t` on the terms of a worst case as NLopt sees it: in units that make its range as wide as that of a variable.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// The worst value at the start.
    value: f64,
    /// Size of a scaled unit.
    pub(super) unit: f64,
}

impl Level {
    /// Falls by two thirds of its range at most, and rises by one: by the size of the first value, or by one where that is zero.
    pub(super) fn around(value: f64) -> Self {
        let size = if value == 0.0 { 1.0 } else { value.abs() };
        Self { value, unit: 3.0 * size / SCALED_SPAN }
    }

    pub(super) fn start(self) -> f64 {
        self.value / self.unit
    }

    pub(super) fn lower(self) -> f64 {
        self.start() - 2.0 / 3.0 * SCALED_SPAN
    }

    pub(super) fn upper(self) -> f64 {
        self.start() + SCALED_SPAN / 3.0
    }
}

//! The interval a number must lie in, with its words for messages.

/// One end of a [`Range`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum End {
    /// The bound itself is left out.
    Open(f64),
    /// The bound itself is allowed.
    Closed(f64),
    /// No bound.
    None,
}

/// An interval of numbers; every interval holds finite numbers only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    lower: End,
    upper: End,
}

impl Range {
    /// Every finite number.
    pub(crate) const FINITE: Self = Self { lower: End::None, upper: End::None };
    /// `> 0`.
    pub(crate) const POSITIVE: Self = Self { lower: End::Open(0.0), upper: End::None };
    /// `>= 0`.
    pub(crate) const NOT_NEGATIVE: Self = Self { lower: End::Closed(0.0), upper: End::None };

    /// `lower < x < upper`.
    pub(crate) const fn open(lower: f64, upper: f64) -> Self {
        Self { lower: End::Open(lower), upper: End::Open(upper) }
    }

    /// `lower <= x <= upper`.
    pub(crate) const fn closed(lower: f64, upper: f64) -> Self {
        Self { lower: End::Closed(lower), upper: End::Closed(upper) }
    }

    /// `lower <= x < upper`.
    pub(crate) const fn half_open(lower: f64, upper: f64) -> Self {
        Self { lower: End::Closed(lower), upper: End::Open(upper) }
    }

    /// The lower end.
    pub(crate) fn lower(&self) -> End {
        self.lower
    }

    /// The upper end.
    pub(crate) fn upper(&self) -> End {
        self.upper
    }

    /// Whether the number lies inside.
    pub(crate) fn contains(&self, value: f64) -> bool {
        let above = match self.lower {
            End::Open(bound) => value > bound,
            End::Closed(bound) => value >= bound,
            End::None => true,
        };
        let below = match self.upper {
            End::Open(bound) => value < bound,
            End::Closed(bound) => value <= bound,
            End::None => true,
        };
        value.is_finite() && above && below
    }

    /// In words: `greater than 0 m and at most 1 m`.
    pub(crate) fn describe(&self, unit: &str) -> String {
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let lower = match self.lower {
            End::Open(bound) => Some(format!("greater than {}{unit}", written(bound))),
            End::Closed(bound) => Some(format!("at least {}{unit}", written(bound))),
            End::None => None,
        };
        let upper = match self.upper {
            End::Open(bound) => Some(format!("less than {}{unit}", written(bound))),
            End::Closed(bound) => Some(format!("at most {}{unit}", written(bound))),
            End::None => None,
        };
        match (lower, upper) {
            (Some(lower), Some(upper)) => format!("{lower} and {upper}"),
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => "a finite number".to_owned(),
        }
    }
}

/// All digits of a number, by a power of ten where they would be a line of zeros.
pub(super) fn written(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-6..1e16 => format!("{value}"),
        _ => format!("{value:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::Range;

    #[test]
    fn ranges_hold_finite_numbers_only_and_know_their_words() {
        assert!(Range::FINITE.contains(-1.0) && !Range::FINITE.contains(f64::NAN));
        assert!(!Range::POSITIVE.contains(0.0) && !Range::POSITIVE.contains(f64::INFINITY));
        assert!(Range::closed(0.0, 1.0).contains(1.0) && !Range::half_open(0.0, 1.0).contains(1.0));
        assert_eq!(Range::open(-1.0, 0.5).describe(""), "greater than -1 and less than 0.5");
        assert_eq!(Range::NOT_NEGATIVE.describe("m"), "at least 0 m");
    }
}

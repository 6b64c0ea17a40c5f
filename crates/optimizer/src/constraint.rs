//! Inequality constraints: what must keep within a bound while the objective is optimised.
//!
//! A method sees `c = ±(value − bound) / scale`, satisfied where `c ≤ 0` and of order one: the scale is the bound
//! itself, so `c` is the relative distance from it. Quantities of the field are computed by [`crate::problem`].

use fluxmorph_remesh::{Moved, RemeshError};
use fluxmorph_solver::functional::Volume;

use crate::error::Error;
use crate::geometric;
use crate::nlopt::CONSTRAINT_TOLERANCE;
use crate::objective::Term;
use crate::problem::Shape;

/// A constraint of a problem.
#[derive(Debug)]
pub struct Constraint {
    /// Its name in the results.
    pub name: String,
    /// What is measured.
    pub quantity: Quantity,
    /// How it is limited.
    pub limit: Limit,
}

/// What a constraint measures.
#[derive(Debug)]
pub enum Quantity {
    /// A functional of the field; its weight is one.
    Field(Box<Term>),
    /// A volume [m³] or mass [kg].
    Volume(Volume),
    /// The least or greatest thickness [m] of the designed bodies, where the measure counts from `bound`.
    Thickness {
        /// By how much the worst place is beyond the bound.
        measure: geometric::ThicknessBound,
        /// The bound [m].
        bound: f64,
    },
}

/// A bound that differs from what is bounded by this factor is one of another unit, or decides nothing.
const FAR: f64 = 1e3;

/// How a value is limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// At most this, in SI.
    AtMost(f64),
    /// At most this multiple of the initial design's value.
    AtMostRatio(f64),
    /// At least this, in SI.
    AtLeast(f64),
    /// At least this multiple of the initial design's value.
    AtLeastRatio(f64),
}

impl Limit {
    /// The multiple of the initial value that it is; `None` for one in SI.
    pub fn share(self) -> Option<f64> {
        match self {
            Self::AtMostRatio(share) | Self::AtLeastRatio(share) => Some(share),
            Self::AtMost(_) | Self::AtLeast(_) => None,
        }
    }
}

/// A limit whose number is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The bound, in SI.
    pub value: f64,
    /// What `c` counts in: `c = slope · (value − bound)` [1 / unit of the value]; negative for a lower bound.
    slope: f64,
}

impl Quantity {
    /// Whether it is a functional of the field.
    pub fn is_of_field(&self) -> bool {
        matches!(self, Self::Field(_))
    }
}

impl Constraint {
    /// What limits the thickness; `None` of another quantity.
    fn thickness(&self) -> Option<&geometric::ThicknessBound> {
        match &self.quantity {
            Quantity::Thickness { measure, .. } => Some(measure),
            Quantity::Field(_) | Quantity::Volume(_) => None,
        }
    }

    /// Whether a search keeps more than its bound asks for: a hundredth of a thickness.
    pub fn has_margin(&self) -> bool {
        self.thickness().is_some()
    }

    /// The number of its [limits](Self::limits).
    pub fn limit_count(&self) -> Option<usize> {
        self.thickness()?.limit_count()
    }

    /// Limits that a method is shown at a design in its place, each `c ≤ 0` of order one with its derivatives, as [`ThicknessBound::limits`];
    /// `None` where it is shown itself.
    ///
    /// [`ThicknessBound::limits`]: geometric::ThicknessBound::limits
    pub fn limits(&self, p: &[f64]) -> Option<Vec<(f64, Vec<f64>)>> {
        self.thickness()?.limits(p)
    }

    /// Value and gradient of a quantity of the shape alone; `None` for one of the field.
    ///
    /// # Errors
    /// [`RemeshError::NotConverged`].
    pub fn of_shape(&self, moved: &Moved, shape: &Shape) -> Result<Option<(f64, Vec<f64>)>, RemeshError> {
        Ok(match &self.quantity {
            Quantity::Field(_) => None,
            Quantity::Volume(body) => {
                let nodal = moved.pull_back(&body.node_derivative(&moved.mesh))?;
                Some((body.value(&moved.mesh), shape.surface().gradient(&nodal)))
            }
            Quantity::Thickness { measure, bound } => {
                // Beyond a minimum is below it, beyond a maximum above.
                let sign = if matches!(self.limit, Limit::AtLeast(_)) { -1.0 } else { 1.0 };
                let (beyond, gradient) = measure.evaluate(shape, moved)?;
                Some((bound + sign * beyond, gradient.iter().map(|g| sign * g).collect()))
            }
        })
    }

    /// The bound, given the value at the initial design.
    ///
    /// # Errors
    /// [`Error::Constraint`] for a ratio to a value that is not positive.
    pub fn bound(&self, initial: f64) -> Result<Bound, Error> {
        let value = match self.limit {
            Limit::AtMost(value) | Limit::AtLeast(value) => value,
            Limit::AtMostRatio(ratio) | Limit::AtLeastRatio(ratio) if initial > 0.0 => ratio * initial,
            Limit::AtMostRatio(_) | Limit::AtLeastRatio(_) => {
                return Err(Error::Constraint {
                    name: self.name.clone(),
                    value: initial,
                    expected: "a value above zero for the bound to be a share of; give the bound itself instead",
                });
            }
        };
        Ok(self.bound_at(value, initial))
    }

    /// As [`Constraint::bound`] on another mesh than that of a bound which is `known`: that one where the initial value on this mesh
    /// is none that there are ratios to.
    ///
    /// # Errors
    /// As [`Constraint::bound`], where none is known.
    pub fn bound_beside(&self, known: Option<f64>, initial: f64) -> Result<Bound, Error> {
        match (self.bound(initial), known) {
            (Err(_), Some(value)) => Ok(self.bound_at(value, initial)),
            (bound, _) => bound,
        }
    }

    fn bound_at(&self, value: f64, initial: f64) -> Bound {
        let scale = [value, initial].into_iter().map(f64::abs).find(|&s| s > 0.0).unwrap_or(1.0);
        let sign = if matches!(self.limit, Limit::AtLeast(_) | Limit::AtLeastRatio(_)) { -1.0 } else { 1.0 };
        Bound { value, slope: sign / scale }
    }

    /// What is to be said of a bound that is far from the value of the initial design, on its other side or in size.
    pub fn far_bound(&self, initial: f64) -> Option<String> {
        let (Limit::AtMost(value) | Limit::AtLeast(value)) = self.limit else { return None };
        let share = value / initial;
        let is_other_side =
            share < 0.0 && value.is_sign_negative() == matches!(self.limit, Limit::AtLeast(_));
        let how = match share.abs() {
            far if !far.is_finite() || far == 0.0 => return None,
            _ if is_other_side => "of the other sign and kept by all of this sign".to_owned(),
            far if far >= FAR => format!("{far:.0e} times as much"),
            far if far <= 1.0 / FAR => format!("{far:.0e} of that"),
            _ => return None,
        };
        Some(format!(
            "`{}` is {initial:.4e} at the initial design, in SI, and its bound {value:.4e} is {how}: see whether its unit and its \
             sign are those that are meant",
            self.name
        ))
    }
}

impl Bound {
    /// `c` of a value: satisfied where not positive.
    pub fn excess(&self, value: f64) -> f64 {
        self.slope * (value - self.value)
    }

    /// What an excess is a share of, in words: the bound, of a bound of zero the initial value; in SI where both are zero.
    pub fn excess_is(&self) -> &'static str {
        match (self.value, self.slope.abs()) {
            (0.0, 1.0) => "in SI",
            (0.0, _) => "of the initial value",
            _ => "of it",
        }
    }

    /// `dc/dp` from the value's gradient.
    pub fn gradient(&self, gradient: &[f64]) -> Vec<f64> {
        gradient.iter().map(|g| self.slope * g).collect()
    }

    /// Whether a value keeps within the bound, but for rounding.
    pub fn is_satisfied(&self, value: f64) -> bool {
        self.excess(value) <= CONSTRAINT_TOLERANCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::objective::Label;
    use fluxmorph_geometry::RegionId;
    use fluxmorph_geometry::generate::{BlockParameters, block};
    use fluxmorph_solver::Functional;
    use fluxmorph_solver::functional::{Follow, Observed};

    fn constraint(limit: Limit) -> Constraint {
        let mesh = block(&BlockParameters::default()).expect("defaults are valid");
        let observed = Observed::Component { direction: [0.0, 0.0, 1.0] };
        let functional = Functional::observation(&mesh, RegionId::new(0), observed, Follow::Held)
            .expect("it has elements");
        let label =
            Label { kind: "field_component", region: None, coils: Vec::new(), frequency: None, load: None };
        let term = Term { functional, states: vec![0], weight: 1.0, label };
        Constraint { name: "field".to_owned(), quantity: Quantity::Field(Box::new(term)), limit }
    }

    #[test]
    fn a_bound_far_from_the_initial_value_is_said_to_be() {
        let said = |limit: Limit, initial: f64| constraint(limit).far_bound(initial).unwrap_or_default();
        assert!(said(Limit::AtLeast(15.0), 1.5e-5).contains("is 1e6 times as much"));
        assert!(said(Limit::AtMost(2e-6), 1.0).contains("is 2e-6 of that"));
        assert!(said(Limit::AtMost(2.0), -3.0).contains("of the other sign"));
        assert!(said(Limit::AtLeast(-2.0), 3.0).contains("of the other sign"));
        // What has to change its sign, what is near, and what belongs to the value itself.
        for limit in [
            Limit::AtMost(-2.0),
            Limit::AtLeast(-2.0),
            Limit::AtMost(0.0),
            Limit::AtMost(900.0),
            Limit::AtMostRatio(1e6),
        ] {
            let initial = if limit == Limit::AtLeast(-2.0) { -3.0 } else { 3.0 };
            assert_eq!(said(limit, initial), "", "{limit:?}");
        }
        assert_eq!(said(Limit::AtMost(2.0), 0.0), "");
    }

    #[test]
    fn the_excess_is_relative_to_the_bound_and_positive_beyond_it() {
        let upper = constraint(Limit::AtMost(4.0)).bound(7.0).expect("a number");
        assert_eq!((upper.excess(5.0), upper.excess(3.0)), (0.25, -0.25));
        let lower = constraint(Limit::AtLeast(4.0)).bound(7.0).expect("a number");
        assert_eq!((lower.excess(5.0), lower.excess(3.0)), (-0.25, 0.25));
        let of_zero = |initial| constraint(Limit::AtMost(0.0)).bound(initial).expect("a number");
        assert_eq!((of_zero(4.0).excess(1.0), of_zero(0.0).excess(1.0)), (0.25, 1.0));
        let said = [lower, of_zero(-4.0), of_zero(0.0)].map(|bound| bound.excess_is());
        assert_eq!(said, ["of it", "of the initial value", "in SI"]);
        assert_eq!(lower.gradient(&[2.0, -4.0]), [-0.5, 1.0]);
        let ratio = constraint(Limit::AtMostRatio(0.5)).bound(8.0).expect("a positive value");
        assert_eq!(ratio, upper);
        let lower_ratio = constraint(Limit::AtLeastRatio(0.5)).bound(8.0).expect("a positive value");
        assert_eq!((lower_ratio.excess(5.0), lower_ratio.excess(3.0)), (-0.25, 0.25));
        assert!(
            upper.is_satisfied(4.0) && upper.is_satisfied(4.0 * (1.0 + 1e-7)) && !upper.is_satisfied(4.001)
        );
    }

    #[test]
    fn a_bound_of_zero_counts_in_the_initial_value() {
        assert_eq!(constraint(Limit::AtMost(0.0)).bound(-2.0).expect("a number").excess(1.0), 0.5);
    }

    #[test]
    fn a_ratio_to_nothing_is_refused_by_name() {
        let error = constraint(Limit::AtMostRatio(0.5)).bound(-1.0).expect_err("not positive").to_string();
        assert!(error.contains("`field`") && error.contains("-1"), "{error}");
        // On another mesh the bound is known.
        let known = constraint(Limit::AtLeastRatio(0.5)).bound_beside(Some(3.0), -1.0).expect("a number");
        assert_eq!((known.value, known.excess(6.0)), (3.0, -1.0));
        let own = constraint(Limit::AtMostRatio(0.5)).bound_beside(Some(3.0), 8.0).expect("a positive value");
        assert_eq!(own.value, 4.0);
    }
}

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
        let scale = [value, initial].into_iter().map(f64::abs).find(|&s| s > 0.0).unwrap_or(1.0);
        let sign = if matches!(self.limit, Limit::AtLeast(_) | Limit::AtLeastRatio(_)) { -1.0 } else { 1.0 };
        Ok(Bound { value, slope: sign / scale })
    }
}

impl Bound {
    /// `c` of a value: satisfied where not positive.
    pub fn excess(&self, value: f64) -> f64 {
        self.slope * (value - self.value)
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
    fn the_excess_is_relative_to_the_bound_and_positive_beyond_it() {
        let upper = constraint(Limit::AtMost(4.0)).bound(7.0).expect("a number");
        assert_eq!((upper.excess(5.0), upper.excess(3.0)), (0.25, -0.25));
        let lower = constraint(Limit::AtLeast(4.0)).bound(7.0).expect("a number");
        assert_eq!((lower.excess(5.0), lower.excess(3.0)), (-0.25, 0.25));
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
    }
}

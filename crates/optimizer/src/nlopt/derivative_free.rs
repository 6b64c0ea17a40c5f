//! Maximisation without gradients over a few bounded variables, for quantities that are not smooth.
//!
//! NLopt's BOBYQA (M. J. D. Powell, "The BOBYQA algorithm for bound constrained optimization without derivatives",
//! Cambridge NA Report 2009/06) keeps a quadratic model through 2 n + 1 points. It is made for two variables or more; a
//! single one is given to COBYLA, Powell's method of linear models.

use std::cell::RefCell;
use std::ops::ControlFlow;

use ::nlopt::{Algorithm, Nlopt, Target};

use super::{PanicGuard, STOP_VALUE};

/// First step of every variable, as a share of its span: both methods look around as far as that, and no further than
/// half way from the middle to the bounds.
const FIRST_STEP: f64 = 0.2;

/// Change of a variable, as a share of its span, below which the search has settled: parameters of a fictitious body need
/// no more digits.
const SETTLED: f64 = 1e-3;

/// What is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds, above the lower ones.
    pub upper: Vec<f64>,
    /// Most evaluations; 0 is no limit.
    pub evaluations: usize,
}

/// Makes `evaluate` large from `start`, which is moved into the bounds, and gives the best point with its value; a value
/// that is not finite is worse than all others. `Break` ends the search at once, and so does a point of the library's that is
/// not finite.
///
/// `None` without variables, where bounds or start are not finite or the bounds cross, and where the library refuses its
/// arguments at once.
///
/// # Panics
/// If `start` has not one entry a variable; and when `evaluate` does.
pub fn maximise(
    search: &Search,
    start: &[f64],
    evaluate: impl FnMut(&[f64]) -> ControlFlow<(), f64>,
) -> Option<(Vec<f64>, f64)> {
    let n = search.lower.len();
    assert_eq!(start.len(), n, "one value per variable");
    let are_sound = |k: usize| {
        let [low, high] = [search.lower[k], search.upper[k]];
        start[k].is_finite() && low <= high && (high - low).is_finite()
    };
    if n == 0 || search.upper.len() != n || !(0..n).all(are_sound) {
        return None;
    }
    let state = RefCell::new(State { search, evaluate, best: None, guard: PanicGuard::default() });
    let objective =
        |x: &[f64], _: Option<&mut [f64]>, (): &mut ()| -> f64 { state.borrow_mut().objective(x) };
    let method = if n == 1 { Algorithm::Cobyla } else { Algorithm::Bobyqa };
    let mut library = Nlopt::new(method, n, &objective, Target::Minimize, ());
    let accepted = library
        .set_lower_bounds(&vec![0.0; n])
        .and_then(|_| library.set_upper_bounds(&vec![1.0; n]))
        .and_then(|_| library.set_stopval(STOP_VALUE))
        .and_then(|_| library.set_xtol_abs1(SETTLED))
        .and_then(|_| library.set_initial_step1(FIRST_STEP))
        .and_then(|_| library.set_maxeval(u32::try_from(search.evaluations).unwrap_or(u32::MAX)));
    if accepted.is_ok() {
        let mut x: Vec<f64> = (0..n)
            .map(|k| {
                let span = search.upper[k] - search.lower[k];
                if span > 0.0 { ((start[k] - search.lower[k]) / span).clamp(0.0, 1.0) } else { 0.5 }
            })
            .collect();
        // However it ends, the best point is kept here.
        let _ = library.optimize(&mut x);
    }
    drop(library);
    let State { best, guard, .. } = state.into_inner();
    guard.resume();
    best
}

struct State<'a, F> {
    search: &'a Search,
    evaluate: F,
    best: Option<(Vec<f64>, f64)>,
    guard: PanicGuard,
}

impl<F: FnMut(&[f64]) -> ControlFlow<(), f64>> State<'_, F> {
    /// What NLopt makes small at a point of the unit cube; below the stop value where the search ends.
    fn objective(&mut self, x: &[f64]) -> f64 {
        if self.guard.has_caught() || x.iter().any(|x| !x.is_finite()) {
            return 2.0 * STOP_VALUE;
        }
        let Search { lower, upper, .. } = self.search;
        let physical = |k: usize| (lower[k] + x[k] * (upper[k] - lower[k])).clamp(lower[k], upper[k]);
        let point: Vec<f64> = (0..x.len()).map(physical).collect();
        match self.guard.call(|| (self.evaluate)(&point)) {
            Some(ControlFlow::Continue(value)) => {
                // Larger ones would overflow in the products of the library.
                let value = if value.abs() < 1e30 { value } else { -1e30 };
                if self.best.as_ref().is_none_or(|best| value > best.1) {
                    self.best = Some((point, value));
                }
                -value
            }
            Some(ControlFlow::Break(())) | None => 2.0 * STOP_VALUE,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;

    use super::*;

    #[test]
    fn a_kink_in_several_variables_is_found_within_the_bounds() {
        for n in 1..=4 {
            let target = |k: usize| 0.3 + 0.2 * k as f64;
            let mut asked = 0;
            let search = Search { lower: vec![-1.0; n], upper: vec![2.0; n], evaluations: 300 };
            let (best, value) = maximise(&search, &vec![0.0; n], |x| {
                asked += 1;
                assert!(x.iter().all(|x| (-1.0..=2.0).contains(x)));
                // The worst of several, as with qualities: not smooth at its maximum.
                let worst = (0..n).map(|k| -(x[k] - target(k)).abs()).fold(f64::INFINITY, f64::min);
                ControlFlow::Continue(worst)
            })
            .expect("there are variables");
            assert!(asked <= 300, "{asked}");
            // A tenth of the first step: the model is smooth, the function is not.
            assert!(value > -0.06, "{n}: {best:?}");
        }
    }

    #[test]
    fn values_that_are_not_finite_are_passed_over_and_the_budget_is_kept() {
        let mut asked = 0;
        let search = Search { lower: vec![0.0; 2], upper: vec![1.0; 2], evaluations: 7 };
        let best = maximise(&search, &[0.5, 0.5], |x| {
            asked += 1;
            ControlFlow::Continue(if x[0] > 0.6 { f64::NAN } else { x[1] })
        });
        assert!(asked <= 7 && best.is_some_and(|best| best.1.is_finite()));
        let nothing = Search { lower: vec![], upper: vec![], evaluations: 1 };
        assert!(maximise(&nothing, &[], |_| ControlFlow::Continue(0.0)).is_none());
    }

    #[test]
    fn an_interrupted_search_asks_no_more_and_keeps_its_best() {
        let mut asked = 0;
        let search = Search { lower: vec![0.0; 3], upper: vec![1.0; 3], evaluations: 100 };
        let best = maximise(&search, &[0.5; 3], |x| {
            asked += 1;
            if asked == 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(x.iter().sum()) }
        });
        assert_eq!(asked, 4);
        // The start has 1.5, and three points were seen.
        assert!(best.is_some_and(|best| best.1 >= 1.5));
    }

    #[test]
    fn a_panic_of_the_function_comes_through() {
        let search = Search { lower: vec![0.0; 2], upper: vec![1.0; 2], evaluations: 5 };
        let caught = catch_unwind(|| maximise(&search, &[0.5, 0.5], |_| panic!("inside")));
        assert!(caught.is_err());
    }

    #[test]
    fn bounds_and_starts_that_are_no_numbers_are_refused_before_anything_is_asked() {
        for (start, lower, upper) in [
            ([f64::NAN, 0.5], [0.0; 2], vec![1.0; 2]),
            ([0.5; 2], [f64::NEG_INFINITY, 0.0], vec![1.0; 2]),
            ([0.5; 2], [0.0; 2], vec![f64::NAN, 1.0]),
            ([0.5; 2], [2.0, 0.0], vec![1.0; 2]),
            ([0.5; 2], [0.0; 2], vec![1.0]),
        ] {
            let search = Search { lower: lower.to_vec(), upper, evaluations: 5 };
            assert!(maximise(&search, &start, |_| panic!("nothing is to be asked")).is_none());
        }
    }

    #[test]
    fn nothing_but_values_that_are_no_numbers_still_ends_within_the_budget() {
        for n in 1..=3 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308] {
                let mut asked = 0;
                let search = Search { lower: vec![0.0; n], upper: vec![1.0; n], evaluations: 20 };
                let best = maximise(&search, &vec![0.5; n], |x| {
                    asked += 1;
                    assert!(x.iter().all(|x| x.is_finite()));
                    ControlFlow::Continue(bad)
                });
                assert!(asked <= 20 && best.is_some_and(|best| best.1.is_finite()), "{n}, {bad}");
            }
        }
    }
}

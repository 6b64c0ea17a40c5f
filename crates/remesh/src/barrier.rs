//! The energy of an element on rails as a function of its stretch `J`, the ratio of its volumes after and before.
//!
//! `ψ(J) = ½ J² − ln J`, with a barrier that grows without bound as the element is squeezed to nothing. Below `δ` the barrier
//! goes on as its Taylor polynomial of second order, so that `ψ` is finite, twice differentiable and strictly convex for every
//! `J`: a motion may start, and pass, where elements are inverted. `ψ` is least at `J = 1`.
//!
//! The barrier `½ J⁻²` keeps no more room for twice the Newton steps, and less of thin layers (docs/torture.md).

/// Stretch `δ` below which the barrier is its Taylor polynomial: below what any carried design has.
pub(crate) const KNEE: f64 = 0.01;

/// The energy density of an element and its derivatives by the stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Density {
    /// `ψ`.
    pub(crate) energy: f64,
    /// `ψ'`.
    pub(crate) slope: f64,
    /// `ψ''`, never below 1.
    pub(crate) curvature: f64,
}

/// `ψ(J)` and its derivatives.
pub(crate) fn density(stretch: f64) -> Density {
    let Density { energy, slope, curvature } = logarithm(stretch, KNEE);
    Density { energy: 0.5 * stretch * stretch + energy, slope: stretch + slope, curvature: 1.0 + curvature }
}

/// `−ln J` and its derivatives; below `knee` its Taylor polynomial of second order.
pub(crate) fn logarithm(stretch: f64, knee: f64) -> Density {
    let at = stretch.max(knee);
    let beyond = stretch - at;
    let (slope, curvature) = (-1.0 / at, 1.0 / (at * at));
    Density {
        energy: -at.ln() + beyond * (slope + 0.5 * beyond * curvature),
        slope: slope + beyond * curvature,
        curvature,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_and_curvature_are_derivatives_on_both_sides_of_the_knee() {
        for stretch in [-0.7, 0.0, 0.009, 0.011, 0.3, 1.0, 4.0] {
            let h = 1e-5 * f64::max(stretch, KNEE);
            let (low, high) = (density(stretch - h), density(stretch + h));
            let Density { slope, curvature, .. } = density(stretch);
            // The error of central differences is of the order of (h / J)² = 1e-10, and of rounding over h.
            assert!(
                ((high.energy - low.energy) / (2.0 * h) / slope.abs().max(1.0)
                    - slope.signum() * slope.abs().min(1.0))
                .abs()
                    < 1e-6
            );
            assert!(((high.slope - low.slope) / (2.0 * h) / curvature - 1.0).abs() < 1e-8, "{stretch}");
        }
    }

    #[test]
    fn an_element_at_rest_is_as_it_was_and_no_stretch_is_free() {
        assert_eq!(density(1.0).slope, 0.0);
        let from_below = density(KNEE.next_down());
        assert!((from_below.curvature / density(KNEE).curvature - 1.0).abs() < 1e-12);
        assert!([-3.0, 0.0, 0.5, 1e3].iter().all(|&stretch| density(stretch).curvature >= 1.0));
    }
}

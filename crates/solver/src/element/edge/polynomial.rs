//! Polynomials in barycentric coordinates: what edge functions are put together from, once a run.

use std::collections::BTreeMap;

/// `Σ c λ^α` on a simplex with up to four vertices, by the exponents `α`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Polynomial(BTreeMap<[u8; 4], f64>);

impl Polynomial {
    /// `λ_i`.
    pub(super) fn coordinate(i: usize) -> Self {
        let mut powers = [0; 4];
        powers[i] = 1;
        Self(BTreeMap::from([(powers, 1.0)]))
    }

    /// `self + c other`.
    pub(super) fn plus(mut self, c: f64, other: &Self) -> Self {
        for (&powers, coefficient) in &other.0 {
            *self.0.entry(powers).or_default() += c * coefficient;
        }
        self.0.retain(|_, coefficient| *coefficient != 0.0);
        self
    }

    /// `self · other`.
    pub(super) fn times(&self, other: &Self) -> Self {
        let mut product = Self::default();
        for (a, x) in &self.0 {
            for (b, y) in &other.0 {
                let powers = std::array::from_fn(|i| a[i] + b[i]);
                product = product.plus(1.0, &Self(BTreeMap::from([(powers, x * y)])));
            }
        }
        product
    }

    /// `∂/∂λ_m`, all coordinates taken as independent.
    pub(super) fn derivative(&self, m: usize) -> Self {
        let lowered = self.0.iter().filter(|(powers, _)| powers[m] > 0).map(|(&powers, coefficient)| {
            let mut lower = powers;
            lower[m] -= 1;
            (lower, coefficient * f64::from(powers[m]))
        });
        Self(lowered.collect())
    }

    /// The value at a point.
    pub(super) fn value(&self, lambda: &[f64; 4]) -> f64 {
        let monomial = |powers: &[u8; 4]| -> f64 {
            powers.iter().zip(lambda).map(|(&power, l)| l.powi(i32::from(power))).product()
        };
        self.0.iter().map(|(powers, coefficient)| coefficient * monomial(powers)).sum()
    }

    /// The mean over a simplex with `vertices` vertices: `⟨λ^α⟩ = d! α! / (|α| + d)!` (Stroud, Approximate Calculation of
    /// Multiple Integrals, 1971, section 7.4).
    pub(super) fn mean(&self, vertices: usize) -> f64 {
        let factorial = |n: usize| (1..=n).product::<usize>() as f64;
        let dimension = vertices - 1;
        let of = |powers: &[u8; 4]| {
            let above: f64 = powers.iter().map(|&power| factorial(power.into())).product();
            let degree: usize = powers.iter().map(|&power| usize::from(power)).sum();
            factorial(dimension) * above / factorial(degree + dimension)
        };
        self.0.iter().map(|(powers, coefficient)| coefficient * of(powers)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_derivatives_and_means() {
        let [x, y] = [0, 1].map(Polynomial::coordinate);
        let bubble = x.times(&y);
        let odd = bubble.times(&x.clone().plus(-1.0, &y));
        assert_eq!(odd.value(&[2.0, 3.0, 0.0, 0.0]), -6.0);
        // ∂(x²y − xy²)/∂x = 2xy − y².
        assert_eq!(odd.derivative(0).value(&[2.0, 3.0, 0.0, 0.0]), 3.0);
        assert!((bubble.mean(3) - 1.0 / 12.0).abs() < 1e-16, "on a triangle");
        assert!((bubble.mean(4) - 1.0 / 20.0).abs() < 1e-16, "on a tetrahedron");
        assert_eq!(x.clone().plus(-1.0, &x), Polynomial::default());
    }
}

//! What factors and iterations cost, by counted work: the model behind the choice of a method and the reuse of a factor.
//!
//! The constants are CPU times measured on one core with AVX-512, on the shield of 36 000 unknowns. Only their ratios
//! matter, and these move little from machine to machine; a clock would make the bits of a run depend on the load.

use super::method::{FieldKind, Method, Reuse};
use crate::elements::{ElementFamily, Order};

/// Nanoseconds a byte that is streamed from memory in a product.
const BYTE: f64 = 0.15;

/// Bytes that a matrix entry takes: a complex number and its column.
pub(super) const MATRIX_ENTRY: usize = 20;

/// Bytes of an entry of an incomplete factor: a single-precision complex number and its column.
pub(super) const SINGLE_ENTRY: usize = 12;

/// Nanoseconds of an incomplete factorisation an entry of its lower half.
const ELIMINATION: f64 = 100.0;

/// Nanoseconds of gathering an entry of the matrix for Gauss–Seidel.
const GATHERING: f64 = 20.0;

/// Sizes of a system: what costs are made of.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sizes {
    /// Stored entries of the matrix.
    pub(crate) matrix_entries: usize,
    /// Stored entries of the complete factor.
    pub(crate) factor_entries: usize,
    /// Multiply-adds of its factorisation.
    pub(crate) multiplications: f64,
}

impl Sizes {
    /// Cost of a product with the matrix [ns].
    fn product(&self) -> f64 {
        (self.matrix_entries * MATRIX_ENTRY) as f64 * BYTE
    }
}

/// Costs of one method [ns].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Costs {
    /// Making the preconditioner.
    pub(crate) factor: f64,
    /// One iteration.
    pub(crate) iteration: f64,
}

impl Costs {
    /// Costs of a complete factor; of the others, nothing.
    pub(crate) fn complete(method: Method, sizes: &Sizes) -> Self {
        // Nanoseconds of a multiply-add of a factorisation, and of an entry of the factor in one of the two sweeps of a solution.
        let (multiplication, entry) = match method {
            Method::Direct => (0.33, 1.95),
            Method::DirectSingle => (0.19, 1.17),
            Method::RealFactor => (0.13, 1.26),
            Method::RealFactorSingle => (0.081, 0.91),
            Method::Incomplete | Method::TwoLevel => (0.0, 0.0),
        };
        let Sizes { factor_entries, multiplications, .. } = *sizes;
        Self {
            factor: multiplications * multiplication,
            iteration: sizes.product() + 2.0 * factor_entries as f64 * entry,
        }
    }

    /// Costs of an incomplete factor: the lower half in single precision, streamed twice.
    pub(crate) fn incomplete(sizes: &Sizes) -> Self {
        let half = 0.5 * sizes.matrix_entries as f64;
        Self {
            factor: ELIMINATION * half,
            iteration: sizes.product() + 2.0 * half * SINGLE_ENTRY as f64 * BYTE,
        }
    }

    /// Costs of block Gauss–Seidel with its residual: three passes over half of the entries in single precision and two solutions
    /// with the factors of the sets, beside the product of the iteration. `sets` has no matrix entries.
    pub(crate) fn gauss_seidel(sizes: &Sizes, sets: &Sizes) -> Self {
        let factors = Self::complete(Method::DirectSingle, sets);
        Self {
            factor: factors.factor + GATHERING * sizes.matrix_entries as f64,
            iteration: sizes.product()
                + 2.0 * factors.iteration
                + 1.5 * (sizes.matrix_entries * SINGLE_ENTRY) as f64 * BYTE,
        }
    }

    /// These, with a further product in every iteration, with a matrix of so many entries in single precision.
    pub(crate) fn with_product(self, entries: usize) -> Self {
        Self { iteration: self.iteration + (entries * SINGLE_ENTRY) as f64 * BYTE, ..self }
    }

    /// The sum of both.
    pub(crate) fn and(self, other: Self) -> Self {
        Self { factor: self.factor + other.factor, iteration: self.iteration + other.iteration }
    }

    /// Mean cost of a design with so many solutions.
    pub(crate) fn of_design(&self, service: Service, solutions: usize) -> f64 {
        self.factor / service.designs + solutions as f64 * service.iterations * self.iteration
    }
}

/// What a factor is used for: the designs it serves, and the mean iterations of a solution then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Service {
    pub(crate) designs: f64,
    pub(crate) iterations: f64,
}

impl Service {
    /// What is usual of a method: measured on the shield's optimisation. The condition √2 of the sum of the parts hardly
    /// changes with the mesh, so that its factor serves for long; an exact factor loses most of what it is better at.
    pub(crate) fn typical(method: Method, reuse: Reuse, iterations: usize, field: FieldKind) -> Self {
        let fresh = iterations as f64;
        match (reuse, method, field) {
            (Reuse::Never, ..) => Self { designs: 1.0, iterations: fresh },
            (_, Method::RealFactor | Method::RealFactorSingle, FieldKind::Harmonic) => {
                Self { designs: 8.0, iterations: fresh + 3.0 }
            }
            (_, Method::Incomplete | Method::TwoLevel, _) => Self { designs: 1.0, iterations: fresh },
            _ => Self { designs: 1.5, iterations: fresh + 3.0 },
        }
    }
}

/// Iterations of a method with a factor of the matrix itself: measured, and steady from mesh to mesh but for incomplete ones.
pub(crate) fn typical_iterations(
    method: Method,
    field: FieldKind,
    (family, order): (ElementFamily, Order),
    unknowns: usize,
) -> usize {
    match (method, field) {
        (Method::Direct, _) => 2,
        (Method::DirectSingle, _) | (Method::RealFactorSingle, FieldKind::Static) => 4,
        (Method::RealFactor, FieldKind::Static) => 2,
        (Method::RealFactor | Method::RealFactorSingle, FieldKind::Harmonic) => 25,
        (Method::TwoLevel, _) if order == Order::Quadratic => match family {
            ElementFamily::Nodal => 80,
            ElementFamily::Edge => 250,
        },
        (Method::TwoLevel, _) => (2.1 * (unknowns as f64).cbrt()) as usize,
        (Method::Incomplete, _) => (6.0 * (unknowns as f64).cbrt()) as usize,
    }
}

/// Iterations to expect of two levels with hats: measured, 36 to 60 from 26 000 to 531 000 unknowns of a plate at 60 Hz.
pub(crate) fn iterations_with_hats(unknowns: usize) -> usize {
    (4.0 * (unknowns as f64).powf(0.2)) as usize
}

/// The ledger of a factor that serves several designs.
///
/// Each further design costs more iterations than a factor of its own would. The factor is replaced when the next
/// design's excess would be above the mean cost of the designs it has served, factorisation included: the rule that
/// makes the mean least.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ledger {
    costs: Costs,
    /// Designs served, with the one the factor is of.
    served: usize,
    /// Iterations a solution takes with a factor of its own.
    fresh: f64,
    /// Sum of the excesses so far [ns].
    excess: f64,
    /// The last one [ns].
    last: f64,
}

impl Ledger {
    /// For a factor that was just made, with the iterations expected of it.
    pub(crate) fn new(costs: Costs, fresh: usize) -> Self {
        Self { costs, served: 0, fresh: fresh as f64, excess: 0.0, last: 0.0 }
    }

    /// Enters a design with `solutions` of `iterations` in all.
    pub(crate) fn enter(&mut self, iterations: usize, solutions: usize) {
        if solutions == 0 {
            return;
        }
        if self.served == 0 {
            self.fresh = iterations as f64 / solutions as f64;
        }
        self.last = self.excess_of(iterations as f64, solutions);
        self.excess += self.last;
        self.served += 1;
    }

    /// Whether the factor should serve another design, judged by the last one.
    pub(crate) fn pays(&self) -> bool {
        self.last <= self.limit()
    }

    /// Whether a design with so many iterations in all is too expensive to go on with.
    pub(crate) fn is_exceeded_by(&self, iterations: f64, solutions: usize) -> bool {
        self.excess_of(iterations, solutions) > self.limit()
    }

    fn excess_of(&self, iterations: f64, solutions: usize) -> f64 {
        (iterations - self.fresh * solutions as f64).max(0.0) * self.costs.iteration
    }

    /// Mean cost of the designs served.
    fn limit(&self) -> f64 {
        (self.costs.factor + self.excess) / self.served.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSTS: Costs = Costs { factor: 100.0, iteration: 1.0 };

    #[test]
    fn a_factor_is_kept_while_its_mean_cost_falls() {
        let mut ledger = Ledger::new(COSTS, 3);
        ledger.enter(6, 2);
        assert!(ledger.pays());
        // Excesses of 10, 20, 30, …: the mean (100 + 10 k (k + 1)/2)/(k + 1) is least after four further designs.
        let mut served: i32 = 1;
        for k in 1..20 {
            ledger.enter(6 + 10 * k, 2);
            served += 1;
            if !ledger.pays() {
                break;
            }
        }
        let mean = |k: f64| (100.0 + 5.0 * k * (k + 1.0)) / (k + 1.0);
        // Judged by the last design, it ends one after the least mean; of equal ones, the longer service.
        let best = (1..20).rev().min_by(|&a, &b| mean(f64::from(a)).total_cmp(&mean(f64::from(b))));
        assert_eq!(Some(served - 2), best);
    }

    #[test]
    fn one_bad_design_is_worth_a_factor_of_its_own() {
        let mut ledger = Ledger::new(COSTS, 3);
        ledger.enter(6, 2);
        assert!(!ledger.is_exceeded_by(100.0, 2));
        assert!(ledger.is_exceeded_by(107.0, 2));
    }

    #[test]
    fn small_systems_are_factored_and_large_ones_in_real_numbers() {
        // Counts of solver_notes: 37 thousand and 550 thousand unknowns.
        let elements = (ElementFamily::Nodal, Order::Linear);
        let step = |method, sizes: &Sizes| {
            let iterations = typical_iterations(method, FieldKind::Harmonic, elements, 1);
            let service = Service::typical(method, Reuse::WhileItPays, iterations, FieldKind::Harmonic);
            Costs::complete(method, sizes).of_design(service, 2)
        };
        let small = Sizes { matrix_entries: 600_000, factor_entries: 8_000_000, multiplications: 3e9 };
        assert!(step(Method::DirectSingle, &small) < step(Method::RealFactorSingle, &small));
        let large = Sizes { matrix_entries: 9_000_000, factor_entries: 800_000_000, multiplications: 3e12 };
        assert!(step(Method::DirectSingle, &large) > step(Method::RealFactorSingle, &large));
    }
}

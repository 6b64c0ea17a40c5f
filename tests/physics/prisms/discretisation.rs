//! The discretisations that every prism is solved with.

use fluxmorph_solver::{ElementFamily, FieldModelSetup, Order};

use super::exact::Prism;

/// Elements for the potentials.
#[derive(Clone, Copy, Debug)]
pub(super) struct Discretisation {
    pub(super) name: &'static str,
    family: ElementFamily,
    order: Order,
    /// Largest relative error of the observed B [1] on cells of 100 mm, where it must be right; twice that for what is quadratic
    /// in the field.
    pub(super) tolerance: f64,
    /// Which prisms it must get right.
    reach: Reach,
}

/// Which prisms a discretisation must get right.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reach {
    /// Air between walls and impedance surfaces that never turn into the domain.
    Air,
    /// The same with materials of a relative permeability of ten or less, and conductors with a skin of a cell or more.
    Convex,
    /// Every prism, with a skin of a cell or more in its conductors.
    All,
}

/// All of them.
pub(super) const ALL: [Discretisation; 4] = [
    Discretisation {
        name: "nodal 1",
        family: ElementFamily::Nodal,
        order: Order::Linear,
        tolerance: 0.01,
        reach: Reach::Air,
    },
    Discretisation {
        name: "nodal 2",
        family: ElementFamily::Nodal,
        order: Order::Quadratic,
        tolerance: 0.002,
        reach: Reach::Convex,
    },
    Discretisation {
        name: "edge 1",
        family: ElementFamily::Edge,
        order: Order::Linear,
        // A skin of a cell on linear elements: 2.5 % of the loss.
        tolerance: 0.015,
        reach: Reach::All,
    },
    Discretisation {
        name: "edge 2",
        family: ElementFamily::Edge,
        order: Order::Quadratic,
        tolerance: 0.002,
        reach: Reach::All,
    },
];

impl Discretisation {
    /// A problem on these elements.
    pub(super) fn of(self, setup: FieldModelSetup) -> FieldModelSetup {
        FieldModelSetup { family: self.family, order: self.order, ..setup }
    }

    /// Whether a prism must come out within the tolerance.
    pub(super) fn must_solve(self, prism: &Prism) -> bool {
        let convex = prism.re_entrant_edges() == 0;
        let resolved = prism.meshed_skin_depth() >= 0.1;
        match self.reach {
            Reach::All => resolved,
            Reach::Air => convex && prism.permeability() == 1.0 && prism.meshed_skin_depth() == f64::INFINITY,
            Reach::Convex => convex && prism.permeability() <= 10.0 && resolved,
        }
    }
}

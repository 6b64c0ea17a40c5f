//! The names of the elements that there are: their family and their order.

/// Polynomial order of an element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Linear potentials: `B` is constant in an element.
    #[default]
    Linear,
    /// Quadratic ones: `B` is linear in an element.
    Quadratic,
}

impl Order {
    /// The polynomial degree.
    pub fn degree(self) -> usize {
        match self {
            Self::Linear => 1,
            Self::Quadratic => 2,
        }
    }
}

/// What is continuous between elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ElementFamily {
    /// All components of `A`, and `ψ`, at nodes (Lagrange).
    Nodal,
    /// The tangential components of `A + ∇ψ`, along edges (Nédélec).
    #[default]
    Edge,
}

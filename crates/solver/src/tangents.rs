//! What B–H laws add to the reluctivity of every element with a law: the part of a tangent that assembly takes.

use fluxmorph_geometry::ElementId;

use crate::bh::Tangent;
use crate::element::tensor::MOST_POINTS;

/// `∂H/∂B − ν_r` [m/H] at the points of every element with a law.
#[derive(Debug)]
pub(crate) struct Tangents {
    /// Ascending.
    elements: Vec<ElementId>,
    tensors: Vec<[Tangent; MOST_POINTS]>,
}

impl Tangents {
    /// Those of some elements, ascending.
    pub(crate) fn new(elements: Vec<ElementId>, tensors: Vec<[Tangent; MOST_POINTS]>) -> Self {
        Self { elements, tensors }
    }

    /// Those of an element; `None` where its material is linear.
    #[inline]
    pub(crate) fn of(&self, e: ElementId) -> Option<&[Tangent; MOST_POINTS]> {
        self.elements.binary_search(&e).ok().map(|position| &self.tensors[position])
    }
}

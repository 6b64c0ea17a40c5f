//! The elastic body: which elements it has, and the stiffness of each.

use std::sync::Arc;

use fluxmorph_geometry::tet4::{Tet4, dot};
use fluxmorph_geometry::{ElementId, Mesh, Topology};

use crate::elasticity::{Isotropic, Stiffness, stiffness};
use crate::error::RemeshError;
use crate::policy::Weighting;
use crate::subregion::Subregion;

/// The elements of all subregions with their laws.
#[derive(Debug)]
pub(crate) struct Body {
    pub(crate) topology: Arc<Topology>,
    /// Elements, ascending.
    pub(crate) elements: Vec<ElementId>,
    /// The law of each, among `laws`.
    law_of: Vec<u32>,
    laws: Vec<Isotropic>,
}

impl Body {
    /// The body of some subregions.
    ///
    /// # Errors
    /// [`RemeshError::Parameter`], [`RemeshError::DanglingElement`], [`RemeshError::Overlap`], [`RemeshError::EmptyRegion`].
    pub(crate) fn new(topology: &Arc<Topology>, subregions: &[Subregion]) -> Result<Self, RemeshError> {
        let (elements, law_of) = region_elements(topology, subregions)?;
        let laws = subregions.iter().map(Subregion::law).collect();
        Ok(Self { topology: Arc::clone(topology), elements, law_of, laws })
    }

    /// Stiffness of an element, by its position in the body, on a reference mesh.
    pub(crate) fn stiffness(&self, reference: &Mesh, weighting: &Weighting, position: usize) -> Stiffness {
        let law = self.laws[self.law_of[position] as usize];
        let vertices = reference.vertices(self.elements[position]);
        let (factor, tensor) = weighting.of(vertices);
        let law = Isotropic { young: law.young * factor, ..law };
        stiffness(&Tet4::new(vertices), &law, &tensor)
    }

    /// Young's modulus of an element along an axis, or its mean of all directions, by its position in the body, on a reference
    /// mesh.
    pub(crate) fn weight(
        &self,
        reference: &Mesh,
        weighting: &Weighting,
        position: usize,
        axis: Option<usize>,
    ) -> f64 {
        let law = self.laws[self.law_of[position] as usize];
        let (factor, tensor) = weighting.of(reference.vertices(self.elements[position]));
        let square = |axis: usize| dot(tensor[axis], tensor[axis]);
        law.young * factor * axis.map_or_else(|| (0..3).map(square).sum::<f64>() / 3.0, square)
    }
}

/// The elements of all subregions, ascending, and the subregion of each.
fn region_elements(
    topology: &Topology,
    subregions: &[Subregion],
) -> Result<(Vec<ElementId>, Vec<u32>), RemeshError> {
    let element_count = topology.tets().len();
    let mut owner: Vec<Option<u32>> = vec![None; element_count];
    for (s, subregion) in (0u32..).zip(subregions) {
        subregion.validate()?;
        for &element in &subregion.elements {
            let name = |s: u32| subregions[s as usize].name.clone();
            match owner.get_mut(element.index()) {
                None => {
                    let subregion = name(s);
                    return Err(RemeshError::DanglingElement { subregion, element, elements: element_count });
                }
                Some(Some(first)) if *first != s => {
                    return Err(RemeshError::Overlap { element, first: name(*first), second: name(s) });
                }
                Some(slot) => *slot = Some(s),
            }
        }
    }
    let (elements, subregion_of): (Vec<_>, Vec<_>) =
        topology.elements().filter_map(|e| Some((e, owner[e.index()]?))).unzip();
    if elements.is_empty() { Err(RemeshError::EmptyRegion) } else { Ok((elements, subregion_of)) }
}

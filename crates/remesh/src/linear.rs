//! The paper's law: one linear map of the undeformed mesh (Eq. 3) for all designs, with a fictitious force where there is one.
//!
//! Nothing keeps an element from inverting but its stiffness: how far a design is carried is measured all the same, by the
//! volumes that elements have left.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::tet4::Point;

use crate::deform::ElasticMap;
use crate::equilibrium::{Element, EnergyLaw, Equilibrium};
use crate::error::RemeshError;

/// The linear law on the undeformed mesh.
#[derive(Debug)]
pub(crate) struct Linear {
    elements: Vec<Element>,
    map: Arc<ElasticMap>,
}

impl Linear {
    /// The law of a map on the undeformed mesh.
    pub(crate) fn new(mesh: &Mesh, map: ElasticMap) -> Self {
        Self { elements: Element::of_body(mesh, &map, None), map: Arc::new(map) }
    }
}

impl EnergyLaw for Linear {
    fn rest(&self) -> &Arc<ElasticMap> {
        &self.map
    }

    fn elements(&self) -> &[Element] {
        &self.elements
    }

    fn equilibrium(&self, design: &[Point]) -> Result<Equilibrium, RemeshError> {
        let displacement = self.map.displacement(design)?;
        Ok(Equilibrium::new(self, displacement, Arc::clone(&self.map), 0))
    }
}

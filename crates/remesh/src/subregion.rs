//! The fictitious material: elastic parameters and force of each subregion.
//!
//! How the stiffness then follows the elements' size is in [`crate::policy`].

use fluxmorph_geometry::{ElementId, MeshError, Topology};

use crate::elasticity::Isotropic;
use crate::error::RemeshError;

/// A part of the remesh region with one elastic law and one fictitious force.
#[derive(Clone, Debug)]
pub struct Subregion {
    /// Name, for messages.
    pub name: String,
    /// Its elements, in any order.
    pub elements: Vec<ElementId>,
    /// Young's modulus `E` [Pa]. Default 1: with `f = 0` only ratios between subregions matter.
    pub young: f64,
    /// Poisson's ratio `ν`. Default 0.3, as in the paper's tables.
    pub poisson: f64,
    /// Fictitious force `f` on each of its nodes [N]; the motion depends on `f / E` [m²] only. Default 0.
    pub force: [f64; 3],
}

impl Subregion {
    /// All elements of one named region of the mesh, with the default law and no force.
    ///
    /// # Errors
    /// [`MeshError::UnknownRegion`].
    pub fn of_region(topology: &Topology, name: &str) -> Result<Self, MeshError> {
        Ok(Self::new(name, topology.elements_of(topology.region(name)?)))
    }

    /// Any set of elements, with the default law and no force.
    pub fn new(name: &str, elements: Vec<ElementId>) -> Self {
        Self { name: name.to_owned(), elements, young: 1.0, poisson: 0.3, force: [0.0; 3] }
    }

    /// The elastic law before the policy's weight.
    pub fn law(&self) -> Isotropic {
        Isotropic { young: self.young, poisson: self.poisson }
    }

    /// Checks the parameters.
    pub(crate) fn validate(&self) -> Result<(), RemeshError> {
        let out_of_range = |parameter, value, expected| {
            Err(RemeshError::Parameter { subregion: self.name.clone(), parameter, value, expected })
        };
        if !(self.young.is_finite() && self.young > 0.0) {
            return out_of_range("young", self.young, "must be positive and finite");
        }
        if !(-1.0 < self.poisson && self.poisson < 0.5) {
            return out_of_range(
                "poisson",
                self.poisson,
                "must lie above -1 and below 0.5; 0 to 0.3 is usual",
            );
        }
        match self.force.iter().find(|f| !f.is_finite()) {
            Some(&f) => out_of_range("force", f, "must be finite"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_out_of_range_name_subregion_value_and_range() {
        let subregion = |young, poisson| Subregion { young, poisson, ..Subregion::new("air", Vec::new()) };
        assert!(subregion(1.0, 0.0).validate().is_ok());
        for (young, poisson) in
            [(0.0, 0.3), (f64::NAN, 0.3), (f64::INFINITY, 0.3), (1.0, 0.5), (1.0, f64::NAN)]
        {
            assert!(subregion(young, poisson).validate().is_err());
        }
        let text = subregion(1.0, 0.6).validate().unwrap_err().to_string();
        assert!(text.starts_with("poisson = 0.6 of the remesh subregion `air`: must lie"), "{text}");
    }
}

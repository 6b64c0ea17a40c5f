//! The fictitious material: elastic parameters and force of each subregion, and how stiffness follows element size.
//!
//! In a stack of layers under one tension the strain of a layer is inverse to its stiffness. With one `E` all layers
//! stretch alike and a thin skin is lost; with `E ∝ 1/h`, `h` the layer's thickness, its change of thickness goes
//! with `h²`, and the thick layers take up the motion.

use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{self, FACES, Point};
use fluxmorph_geometry::{ElementId, Mesh, MeshError, Topology};
use rayon::prelude::*;

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

/// How the stiffness of an element follows its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum StiffnessPolicy {
    /// `E` as given.
    Uniform,
    /// `E ∝ 1/h`, `h` the smallest altitude of the element (see [`smallest_altitude`] for why). The default: the most
    /// tolerant of Poisson's ratio.
    #[default]
    InverseSize,
    /// `E ∝ 1/V`. Protects layers that cross better than the size does, but wants `ν ≤ 0.2`: at 0.3 the sideways
    /// contraction of long thin cells inverts some of them.
    InverseVolume,
}

impl StiffnessPolicy {
    /// Factor on Young's modulus of each element; their geometric mean is 1, so that `f / E` keeps its meaning from
    /// policy to policy.
    pub fn weights(self, mesh: &Mesh, elements: &[ElementId]) -> Vec<f64> {
        let size: fn([Point; 4]) -> f64 = match self {
            Self::Uniform => return vec![1.0; elements.len()],
            Self::InverseSize => smallest_altitude,
            Self::InverseVolume => tet4::volume,
        };
        let sizes: Vec<f64> = elements.par_iter().map(|&e| size(mesh.vertices(e))).collect();
        let mean_log = ordered_sum(sizes.len(), |i| sizes[i].ln()) / sizes.len().max(1) as f64;
        let reference = mean_log.exp();
        sizes.into_iter().map(|h| reference / h).collect()
    }
}

/// Smallest altitude [m] of a tetrahedron: `3 V` over the area of its largest face.
///
/// The size of an element for [`StiffnessPolicy::InverseSize`]: in a thin layer it is the layer's thickness, whatever
/// its width, so that the strain of a stack is shared out as the module doc says. `V^(1/3)` sees a 0.4 mm layer of
/// 20 mm cells as 3 mm thick and lets it stretch accordingly. Where layers cross, as under the free sides of a plate, the
/// altitude cannot tell the two directions apart; the volume can, since it is their product (`tests/skin.rs` holds
/// the two against each other).
pub fn smallest_altitude(vertices: [Point; 4]) -> f64 {
    let largest =
        FACES.iter().map(|face| tet4::norm(tet4::area_vector(face.map(|v| vertices[v])))).fold(0.0, f64::max);
    3.0 * tet4::volume(vertices) / largest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_altitude_of_a_flat_layer_is_its_thickness() {
        let layer = |t: f64| [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, t]];
        assert!((smallest_altitude(layer(1e-3)) / 1e-3 - 1.0).abs() < 1e-5);
        assert!((smallest_altitude(layer(1.0)) - 1.0 / 3f64.sqrt()).abs() < 1e-15);
    }

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

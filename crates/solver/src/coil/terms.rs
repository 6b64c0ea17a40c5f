//! What all coils together put on the right side of the system.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh};

use super::{Coil, CoilShape, moments};
use crate::error::SolverError;

/// A complex vector.
type Complex3 = [c64; 3];

/// The sources of an element-wise load, with the coils' currents.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceTerms {
    /// `∫_e T λ_b dV` [A m²] of analytic coils, for `∫T·curl w`; ascending by element.
    pub moments: Vec<(ElementId, [Complex3; 4])>,
    /// `J` [A/m²] of coil regions, for `∫J·w`; ascending by element.
    pub currents: Vec<(ElementId, Complex3)>,
}

impl SourceTerms {
    /// The terms of coils on a mesh.
    ///
    /// # Errors
    /// [`SolverError::NoSource`] for an analytic coil that meets no element.
    pub fn new(mesh: &Mesh, coils: &[Coil]) -> Result<Self, SolverError> {
        let (mut all, mut currents) = (Vec::new(), Vec::new());
        for coil in coils {
            let times = |v: &Point| v.map(|c| coil.ampere_turns * c);
            match &coil.shape {
                CoilShape::Racetrack(racetrack) => {
                    let moments = moments(racetrack, mesh);
                    if moments.is_empty() {
                        return Err(SolverError::NoSource {
                            coil: coil.name.clone(),
                            cause: format!(
                                "the coil `{}` lies outside the mesh; check its centre and the mesh unit",
                                coil.name
                            ),
                        });
                    }
                    all.extend(moments.iter().map(|(e, m)| (*e, m.each_ref().map(times))));
                }
                shape => {
                    let Some(current) = shape.region_current() else { continue };
                    currents.extend(current.current_density().iter().map(|(e, j)| (*e, [times(j)])));
                }
            }
        }
        let currents = merge(currents).into_iter().map(|(e, [j])| (e, j)).collect();
        Ok(Self { moments: merge(all), currents })
    }

    /// Elements with a source, ascending: these must not move.
    pub fn elements(&self) -> Vec<ElementId> {
        let mut elements: Vec<ElementId> = self.moments.iter().map(|(e, _)| *e).collect();
        elements.extend(self.currents.iter().map(|(e, _)| *e));
        elements.sort_unstable();
        elements.dedup();
        elements
    }
}

/// Adds up what falls on the same element; coils keep their order, so that the bits do not depend on anything else.
fn merge<const N: usize>(mut all: Vec<(ElementId, [Complex3; N])>) -> Vec<(ElementId, [Complex3; N])> {
    all.sort_by_key(|(e, _)| *e);
    let mut sums: Vec<(ElementId, [Complex3; N])> = Vec::with_capacity(all.len());
    for (e, terms) in all {
        match sums.last_mut() {
            Some((last, sum)) if *last == e => {
                for (sum, term) in sum.iter_mut().flatten().zip(terms.iter().flatten()) {
                    *sum += term;
                }
            }
            _ => sums.push((e, terms)),
        }
    }
    sums
}

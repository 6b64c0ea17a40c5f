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
    /// `T` [A/m] of elements in windows, where it is constant, and which may move there; ascending by element.
    pub windows: Vec<(ElementId, Complex3)>,
    /// `J` [A/m²] of coil regions, for `∫J·w`; ascending by element.
    pub currents: Vec<(ElementId, Complex3)>,
}

impl SourceTerms {
    /// The terms of coils on a mesh.
    ///
    /// # Errors
    /// [`SolverError::NoSource`] for an analytic coil whose winding meets no element.
    pub fn new(mesh: &Mesh, coils: &[Coil]) -> Result<Self, SolverError> {
        let (mut all, mut windows, mut cut, mut currents) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for coil in coils {
            let times = |v: &Point| v.map(|c| coil.ampere_turns * c);
            match &coil.shape {
                CoilShape::Racetrack(racetrack) => {
                    let moments = moments(racetrack, mesh);
                    let (in_window, met): (Vec<_>, Vec<_>) =
                        moments.iter().map(|(e, _)| *e).partition(|&e| racetrack.encloses(&mesh.vertices(e)));
                    // A mesh that lies in the window alone has no current.
                    if !met.iter().any(|&e| racetrack.wound_place(mesh.vertices(e)).is_some()) {
                        return Err(SolverError::NoSource {
                            coil: coil.name.clone(),
                            cause: format!(
                                "the winding of the coil `{}` lies outside the mesh; check its centre, its sizes and the mesh unit",
                                coil.name
                            ),
                        });
                    }
                    let potential = times(&racetrack.axis().map(|e| racetrack.plateau() * e));
                    windows.extend(in_window.into_iter().map(|e| (e, [potential])));
                    cut.extend(met);
                    all.extend(moments.into_iter().map(|(e, moment)| (e, moment.each_ref().map(times))));
                }
                shape => {
                    let Some(current) = shape.region_current() else { continue };
                    currents.extend(current.current_density().iter().map(|(e, j)| (*e, [times(j)])));
                }
            }
        }
        cut.sort_unstable();
        let single = |all| merge(all).into_iter().map(|(e, [sum])| (e, sum));
        let windows: Vec<_> = single(windows).filter(|(e, _)| cut.binary_search(e).is_err()).collect();
        let mut moments = merge(all);
        moments.retain(|(e, _)| windows.binary_search_by_key(e, |(e, _)| *e).is_err());
        Ok(Self { moments, windows, currents: single(currents).collect() })
    }

    /// Elements with a source, ascending.
    pub fn elements(&self) -> Vec<ElementId> {
        let windows = self.windows.iter().map(|(e, _)| *e);
        let mut elements: Vec<ElementId> = self.fixed_elements().chain(windows).collect();
        elements.sort_unstable();
        elements.dedup();
        elements
    }

    /// Elements that a winding meets, some twice: these must not move.
    pub fn fixed_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.moments.iter().map(|(e, _)| *e).chain(self.currents.iter().map(|(e, _)| *e))
    }

    /// `T` [A/m] of an element in a window; `None` of all others.
    pub fn window(&self, element: ElementId) -> Option<Complex3> {
        let at = self.windows.binary_search_by_key(&element, |(e, _)| *e).ok()?;
        Some(self.windows[at].1)
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

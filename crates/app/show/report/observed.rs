//! What the objective takes of the field, or the constraints where it takes nothing: its regions, their elements, and the mean field
//! in them.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::tet4::volume;

use super::data::{RunData, Snapshot};
use crate::build::{Outline, region_in_mesh};
use crate::config::Functional;

/// Names of these regions, each once.
pub(super) fn region_names(data: &RunData) -> Vec<&str> {
    let terms = data.config.objective.iter().flat_map(|objective| objective.terms());
    let of_objective = unique(terms.map(|term| &term.functional));
    if !of_objective.is_empty() {
        return of_objective;
    }
    unique(data.config.constraints.iter().filter_map(|constraint| constraint.limit.functional()))
}

fn unique<'a>(functionals: impl Iterator<Item = &'a Functional>) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for name in functionals.filter(|own| own.kind.is_of_field()).filter_map(region_in_mesh) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The elements of those regions.
pub(super) fn elements(data: &RunData, outline: &Outline) -> Vec<ElementId> {
    let topology = outline.mesh.topology();
    let regions = region_names(data).into_iter().filter_map(|name| topology.region(name).ok());
    regions.flat_map(|region| topology.elements_of(region)).collect()
}

/// Mean of |B| over them, by volume [T]; `None` where there are none.
pub(super) fn mean_flux_density(data: &RunData, outline: &Outline, field: &Snapshot) -> Option<f64> {
    let topology = outline.mesh.topology();
    let (mut sum, mut total) = (0.0, 0.0);
    for e in elements(data, outline) {
        let own = volume(topology.tet(e).map(|n| field.points[n.index()])).abs();
        sum += own * field.flux_density[e.index()];
        total += own;
    }
    (total > 0.0).then(|| sum / total)
}

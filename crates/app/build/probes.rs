//! Whether the field can be measured at every point of the probes, before a run is spent on it.

use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::{Mesh, millimetres};

use super::open;
use crate::config::{Config, Diagnostic, SourceMap};

/// Every probe point outside the mesh, in a region that its surface replaces, or in the shell of open space.
pub(super) fn faults(config: &Config, source: &SourceMap, full_mesh: &Mesh, mesh: &Mesh) -> Vec<Diagnostic> {
    let shell = config.open.as_ref().and_then(|open| mesh.topology().region(open::region_of(open)).ok());
    let mut faults = Vec::new();
    for (i, probe) in config.probes.iter().enumerate() {
        for (j, found) in locate(mesh, &probe.points).into_iter().enumerate() {
            let is_replaced = || locate(full_mesh, &[probe.points[j]])[0].is_some();
            let (place, expected) = match found {
                Some((e, _)) if shell == Some(mesh.topology().region_of()[e.index()]) => (
                    "in the shell of open space",
                    "a point in the mesh inside the shell, whose places mean others far away".to_owned(),
                ),
                Some(_) => continue,
                None if is_replaced() => (
                    "in a region that its impedance surface replaces",
                    "a point in a region that is meshed".to_owned(),
                ),
                None => {
                    let [lower, upper] = full_mesh.bounding_box().map(millimetres);
                    let expected = format!("a point inside the mesh, which goes from {lower} to {upper}");
                    ("outside the mesh", expected)
                }
            };
            let at = millimetres(probe.points[j]);
            let message = format!("the point {at} of the probe `{}` lies {place}", probe.name);
            faults.push(source.diagnostic(&format!("probes[{i}].points[{j}]"), message).expected(expected));
        }
    }
    faults
}

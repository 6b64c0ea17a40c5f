//! Whether the field can be measured at every point of the probes, before a run is spent on it, and on which side of a face.

use std::collections::BTreeMap;

use fluxmorph_geometry::locate::{holders, locate};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, RegionId, millimetres};

use super::entries::material;
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

/// Probes with points on faces across which B jumps: that of one side is measured there.
pub(super) fn warnings(config: &Config, mesh: &Mesh) -> Vec<String> {
    let regions = mesh.topology().region_names();
    let name = |region: RegionId| regions[region.index()].as_str();
    let points: Vec<Point> = config.probes.iter().flat_map(|probe| probe.points.iter().copied()).collect();
    // The first region at a point is that of the first element, whose field is taken.
    let mut around: Vec<Vec<RegionId>> = vec![Vec::new(); points.len()];
    for (i, (e, _)) in holders(mesh, &points) {
        around[i].push(mesh.topology().region_of()[e.index()]);
    }
    let mut around = around.iter();
    let mut warnings = Vec::new();
    for probe in &config.probes {
        let mut between: BTreeMap<[&str; 2], Vec<usize>> = BTreeMap::new();
        for (j, regions) in around.by_ref().take(probe.points.len()).enumerate() {
            let Some(&first) = regions.first() else { continue };
            let taken = name(first);
            if let Some(other) = regions.iter().find(|&&other| flux_density_jumps(config, taken, name(other)))
            {
                between.entry([taken, name(*other)]).or_default().push(j);
            }
        }
        warnings.extend(between.into_iter().map(|([taken, other], points)| {
            let more = match points.len() - 1 {
                0 => String::new(),
                more => format!(", and {more} more of them,"),
            };
            format!(
                "the point {}{more} of the probe `{}` lies between `{taken}` and `{other}`, where B jumps: it is that in `{taken}`; move it \
                 to the side that is meant",
                millimetres(probe.points[points[0]]),
                probe.name
            )
        }));
    }
    warnings
}

/// Whether the part of B along a face jumps between two regions: permeabilities, curves or magnets differ.
fn flux_density_jumps(config: &Config, region: &str, other: &str) -> bool {
    let own = |region: &str| {
        let entry = config.regions.get(region);
        let curve = entry
            .map(|own| &own.material)
            .filter(|name| config.materials.get(*name).is_some_and(|m| m.saturates()));
        (material(config, region).relative_permeability, curve, entry.and_then(|own| own.remanence))
    };
    own(region) != own(other)
}

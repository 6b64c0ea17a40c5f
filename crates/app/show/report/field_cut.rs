//! A field on the plane of a window: coloured triangles, and the range that their colours stand for.

use std::collections::BTreeMap;

use fluxmorph_geometry::RegionId;
use fluxmorph_geometry::tet4::{Point, area_vector, dot};

use super::cut::{NodeMeans, Patch};
use super::data::{RunData, Snapshot};
use super::plot::WIDE;
use super::ticks::Count;
use super::window::Window;
use crate::build::Outline;

/// Shares of the area below the colours' lowest value, and up to their highest: the field is infinite at edges.
const QUANTILES: [f64; 2] = [0.005, 0.998];

/// A field on the plane.
pub(super) struct FieldCut<'a> {
    pub(super) field: &'a Snapshot,
    pub(super) triangles: Vec<CutTriangle>,
}

/// A part of an element in the plane.
pub(super) struct CutTriangle {
    /// Corners [m], with |B| at them [T].
    pub(super) patch: Patch,
    pub(super) region: RegionId,
    /// [m²]
    area: f64,
    /// Its middle on the page [mm], where that is in the window.
    middle: Option<[f64; 2]>,
}

impl<'a> FieldCut<'a> {
    /// What the window shows of a field.
    pub(super) fn new(window: &Window, outline: &Outline, field: &'a Snapshot) -> Self {
        let topology = outline.mesh.topology();
        let means = NodeMeans { topology, points: &field.points, values: &field.flux_density };
        let mut triangles = Vec::new();
        for e in topology.elements() {
            let points = topology.tet(e).map(|n| field.points[n.index()]);
            if !window.plane.cuts(&points) || !window.shows(&points) {
                continue;
            }
            let region = topology.region_of()[e.index()];
            let patches = window.plane.of_tet(points, means.of_element(e)).into_iter();
            triangles.extend(patches.map(|patch| CutTriangle::new(window, patch, region)));
        }
        Self { field, triangles }
    }

    /// Middles of the regions on the page [mm], as far as they lie in the window.
    pub(super) fn middles(&self) -> BTreeMap<RegionId, [f64; 2]> {
        let mut sums = BTreeMap::<RegionId, ([f64; 2], f64)>::new();
        for triangle in &self.triangles {
            if let Some(middle) = triangle.middle {
                let (sum, total) = sums.entry(triangle.region).or_default();
                (0..2).for_each(|d| sum[d] += triangle.area * middle[d]);
                *total += triangle.area;
            }
        }
        let known = sums.into_iter().filter(|(_, (_, total))| *total > 0.0);
        known.map(|(region, (sum, total))| (region, sum.map(|s| s / total))).collect()
    }
}

impl CutTriangle {
    fn new(window: &Window, patch: Patch, region: RegionId) -> Self {
        let corners = patch.map(|(p, _)| p);
        let area = dot(area_vector(corners), window.page.normal).abs();
        let middle: Point = std::array::from_fn(|d| corners.iter().map(|c| c[d]).sum::<f64>() / 3.0);
        let middle = Some(window.page.flat(middle)).filter(|place| window.holds(*place));
        Self { patch, region, area, middle }
    }
}

/// The colours' range in millitesla, for all cuts alike; `None` where they are empty.
///
/// Of the regions without an entry of their own, where there are any: the field in iron is a hundred times that around
/// it, and would leave the others one colour.
pub(super) fn colour_range(
    data: &RunData,
    outline: &Outline,
    cuts: &[FieldCut<'_>],
) -> Option<(f64, f64, Count)> {
    let names = outline.mesh.topology().region_names();
    let is_air = |t: &&CutTriangle| !data.config.regions.contains_key(&names[t.region.index()]);
    let triangles = || cuts.iter().flat_map(|cut| &cut.triangles);
    let has_air = triangles().any(|triangle| is_air(&triangle));
    let shown = triangles().filter(|t| t.middle.is_some() && (!has_air || is_air(t)));
    let value = |t: &CutTriangle| 1e3 * (t.patch.iter().map(|(_, v)| v).sum::<f64>() / 3.0);
    let mut samples: Vec<(f64, f64)> = shown.map(|t| (value(t), t.area)).collect();
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [low, high] = QUANTILES.map(|share| quantile(&samples, share));
    let (low, high) = (low?, high?);
    let lowest = low.max(1e-4 * high);
    Some(if high <= 0.0 {
        (0.0, 1.0, Count::Linear)
    } else if high / lowest > WIDE {
        (lowest, high, Count::Logarithmic)
    } else {
        (if low < 0.3 * high { 0.0 } else { low }, high, Count::Linear)
    })
}

/// The value that a share of the whole weight does not exceed; samples are values with weights, ascending.
fn quantile(samples: &[(f64, f64)], share: f64) -> Option<f64> {
    let total: f64 = samples.iter().map(|(_, weight)| weight).sum();
    let mut below = 0.0;
    let found = samples.iter().find(|(_, weight)| {
        below += weight;
        below >= share * total
    });
    found.or(samples.last()).map(|(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn a_quantile_goes_by_weight() {
        let samples = [(1.0, 1.0), (2.0, 7.0), (9.0, 2.0)];
        assert_eq!(
            [0.05, 0.5, 0.8, 0.81, 1.0].map(|s| quantile(&samples, s)),
            [1.0, 2.0, 2.0, 9.0, 9.0].map(Some)
        );
        assert_eq!(quantile(&[], 0.5), None);
    }
}

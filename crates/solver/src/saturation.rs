//! How far every region with a B–H curve goes into it.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::tet4::{Point, centroid, volume};

use crate::bh::{BhCurve, peak};
use crate::model::FieldModel;
use crate::solution::FieldState;

/// The saturation of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Saturation {
    /// Its name.
    pub region: String,
    /// The largest `|B|` of an element's mean field [T], in harmonics at its peak.
    pub highest: f64,
    /// Where [m].
    pub place: Point,
    /// The last `B` of the curve's points [T]; `None` for a closed form.
    pub end: Option<f64>,
    /// The `B` above which the differential permeability is below a tenth of its largest [T]; `None` where there is none.
    pub knee: Option<f64>,
    /// Share of the volume in which the differential permeability is below a tenth of its largest.
    pub share_beyond_knee: f64,
}

/// Every region with a B–H curve, in the order of the regions.
pub fn by_region((model, mesh, solution): FieldState<'_>) -> Vec<Saturation> {
    let topology = model.topology();
    let elements = model.elements_with_a_law();
    let mut found: Vec<Option<(Saturation, [f64; 2])>> = vec![None; topology.region_names().len()];
    let sizes = solution.flux_densities_of(model, mesh, elements);
    for (&e, b) in elements.iter().zip(sizes) {
        let size = peak(b);
        let region = topology.region_of()[e.index()].index();
        let (saturation, volumes) = found[region]
            .get_or_insert_with(|| (of_region(model, &topology.region_names()[region], e), [0.0; 2]));
        if size > saturation.highest {
            (saturation.highest, saturation.place) = (size, centroid(mesh.vertices(e)));
        }
        let v = volume(mesh.vertices(e));
        volumes[0] += if saturation.knee.is_some_and(|knee| size > knee) { v } else { 0.0 };
        volumes[1] += v;
    }
    let share = |(saturation, [beyond, all]): (Saturation, [f64; 2])| Saturation {
        share_beyond_knee: beyond / all,
        ..saturation
    };
    found.into_iter().flatten().map(share).collect()
}

fn of_region(model: &FieldModel, name: &str, e: ElementId) -> Saturation {
    Saturation {
        region: name.to_owned(),
        highest: 0.0,
        place: [0.0; 3],
        end: model.curve_of(e).and_then(|curve| curve.end()).map(|[_, b]| b),
        knee: model.curve_of(e).and_then(BhCurve::knee),
        share_beyond_knee: 0.0,
    }
}
